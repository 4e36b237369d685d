//! The adjustment of a whole session.

use std::collections::BTreeMap;

use super::along_time::{ChangeFit, ChangeSearch};
use super::force_adjustment::{ForceAdjustment, SlidingPress};
use super::merged::merged;
use super::numbers::SessionNumbers;
use super::pressed_surface::{PressedSurface, pressed_surfaces};
use super::problem::{SessionProblem, SolvedSession};
use super::recorded_press::RecordedPress;
use super::session_change::{ChangeCause, SessionChange};

/// Number of rounds of surfaces found in the presses, as the session is known until then.
const ROUNDS: usize = 2;

/// Numbers of a session as its presses show them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SessionAdjustment {
    pub found: SessionNumbers,
    /// standard uncertainties: the posterior's
    pub sigma: SessionNumbers,
    /// what changed while it lasted
    pub change: Option<LikelyChange>,
    /// what is wrong with the forces
    pub force: Option<ForceAdjustment>,
    /// number of presses on surfaces
    pub presses: usize,
    /// number of surfaces
    pub surfaces: usize,
}

/// The likeliest change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LikelyChange {
    pub change: SessionChange,
    /// natural logarithm of the odds against the likeliest other cause, or none
    pub odds: f64,
}

impl SessionAdjustment {
    /// Adjusts a session; `None` without surfaces in its presses.
    ///
    /// - `presses`: in the order of their stamps. `radius`: of the ball, m. `told`: numbers at the
    ///   start. `prior`: their standard uncertainties before the presses.
    pub(crate) fn of(
        presses: &[RecordedPress],
        radius: f64,
        told: SessionNumbers,
        prior: SessionNumbers,
    ) -> Option<Self> {
        if presses.is_empty() {
            return None;
        }
        let problem = SessionProblem {
            presses,
            radius,
            told,
            prior,
            change: None,
        };
        let surfaces = felt_surfaces(&problem, &told);
        let fits = ChangeSearch::fits(problem, &surfaces);
        let ChangeFit {
            change,
            mut numbers,
            ..
        } = *fits.first()?;
        let mut problem = SessionProblem { change, ..problem };
        for _ in 0..ROUNDS {
            let surfaces = felt_surfaces(&problem, &numbers);
            problem.change = ChangeSearch::at_likeliest_time(problem, &surfaces);
            numbers = problem.solved(surfaces, numbers)?.found;
        }
        let solved = solution(&problem, numbers)?;
        let sliding = sliding_presses(&problem, &solved);
        Some(Self {
            found: solved.found,
            sigma: solved.sigma,
            change: LikelyChange::of(&fits, problem.change),
            force: ForceAdjustment::of(&sliding),
            presses: solved.misfits.len(),
            surfaces: solved.surfaces.len(),
        })
    }
}

/// Surfaces with all presses that felt the same places.
fn felt_surfaces(problem: &SessionProblem, numbers: &SessionNumbers) -> Vec<PressedSurface> {
    let change = problem.change.as_ref();
    let pressed = pressed_surfaces(problem.presses, problem.radius, numbers, change);
    merged(problem, pressed, numbers)
}

/// A session with the surfaces that it shows with these numbers.
fn solution(problem: &SessionProblem, numbers: SessionNumbers) -> Option<SolvedSession> {
    let change = problem.change.as_ref();
    let (surfaces, _) = pressed_surfaces(problem.presses, problem.radius, &numbers, change);
    problem.solved(surfaces, numbers)
}

/// All presses that slide along the surface that they are on, in their order.
fn sliding_presses(problem: &SessionProblem, solved: &SolvedSession) -> Vec<SlidingPress> {
    let on_surface = solved.surfaces.iter().flat_map(|surface| {
        let presses = surface.presses.iter();
        presses.map(move |&at| (at, surface))
    });
    let on_surface: BTreeMap<u32, &PressedSurface> = on_surface.collect();
    let sliding = on_surface.into_iter().filter_map(|(at, surface)| {
        let placed = problem.placed(at, &solved.found);
        let (_, normal, _) = surface.at(&placed.centre);
        let recorded = placed.turn.inverse_transform_vector(&normal);
        SlidingPress::of(&problem.presses[at as usize], &recorded)
    });
    sliding.collect()
}

impl LikelyChange {
    /// - `fits`: the likeliest first. `change`: the first of them at its likeliest time.
    fn of(fits: &[ChangeFit], change: Option<SessionChange>) -> Option<Self> {
        let cause = |fit: &ChangeFit| fit.change.map(|change| change.cause);
        let changed = |fit: &ChangeFit| cause(fit).map(ChangeCause::changed);
        let best = fits.first()?;
        let other = fits.iter().find(|fit| changed(fit) != changed(best))?;
        Some(Self {
            change: change?,
            odds: best.likelihood - other.likelihood,
        })
    }
}
