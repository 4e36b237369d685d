//! Error against run time on whole scans: each method of refining a scan by touch, on the same
//! scans and samples, with the paper's alternatives as baselines.
//!
//! The surface error covers the touched part, in both directions; the worse of the two counts. Runs
//! go in turns, so that a slowdown of the machine affects all of them.

mod baselines;
mod figures;
mod method;
mod part;
mod text;
mod touched_error;

pub use baselines::{ContactSculptor, GaussianParams, GaussianProcess, GaussianSurface};
use method::{MethodRun, RunLimits, run};
pub use method::{Reach, RefineMethod};
pub use part::GivenPart;
use part::{Part, parts};
pub use touched_error::TouchedError;

use super::convergence::straight_line;
use super::error::MeasureResult;
use super::{Effort, Spread};
use touchup_features::compare::CompareError;
use touchup_geometry::mesh::TriMesh;

/// One method on one scan.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodResult {
    /// method
    pub method: RefineMethod,
    /// name in the report
    pub name: String,
    /// error against the part; `None` if the result has nothing near the touches
    pub error: Option<TouchedError>,
    /// from the scan to the result, s
    pub total_s: Spread,
    /// per sample (or touch) given, including a share of the final work, µs
    pub per_sample_us: Spread,
    /// final work after the last sample, ms in total
    pub end_ms: Spread,
    /// number of runs
    pub runs: usize,
    /// samples or touches given
    pub samples: usize,
    /// share of updates cut back to keep the mesh sound
    pub cut_back_share: f64,
    /// the result is worse than the scan
    pub is_worse: bool,
    /// whether it stopped before the last sample
    pub is_stopped: bool,
    /// failures, in words
    pub remarks: Vec<String>,
}

/// All methods on one scan.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanResult {
    /// mean edge length of the scan, mm
    pub edge_mm: f64,
    /// faces of the scan
    pub faces: usize,
    /// error of the unrefined scan
    pub before: TouchedError,
    /// in order of trial
    pub methods: Vec<MethodResult>,
}

/// Cost of a touch for the Gaussian process.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianCost {
    /// number of touches kept, and time to add one more, µs; the medians of groups
    pub marks: Vec<(f64, Spread)>,
    /// exponent of the power law through the larger half of them
    pub exponent: f64,
    /// number of contacts
    pub contacts: usize,
    /// by that law, time to add the last contact if all were kept, µs
    pub at_all_contacts_us: f64,
}

/// One part with its scans.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseResult {
    /// name of the part
    pub name: String,
    /// number of samples
    pub samples: usize,
    /// time from the first to the last of them, s
    pub duration_s: f64,
    /// the first is the one for all methods
    pub scans: Vec<ScanResult>,
    /// cost of the Gaussian process, if measured
    pub gaussian: Option<GaussianCost>,
}

/// Error against run time on whole scans.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeScan {
    /// peaks, plate, and given parts
    pub cases: Vec<CaseResult>,
    /// runs of each method unless slow
    pub repeats: usize,
    /// a run longer than this is not repeated, s
    pub slow_s: f64,
}

/// Touches in a group of [`GaussianCost::marks`].
const GROUP: usize = 25;

impl MethodResult {
    /// Whether it reached the end with a result no worse than the scan.
    pub fn is_sound(&self) -> bool {
        self.error.is_some() && !self.is_worse && !self.is_stopped
    }

    /// Mean surface error, mm; infinite without a result.
    pub fn mean_mm(&self) -> f64 {
        self.error.map_or(f64::INFINITY, |error| error.mean_mm())
    }
}

impl ScanResult {
    /// One method on one scan, with its errors and times.
    pub fn of(&self, method: RefineMethod) -> Option<&MethodResult> {
        self.methods.iter().find(|result| result.method == method)
    }

