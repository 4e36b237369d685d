//! The adjustment of a whole session.

use super::along_time::{ChangeFit, ChangeSearch};
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
        Some(Self {
            found: solved.found,
            sigma: solved.sigma,
            change: LikelyChange::of(&fits, problem.change),
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

impl LikelyChange {
    /// - `fits`: the likeliest first. `change`: the first of them at its likeliest time.
    fn of(fits: &[ChangeFit], change: Option<SessionChange>) -> Option<Self> {
        let cause = |fit: &ChangeFit| fit.change.map(|change| change.cause);
        let of_part = |fit: &ChangeFit| cause(fit).map(ChangeCause::is_of_part);
        let best = fits.first()?;
        let other = fits.iter().find(|fit| of_part(fit) != of_part(best))?;
        Some(Self {
            change: change?,
            odds: best.likelihood - other.likelihood,
        })
    }
}
