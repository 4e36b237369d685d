//! What changed while the session lasted, and when: alternatives that compete for the presses.

use nalgebra::Point3;

use super::numbers::SessionNumbers;
use super::pressed_surface::PressedSurface;
use super::problem::{SessionProblem, SolvedSession};
use super::session_change::{ChangeCause, ChangeCourse, SessionChange};
use touchup_geometry::numeric::mean;

/// Number of parts of a session between times of a change that are tried first, and number of parts
/// of the time between two of these that are tried next, again and again.
const PARTS: usize = 16;
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
        let freedoms = change.map_or(0, |change| change.cause.freedoms() + 1) as f64;
        ChangeFit {
            change,
            numbers: solved.found,
            likelihood: -solved.cost(self.scale) / self.alike
                - freedoms / 2.0 * count.max(1.0).ln(),
        }
    }

    /// A change at the likeliest time around its own.
    fn likeliest_time(&self, fit: ChangeFit) -> ChangeFit {
        let presses = self.problem.presses;
        let mut width = presses.len() / PARTS;
        let mut best = fit;
        while let Some(SessionChange {
            course: ChangeCourse::At(at),
            cause,
            about,
        }) = best.change
            && width > 0
        {
            let middle = presses.partition_point(|press| press.stamp_ns < at);
            let finer = width.div_ceil(FINER);
            let times = (middle.saturating_sub(width)..middle + width).step_by(finer);
            let times = times.filter(|&time| time > 0 && time < presses.len());
            let change = |time: usize| SessionChange {
                cause,
                course: ChangeCourse::At(presses[time].stamp_ns),
                about,
            };
            for change in times.map(change) {
                if let Some(solved) = solved(&self.problem, self.surfaces, Some(change)) {
                    let fit = self.fit(Some(change), &solved);
                    if fit.likelihood > best.likelihood {
                        best = fit;
                    }
                }
            }
            width = if finer > 1 { finer } else { 0 };
        }
        best
    }
}

fn solved(
    problem: &SessionProblem,
    surfaces: &[PressedSurface],
    change: Option<SessionChange>,
) -> Option<SolvedSession> {
    let problem = SessionProblem { change, ..*problem };
    problem.solved(surfaces.to_vec(), problem.told)
}

fn changes(problem: &SessionProblem) -> impl Iterator<Item = SessionChange> {
    let presses = problem.presses;
    let about = Point3::from(mean(presses.iter().map(|press| press.centre.coords)));
    let stamp = |at: usize| presses[at.min(presses.len() - 1)].stamp_ns;
    let at = |part: usize| ChangeCourse::At(stamp(part * presses.len() / PARTS));
    let drift = ChangeCourse::Between(stamp(0), stamp(presses.len()));
    let courses: Vec<ChangeCourse> = (1..PARTS).map(at).chain([drift]).collect();
    let causes = [
        ChangeCause::PartShifted,
        ChangeCause::PartMoved,
        ChangeCause::TipBent,
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
