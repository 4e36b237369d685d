//! Error against run time, stability, and what each part costs: everything that `touchup-report` measures and shows.
//!
//! Each part measures into a type of its own, writes it as a [`Chapter`], and returns what the verdict needs.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod allocations;
mod convergence;
pub mod cost;
mod csv;
mod document;
mod extremes;
mod figure;
mod files;
mod number;
mod page;
pub mod peers;
mod plot;
mod stability;
pub mod verdict;
mod whole_scan;
pub mod work_precision;

pub use convergence::{
    BLOWN_UP, Convergence, Decay, Law, Line, MeshErrors, PaperSweeps, RobustSweeps, Rule, SweepError, SweepRun,
    convergence, fit_decay, noisy, raster_samples, straight_line,
};
pub use document::Report;
pub use extremes::{Extreme, Extremes, extremes};
pub use figure::{
    Axis, Chapter, Drawing, Figure, LineStroke, Mark, Panel, Scale, Series, Spread, Table, TableCell, TableOf,
};
pub use files::{OutputFile, ReportError};
pub use number::three_digits;
pub use peers::Peers;
pub use stability::{BadShape, FaceShares, Integrator, MeshShares, RunEnding, Stability, SubFlowError, stability};
pub use whole_scan::{
    CaseResult, ContactSculptor, GaussianCost, GaussianParams, GaussianProcess, GaussianSurface, GivenPart,
    MethodResult, Reach, RefineMethod, ScanResult, TouchedError, WholeScan, WholeScanError, whole_scan,
};
pub use work_precision::WorkPrecision;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// the small report: under a minute where the whole one takes up to fifteen
    pub is_quick: bool,
}

impl Effort {
    /// One of two, by how much is measured.
    pub fn choose<T>(self, quick: T, full: T) -> T {
        if self.is_quick { quick } else { full }
    }
}

/// Seconds that some work takes, and its result.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let started = std::time::Instant::now();
    let result = std::hint::black_box(work());
    (started.elapsed().as_secs_f64(), result)
}
