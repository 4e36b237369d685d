//! What changed while the session lasted, and when: alternatives that compete for the presses.

use nalgebra::Point3;

use super::numbers::SessionNumbers;
use super::pressed_surface::PressedSurface;
use super::problem::{SessionProblem, SolvedSession};
use super::recorded_press::RecordedPress;
use super::session_change::{ChangeCause, SessionChange};
use touchup_geometry::numeric::mean;
use touchup_method::stylus::ChangeCourse;

/// Number of parts of a session between times of a change that are tried first, and number of parts
/// of the time between two of these that are tried next, again and again.
pub(super) const CHANGE_PARTS: usize = 16;
const FINER: usize = 8;

/// A change, and the session with it.
pub(super) struct ChangeFit {
    pub change: Option<SessionChange>,
    pub numbers: SessionNumbers,
    /// natural logarithm of its likelihood, with a price for its unknowns
    pub likelihood: f64,
}

/// Presses on surfaces, each with all presses on one place.
pub(super) struct ChangeSearch<'a> {
    problem: SessionProblem<'a>,
    surfaces: &'a [PressedSurface],
    /// usual misfit, m, and number of presses that count as one
    scale: f64,
    alike: f64,
}

impl<'a> ChangeSearch<'a> {
    /// All alternatives, the likeliest first; none without surfaces.
    pub(super) fn fits(
        problem: SessionProblem<'a>,
        surfaces: &'a [PressedSurface],
    ) -> Vec<ChangeFit> {
        let all = [None].into_iter().chain(changes(&problem).map(Some));
        let solved = all.filter_map(|change| Some((change, solved(&problem, surfaces, change)?)));
        let solved: Vec<(Option<SessionChange>, SolvedSession)> = solved.collect();
        let of_all = solved.iter().map(|(_, of)| of);
        let Some(best) = of_all.min_by(|a, b| a.scale.total_cmp(&b.scale)) else {
            return Vec::new();
        };
        let search = Self::with(problem, surfaces, best);
        let fits = solved.iter().map(|(change, of)| search.fit(*change, of));
        let mut fits: Vec<ChangeFit> = fits.collect();
        fits.sort_by(|a, b| b.likelihood.total_cmp(&a.likelihood));
        fits
    }

    /// The change of a problem at its likeliest time, around that of the problem.
    pub(super) fn at_likeliest_time(
        problem: SessionProblem<'a>,
        surfaces: &'a [PressedSurface],
    ) -> Option<SessionChange> {
        let solved = solved(&problem, surfaces, problem.change)?;
        let search = Self::with(problem, surfaces, &solved);
        search
            .likeliest_time(search.fit(problem.change, &solved))
            .change
    }

    fn with(
        problem: SessionProblem<'a>,
        surfaces: &'a [PressedSurface],
        of: &SolvedSession,
    ) -> Self {
        Self {
            problem,
            surfaces,
            scale: of.scale,
            alike: of.alike,
        }
    }

    fn fit(&self, change: Option<SessionChange>, solved: &SolvedSession) -> ChangeFit {
        let count = solved.misfits.len() as f64 / self.alike;
        // its size and its time
        let freedoms = change.map_or(0, |change| change.cause.freedoms() + 1);
        ChangeFit {
            change,
            numbers: solved.found,
            likelihood: -solved.cost(self.scale) / self.alike - price(freedoms, count),
        }
    }

    /// A change at the likeliest time around its own.
    fn likeliest_time(&self, fit: ChangeFit) -> ChangeFit {
        let presses = self.problem.presses;
        let Some(SessionChange {
            course: ChangeCourse::At(at),
            cause,
            about,
        }) = fit.change
        else {
            return fit;
        };
        let from = presses.partition_point(|press| press.stamp_ns < at);
        let at_time = |time: usize| {
            let change = SessionChange {
                cause,
                course: before(presses, time),
                about,
            };
            let solved = solved(&self.problem, self.surfaces, Some(change))?;
            Some(self.fit(Some(change), &solved))
        };
        let likeliest = likeliest_time(presses.len(), from, at_time, &|fit| fit.likelihood);
        likeliest.unwrap_or(fit)
    }
}

/// The likeliest of fits at times around one, in ever finer steps.
///
/// - `count`: of presses. `from`: number of the press at that time. `fit`: with a change at a press.
pub(super) fn likeliest_time<T>(
    count: usize,
    from: usize,
    fit: impl Fn(usize) -> Option<T>,
    likelihood: &dyn Fn(&T) -> f64,
) -> Option<T> {
    let mut width = count / CHANGE_PARTS;
    let mut best = (from, fit(from)?);
    while width > 0 {
        let finer = width.div_ceil(FINER);
        let times = (best.0.saturating_sub(width)..best.0 + width).step_by(finer);
        for time in times.filter(|&time| time > 0 && time < count) {
            if let Some(other) = fit(time)
                && likelihood(&other) > likelihood(&best.1)
            {
                best = (time, other);
            }
        }
        width = if finer > 1 { finer } else { 0 };
    }
    Some(best.1)
}

/// Price of unknowns in natural logarithms of the likelihood: half of the logarithm of the number of
/// observations for each.
pub(super) fn price(unknowns: usize, observations: f64) -> f64 {
    unknowns as f64 / 2.0 * observations.max(1.0).ln()
}

fn solved(
    problem: &SessionProblem,
    surfaces: &[PressedSurface],
    change: Option<SessionChange>,
) -> Option<SolvedSession> {
    let problem = SessionProblem { change, ..*problem };
    problem.solved(surfaces.to_vec(), problem.told)
}

/// A change in the middle between a press and the one before it.
fn before(presses: &[RecordedPress], at: usize) -> ChangeCourse {
    let [last, next] = [at.saturating_sub(1), at].map(|at| presses[at].stamp_ns);
    ChangeCourse::At(next - next.saturating_sub(last) / 2)
}

fn changes(problem: &SessionProblem) -> impl Iterator<Item = SessionChange> {
    let presses = problem.presses;
    let about = Point3::from(mean(presses.iter().map(|press| press.centre.coords)));
    let stamp = |at: usize| presses[at.min(presses.len() - 1)].stamp_ns;
    let at = |part: usize| before(presses, part * presses.len() / CHANGE_PARTS);
    let drift = ChangeCourse::Between(stamp(0), stamp(presses.len()));
    let courses: Vec<ChangeCourse> = (1..CHANGE_PARTS).map(at).chain([drift]).collect();
    let causes = [
        ChangeCause::PartShifted,
        ChangeCause::PartMoved,
        ChangeCause::TipBent,
        ChangeCause::StiffnessChanged,
    ];
    causes.into_iter().flat_map(move |cause| {
        let change = move |course| SessionChange {
            cause,
            course,
            about,
        };
        courses.clone().into_iter().map(change)
    })
}