    fn least<'a>(methods: impl Iterator<Item = &'a MethodResult>) -> Option<&'a MethodResult> {
        methods
            .filter(|result| result.is_sound())
            .min_by(|a, b| a.mean_mm().total_cmp(&b.mean_mm()))
    }

    /// The method with the least mean error.
    pub fn best(&self) -> Option<&MethodResult> {
        Self::least(self.methods.iter())
    }

    /// The region of the haptic update alone with the least mean error.
    pub fn best_haptic(&self) -> Option<&MethodResult> {
        Self::least(
            self.methods
                .iter()
                .filter(|result| matches!(result.method, RefineMethod::Robust(_))),
        )
    }

    /// Pareto front over mean error and time per sample, the fastest method first.
    pub fn front(&self) -> Vec<&MethodResult> {
        let mut methods: Vec<_> = self
            .methods
            .iter()
            .filter(|result| result.is_sound())
            .collect();
        methods.sort_by(|a, b| a.per_sample_us.median.total_cmp(&b.per_sample_us.median));
        let mut least = f64::INFINITY;
        methods.retain(|result| {
            let is_better = result.mean_mm() < least;
            least = least.min(result.mean_mm());
            is_better
        });
        methods
    }
}

impl CaseResult {
    /// The scan for all methods.
    pub fn main(&self) -> Option<&ScanResult> {
        self.scans.first()
    }
}

/// The runs of one method on one scan.
struct Trial<'a> {
    part: &'a Part,
    scan: &'a TriMesh,
    method: RefineMethod,
    /// for each run: total s, µs per sample, and ms after the last one
    times: Vec<[f64; 3]>,
    /// results common to all runs, and the touch times of the first
    first: Option<(MethodRun, Result<TouchedError, CompareError>)>,
}

impl Trial<'_> {
    fn run(&mut self, limits: &RunLimits) -> MeasureResult<()> {
        let run = run(self.method, self.part, self.scan, limits)?;
        let samples_s = run.fed.time_s + run.end_s;
        let per_sample_us = samples_s * 1e6 / run.fed.given.max(1) as f64;
        self.times
            .push([run.build_s + samples_s, per_sample_us, run.end_s * 1e3]);
        if self.first.is_none() {
            let error = self.part.error_of(&run.mesh);
            self.first = Some((run, error));
        }
        Ok(())
    }

    fn result(&self, before: &TouchedError) -> Option<MethodResult> {
        let (
            MethodRun {
                fed,
                offered,
                cut_back_share,
                ..
            },
            error,
        ) = self.first.as_ref()?;
        let is_sparse = self.method == RefineMethod::GaussianProcess;
        let is_stopped = fed.refused + fed.given < *offered && !is_sparse;
        let (why_undefined, error) = (error.as_ref().err(), error.as_ref().ok().copied());
        let is_worse = error.is_none_or(|error| error.mean_mm() > before.mean_mm());
        let remarks = [
            is_stopped.then(|| {
                format!(
                    "stopped for its time after {} of {offered} samples",
                    fed.given
                )
            }),
            (is_sparse && fed.given < *offered)
                .then(|| format!("given {} of {offered} contacts", fed.given)),
            fed.why
                .as_ref()
                .map(|why| format!("{} of {} samples refused: {why}", fed.refused, fed.given)),
            why_undefined.map(|why| format!("the error is undefined: {why}")),
            error.filter(|_| is_worse).map(|error| {
                format!(
                    "worse than the scan ({:.3} to {:.3} mm)",
                    before.mean_mm(),
                    error.mean_mm()
                )
            }),
        ];
        let spread =
            |which: usize| Spread::of(self.times.iter().map(|times| times[which]).collect());
        Some(MethodResult {
            method: self.method,
            name: self.method.name(),
            error,
            total_s: spread(0)?,
            per_sample_us: spread(1)?,
            end_ms: spread(2)?,
            runs: self.times.len(),
            samples: fed.given,
            cut_back_share: *cut_back_share,
            is_worse,
            is_stopped,
            remarks: remarks.into_iter().flatten().collect(),
        })
    }
}

