//! Error decay from sweep to sweep \[paper, Sec 4.3 and Fig 11\]: the published rule on a guided
//! stylus, and the robust mode on a raster, each with an exponential and a power-law fit.

mod decay;
mod errors;
mod one_face;
mod sweeps;
mod text;

pub use decay::{Decay, RegressionLine, fit_decay, straight_line};
pub use errors::MeshErrors;
pub use one_face::{OneFaceRun, OneFaceSample};
pub(super) use sweeps::region_over;
pub use sweeps::{BLOWN_UP, PaperSweeps, RobustSweeps, noisy, raster_samples};

use super::Effort;
use super::error::{MeasureError, MeasureResult};
use touchup_method::names;
use touchup_method::stylus::Sample;
use touchup_sim::Peaks;

names! {
    /// Rule of the sweeps.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Rule {
        /// the published rule, 20 s on each face, faces compared by index
        Paper = "published rule",
        /// the repaired rule, one raster a sweep, compared with the surface
        Robust = "robust mode",
    }
}

/// The sweeps over one scan.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepRun {
    /// rule of the sweeps
    pub rule: Rule,
    /// seed of the scan's noise
    pub seed: u64,
    /// edge of the scan's squares, mm
    pub edge_mm: f64,
    /// before the first sweep and after each completed one
    pub errors: Vec<MeshErrors>,
    /// the error grew to twice its start
    pub has_blown_up: bool,
    /// cause of an early end, in words
    pub ended: Option<String>,
    /// both laws from sweep 1 on; `None` for fewer than three sweeps, or a run that blew up
    pub decay: Option<Decay>,
}

/// Error from sweep to sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Convergence {
    /// requested sweeps
    pub sweeps: usize,
    /// each scan with each rule
    pub runs: Vec<SweepRun>,
    /// one face from three starts
    pub one_face: Vec<OneFaceRun>,
    /// setup failures of a rule, in words
    pub failed: Vec<String>,
}

/// Edges of the scans, m: as in the paper's figure, and as in tests of the robust mode.
const PAPER_EDGE: f64 = 10e-3;
const ROBUST_EDGE: f64 = 5e-3;
/// Seed of the first scan: its initial error equals the paper's.
const FIRST_SEED: u64 = 3;
/// Time in which one face comes to rest, s.
const ONE_FACE_S: usize = 40;
/// Friction of the raster.
const FRICTION: f64 = 0.15;
/// Fewest sweeps for the fit of a law.
const FEWEST_SWEEPS: usize = 3;

impl SweepRun {
    /// Makes up to `count` sweeps by `sweep`, from the error `start`.
    fn of(
        (rule, seed, edge): (Rule, u64, f64),
        start: MeshErrors,
        count: usize,
        mut sweep: impl FnMut() -> MeasureResult<MeshErrors>,
    ) -> Self {
        let (mut errors, mut ended, mut has_blown_up) = (vec![start], None, false);
        for number in 1..=count {
            ended = match sweep() {
                Ok(now) => {
                    errors.push(now);
                    has_blown_up = now.distance_mm > BLOWN_UP * start.distance_mm;
                    has_blown_up.then(|| format!("blew up in sweep {number}"))
                }
                Err(error) => Some(format!("sweep {number}: {error}")),
            };
            if ended.is_some() {
                break;
            }
        }
        let distances: Vec<f64> = errors[1..].iter().map(|error| error.distance_mm).collect();
        let is_whole = ended.is_none() && distances.len() >= FEWEST_SWEEPS;
        let decay = if is_whole {
            fit_decay(&distances)
        } else {
            None
        };
        Self {
            rule,
            seed,
            edge_mm: edge * 1e3,
            errors,
            has_blown_up,
            ended,
            decay,
        }
    }

    /// Whether all sweeps ran and the last left less error than the start.
    pub fn has_converged(&self) -> bool {
        let (first, last) = (self.errors.first(), self.errors.last());
        self.ended.is_none()
            && first
                .zip(last)
                .is_some_and(|(first, last)| last.distance_mm < first.distance_mm)
    }
}

/// Sweeps over several noisy scans of `peaks` by both rules.
pub fn convergence(effort: Effort, progress: &mut dyn FnMut(&str)) -> Convergence {
    let (scans, sweeps) = (effort.choose(2, 6), effort.choose(4, 10));
    let seeds = FIRST_SEED..FIRST_SEED + scans;
    let mut runs = Vec::new();
    for seed in seeds.clone() {
        progress(&format!("convergence: published rule, scan {seed}"));
        runs.push(paper_run(seed, sweeps));
    }
    let peaks = Peaks::default();
    progress("convergence: touching peaks");
    match raster_samples(&peaks, FRICTION) {
        Err(error) => runs.push(Err(error)),
        Ok(samples) => runs.extend(seeds.map(|seed| {
            progress(&format!("convergence: robust mode, scan {seed}"));
            robust_run(&peaks, &samples, seed, sweeps)
        })),
    }
    progress("convergence: one face");
    let one_face = one_face::one_face_runs(ONE_FACE_S);
    let why = |error: &MeasureError| error.to_string();
    let failed = runs
        .iter()
        .filter_map(|run| run.as_ref().err().map(why))
        .chain(one_face.as_ref().err().map(why));
    let failed = failed.collect();
    Convergence {
        sweeps,
        runs: runs.into_iter().flatten().collect(),
        one_face: one_face.unwrap_or_default(),
        failed,
    }
}

fn paper_run(seed: u64, sweeps: usize) -> MeasureResult<SweepRun> {
    let mut run = PaperSweeps::new(PAPER_EDGE, None, seed)?;
    let start = run.errors();
    Ok(SweepRun::of(
        (Rule::Paper, seed, PAPER_EDGE),
        start,
        sweeps,
        || run.sweep(start.distance_mm),
    ))
}

fn robust_run(
    peaks: &Peaks,
    samples: &[Sample],
    seed: u64,
    sweeps: usize,
) -> MeasureResult<SweepRun> {
    let mut run = RobustSweeps::new(peaks, noisy(&peaks.mesh(ROBUST_EDGE)?, seed), samples)?;
    Ok(SweepRun::of(
        (Rule::Robust, seed, ROBUST_EDGE),
        run.errors(),
        sweeps,
        || run.sweep(),
    ))
}

impl Convergence {
    /// The runs of one rule.
    pub fn of(&self, rule: Rule) -> impl Iterator<Item = &SweepRun> {
        self.runs.iter().filter(move |run| run.rule == rule)
    }

    /// Number of a rule's runs whose power law explains more than their exponential, and number of
    /// its runs with fits.
    pub fn power_wins(&self, rule: Rule) -> (usize, usize) {
        let fits: Vec<&Decay> = self.of(rule).filter_map(|run| run.decay.as_ref()).collect();
        (
            fits.iter()
                .filter(|fit| fit.power.left < fit.exponential.left)
                .count(),
            fits.len(),
        )
    }
}
