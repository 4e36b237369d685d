//! Why an exploration found nothing.

use touchup_features::features::fit::FitError;

/// Why there is no feature.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExploreError {
    /// The ball never fell in.
    #[error(
        "nothing within {radius_mm:.1} mm of the flag that a ball of {ball_mm:.1} mm goes into: flag it nearer, or take a smaller ball"
    )]
    NotFound {
        /// radius of the search, mm
        radius_mm: f64,
        /// diameter of the ball, mm
        ball_mm: f64,
    },
    /// The surface is the same all around.
    #[error("the surface does not end within {radius_mm:.1} mm of the flag: flag the edge nearer")]
    NoEdge {
        /// radius of the search, mm
        radius_mm: f64,
    },
    /// Too few walls.
    #[error(
        "a wall was touched in only {walls} of {asked} directions: is it a {kind}, and no wider than {reach_mm:.0} mm?"
    )]
    NoWall {
        /// kind of the feature
        kind: &'static str,
        /// touched walls
        walls: usize,
        /// tried directions
        asked: usize,
        /// reach of the search, mm
        reach_mm: f64,
    },
    /// A slot without an end.
    #[error(
        "an end of the slot was not touched in {searches} searches along it: is it open? Then probe its edges"
    )]
    NoEnd {
        /// searches towards the end
        searches: usize,
    },
    /// The ball touches the ground before the wall.
    #[error(
        "the wall of the {kind} is {height_mm:.1} mm high, too low for a ball of {ball_mm:.1} mm: take a smaller one"
    )]
    TooLow {
        /// kind of the feature
        kind: &'static str,
        /// height of the wall, mm
        height_mm: f64,
        /// diameter of the ball, mm
        ball_mm: f64,
    },
    /// Contacts that the fit leaves out, and that agree among themselves.
    #[error(
        "{misfits} of {of} contacts{since} lie together {how} the surface of the others, which no outliers do: it has a step there, or \
         probe or part moved between them; look, and flag nearer what is wanted",
        since = since.map(|touch| format!(", all from touch {touch} on,")).unwrap_or_default()
    )]
    TwoSurfaces {
        /// contacts off the surface
        misfits: usize,
        /// all contacts
        of: usize,
        /// distance and side
        how: String,
        /// first of them, from 0 on, if they are the later ones
        since: Option<u32>,
    },
    /// Touches of another surface than expected.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Too few touches.
    #[error("{touches} touches are not enough: it is not measured yet; allow more")]
    NotDone {
        /// touches made
        touches: usize,
    },
    /// A kind without a pattern.
    #[error("a {kind} is not probed by itself: probe the edges that meet in it")]
    NoPattern {
        /// name of the kind
        kind: &'static str,
    },
    /// A number that the kind does not have.
    #[error("a {kind} has no {number}: ask for another number, or for all")]
    NoSuchNumber {
        /// name of the kind
        kind: &'static str,
        /// requested number
        number: &'static str,
    },
}