/// Measures every method on peaks, on the plate, and on given parts.
///
/// # Errors
/// [`MeasureError`](crate::error::MeasureError), mostly of given parts: a method that fails on its
/// own reports that in its result.
pub fn whole_scan(
    effort: Effort,
    given: Option<&GivenPart>,
    progress: &mut dyn FnMut(&str),
) -> MeasureResult<WholeScan> {
    let (repeats, slow_s) = (effort.choose(3, 7), effort.choose(0.25, 2.0));
    let limits = RunLimits {
        longest_s: effort.choose(2.0, 20.0),
        touches: effort.choose(150, 300),
    };
    let parts = parts(effort, given, progress)?;
    let mut trials: Vec<Trial> = Vec::new();
    for part in &parts {
        for (number, scan) in part.scans().enumerate() {
            let methods: &[RefineMethod] = if number == 0 {
                &RefineMethod::ALL
            } else {
                &RefineMethod::BY_DENSITY
            };
            let trial = |&method| Trial {
                part,
                scan,
                method,
                times: Vec::new(),
                first: None,
            };
            trials.extend(methods.iter().map(trial));
        }
    }
    for repeat in 0..repeats {
        // slow methods run once
        let is_due = |trial: &&mut Trial| {
            trial
                .times
                .first()
                .is_none_or(|&[total_s, ..]| total_s <= slow_s)
        };
        for trial in trials.iter_mut().filter(is_due) {
            let (name, method) = (&trial.part.given.name, trial.method.name());
            progress(&format!(
                "whole scan: {name}, {method}, {} of {repeats}",
                repeat + 1
            ));
            trial.run(&limits)?;
        }
    }
    let cases = parts
        .iter()
        .map(|part| case(part, &trials))
        .collect::<Result<_, _>>()?;
    Ok(WholeScan {
        cases,
        repeats,
        slow_s,
    })
}

fn case(part: &Part, trials: &[Trial]) -> MeasureResult<CaseResult> {
    let result = |scan: &TriMesh| -> MeasureResult<_> {
        let before = part.error_of(scan)?;
        let own = trials.iter().filter(|trial| std::ptr::eq(trial.scan, scan));
        let methods = own.filter_map(|trial| trial.result(&before)).collect();
        Ok(ScanResult {
            edge_mm: scan.mean_edge() * 1e3,
            faces: scan.face_count(),
            before,
            methods,
        })
    };
    let gaussian = trials.iter().find(|trial| {
        std::ptr::eq(trial.part, part) && trial.method == RefineMethod::GaussianProcess
    });
    let each = gaussian
        .and_then(|trial| trial.first.as_ref())
        .map_or(&[][..], |(run, _)| &run.fed.laps);
    let GivenPart { name, samples, .. } = &part.given;
    let ends = samples.first().zip(samples.last());
    let span_ns = ends.map_or(0, |(first, last)| {
        last.stamp_ns.saturating_sub(first.stamp_ns)
    });
    Ok(CaseResult {
        name: name.clone(),
        samples: samples.len(),
        duration_s: span_ns as f64 * 1e-9,
        scans: part.scans().map(result).collect::<Result<_, _>>()?,
        gaussian: GaussianCost::of(each, part.contacts.len()),
    })
}

impl GaussianCost {
    /// - `each`: s, for one touch after the other.
    fn of(each: &[f64], contacts: usize) -> Option<Self> {
        let groups = each.chunks_exact(GROUP).enumerate();
        let mark = |(number, group): (usize, &[f64])| {
            let spread = Spread::of(group.iter().map(|time| time * 1e6).collect())?;
            Some(((number as f64 + 0.5) * GROUP as f64, spread))
        };
        let marks: Vec<(f64, Spread)> = groups.filter_map(mark).collect();
        let logs: Vec<(f64, f64)> = marks[marks.len() / 2..]
            .iter()
            .map(|(count, time)| (count.ln(), time.median.ln()))
            .collect();
        let line = straight_line(&logs)?;
        let at_all_contacts_us = (line.offset + line.slope * (contacts.max(1) as f64).ln()).exp();
        Some(Self {
            marks,
            exponent: line.slope,
            contacts,
            at_all_contacts_us,
        })
    }
}
