//! Work-precision of one face held against one sample: error at the end against run time and
//! against evaluations of the right-hand side, for explicit, implicit and exact integrators, from
//! the paper's stiffness to h_min = 1 nm.

mod method;
mod problem;
mod rosenbrock;
mod text;

use std::hint::black_box;

pub use method::{Method, SolverResult, SolverSetting};
pub use problem::Problem;

use super::{Effort, Spread, timed};
use touchup_document::number::three_digits;

/// The paper's h_min, m.
pub const PAPER_H_MIN_M: f64 = 0.5e-3;
/// h_min from the mildest to the stiffest, m.
const H_MINS_M: [f64; 8] = [1e-3, PAPER_H_MIN_M, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
const H_MINS_QUICK_M: [f64; 4] = [1e-3, PAPER_H_MIN_M, 1e-6, 1e-9];
/// Tilts without friction, and as in real force streams: 4 to 28° occur.
const TILTS_DEG: [f64; 2] = [0.0, 20.0];
/// Accuracy of the reference: to this share of h_min, or to a few roundings of the travel.
const REFERENCE_SHARE: f64 = 1e-12;
const REFERENCE_ROUNDINGS: f64 = 4.0;

/// All work-precision measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkPrecision {
    /// one for each stiffness and tilt
    pub cases: Vec<FaceCase>,
    /// repeats of each timing
    pub repeats: usize,
    /// cases without a reference
    pub without_reference: Vec<String>,
}

/// One face, one sample, every integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceCase {
    /// m
    pub h_min_m: f64,
    /// angle between force and normal, degrees
    pub tilt_deg: f64,
    /// exact displacement of the face, m
    pub travel_m: f64,
    /// resolution of the reference, m: smaller errors show as this value
    pub floor_m: f64,
    /// one for each of [`Method::ALL`]
    pub curves: Vec<Curve>,
}

/// One integrator over its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// integrator
    pub method: Method,
    /// from coarse to fine, without failed settings
    pub points: Vec<IntegratorRun>,
    /// number of settings at which it gave up
    pub gave_up: usize,
}

/// One integrator with one setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegratorRun {
    /// steps, or tolerance
    pub setting: SolverSetting,
    /// error of the barycentre at the end, m
    pub error_m: f64,
    /// |n − n_ref| at the end: the angle, rad, and the error of the length
    pub normal_error: f64,
    /// as in [`SolverResult`]
    pub evaluations: u64,
    /// for the whole sample, s
    pub time_s: Spread,
}

impl WorkPrecision {
    /// Measures all cases.
    pub fn measure(effort: Effort, progress: &mut dyn FnMut(&str)) -> Self {
        let repeats = effort.choose(9, 31);
        let h_mins = effort.choose(&H_MINS_QUICK_M[..], &H_MINS_M[..]);
        let mut measured = Self {
            cases: Vec::new(),
            repeats,
            without_reference: Vec::new(),
        };
        for (h_min_m, tilt_deg) in h_mins
            .iter()
            .flat_map(|h_min| TILTS_DEG.map(|tilt| (*h_min, tilt)))
        {
            let name = format!(
                "h_min {} mm, force tilted by {tilt_deg}°",
                three_digits(1e3 * h_min_m)
            );
            progress(&format!("work-precision: {name}"));
            match case(h_min_m, tilt_deg, effort, repeats) {
                Some(case) => measured.cases.push(case),
                None => measured.without_reference.push(name),
            }
        }
        measured
    }
}

/// One case; `None` without a reference.
fn case(h_min_m: f64, tilt_deg: f64, effort: Effort, repeats: usize) -> Option<FaceCase> {
    let problem = Problem::of(h_min_m, tilt_deg.to_radians());
    let right = problem.held().reference()?.face;
    let travel_m = right.b.coords.norm();
    let floor_m = (REFERENCE_SHARE * h_min_m).max(REFERENCE_ROUNDINGS * f64::EPSILON * travel_m);
    let curve = |method: Method| {
        let settings = method.settings(effort);
        let run = |&setting: &SolverSetting| {
            let SolverResult { face, evaluations } = method.solve(&problem, setting)?;
            let (error_m, normal_error) = (
                (face.b - right.b).norm().max(floor_m),
                (face.n - right.n).norm(),
            );
            let readings = (repeats, effort.choose(1e-4, 5e-4));
            let time_s = time(readings, || {
                method.solve(black_box(&problem), black_box(setting))
            });
            Some(IntegratorRun {
                setting,
                error_m,
                normal_error,
                evaluations,
                time_s,
            })
        };
        let points: Vec<_> = settings.iter().filter_map(run).collect();
        Curve {
            method,
            gave_up: settings.len() - points.len(),
            points,
        }
    };
    Some(FaceCase {
        h_min_m,
        tilt_deg,
        travel_m,
        floor_m,
        curves: Method::ALL.map(curve).to_vec(),
    })
}

/// Seconds per call: this number of readings, each over this duration, or one call.
fn time<T>((repeats, batch_s): (usize, f64), mut solve: impl FnMut() -> T) -> Spread {
    let mut seconds = |calls: usize| timed(|| (0..calls).for_each(|_| drop(black_box(solve())))).0;
    seconds(1);
    let mut calls = 1;
    // also warms up
    while calls < 1 << 20 && seconds(calls) < batch_s {
        calls *= 2;
    }
    let times = (0..repeats)
        .map(|_| seconds(calls) / calls as f64)
        .collect();
    Spread::of(times).unwrap_or(Spread::from(f64::NAN))
}

impl FaceCase {
    /// The curve of one integrator.
    pub fn curve(&self, method: Method) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.method == method)
    }

    /// The integrators that reach `error_m`, the fastest first.
    pub fn ranking(&self, error_m: f64) -> Vec<(Method, IntegratorRun)> {
        let reaching = self
            .curves
            .iter()
            .filter_map(|curve| Some((curve.method, curve.cheapest(error_m)?)));
        let mut ranking: Vec<_> = reaching.collect();
        ranking.sort_by(|a, b| a.1.time_s.median.total_cmp(&b.1.time_s.median));
        ranking
    }
}

impl Curve {
    /// The fastest point that reaches `error_m` with every finer one: a lucky hit does not count.
    pub fn cheapest(&self, error_m: f64) -> Option<IntegratorRun> {
        let reaching = self
            .points
            .iter()
            .rev()
            .take_while(|point| point.error_m <= error_m);
        reaching
            .min_by(|a, b| a.time_s.median.total_cmp(&b.time_s.median))
            .copied()
    }

    /// The run with the whole sample in a single step.
    pub fn one_step(&self) -> Option<&IntegratorRun> {
        self.points
            .iter()
            .find(|point| point.setting == SolverSetting::Steps(1))
    }
}
