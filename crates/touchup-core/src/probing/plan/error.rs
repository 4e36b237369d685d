//! Why nothing was found.

use crate::features::fit::FitError;

/// Why there is no feature.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExploreError {
    /// The ball never fell in.
    #[error(
        "nothing within {radius_mm:.1} mm of the flag that a ball of {ball_mm:.1} mm goes into: flag it nearer, or take a smaller ball"
    )]
    NotFound {
        /// mm
        radius_mm: f64,
        /// diameter, mm
        ball_mm: f64,
    },
    /// The surface is the same all around.
    #[error("the surface does not end within {radius_mm:.1} mm of the flag: flag the edge nearer")]
    NoEdge {
        /// mm
        radius_mm: f64,
    },
    /// Too few walls.
    #[error(
        "a wall was touched in only {walls} of {asked} directions: is it a {kind}, and no wider than {reach_mm:.0} mm?"
    )]
    NoWall {
        /// the kind that was searched
        kind: &'static str,
        /// touched
        walls: usize,
        /// tried
        asked: usize,
        /// mm
        reach_mm: f64,
    },
    /// Nothing closes a slot.
    #[error(
        "an end of the slot was not touched in {searches} searches along it: is it open? Then probe its edges"
    )]
    NoEnd {
        /// made towards it
        searches: usize,
    },
    /// The ball touches the ground before the wall.
    #[error(
        "the wall of the {kind} is {height_mm:.1} mm high, too low for a ball of {ball_mm:.1} mm: take a smaller one"
    )]
    TooLow {
        /// the kind that was searched
        kind: &'static str,
        /// mm
        height_mm: f64,
        /// diameter, mm
        ball_mm: f64,
    },
    /// Contacts that the others leave out, and that agree among themselves.
    #[error(
        "{misfits} of {of} contacts{since} lie together {how} the surface of the others, which no outliers do: it has a step there, or \
         probe or part moved between them; look, and flag nearer what is wanted",
        since = since.map(|touch| format!(", all from touch {touch} on,")).unwrap_or_default()
    )]
    TwoSurfaces {
        /// that lie elsewhere
        misfits: usize,
        /// of how many
        of: usize,
        /// how far off, and to which side
        how: String,
        /// the first of them, from 0 on, where they are the later ones
        since: Option<u32>,
    },
    /// The touches are not of such a surface.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// More touches are needed.
    #[error("{touches} touches are not enough: it is not measured yet; allow more")]
    NotDone {
        /// made
        touches: usize,
    },
    /// There is no pattern for it.
    #[error("a {kind} is not probed by itself: probe the edges that meet in it")]
    NoPattern {
        /// what it is
        kind: &'static str,
    },
    /// It has no such number.
    #[error("a {kind} has no {number}: ask for another number, or for all")]
    NoSuchNumber {
        /// what it is
        kind: &'static str,
        /// as requested
        number: &'static str,
    },
}
