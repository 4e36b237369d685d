//! Error against run time, stability, cost of each part, and validity of stated uncertainties: the
//! measurements and displays of `touchup-report`.
//!
//! Each part measures into a type of its own, writes it as a [`Chapter`], and returns its share of
//! the verdict.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod allocations;
pub mod convergence;
pub mod cost;
pub mod coverage;
mod csv;
pub mod document;
mod double_double;
pub mod error;
pub mod extremes;
pub mod files;
pub mod mistakes;
mod page;
pub mod peers;
pub mod reference;
pub mod stability;
mod table;
pub mod verdict;
pub mod whole_scan;
pub mod work_precision;

pub use table::{Chapter, Table, TableCell, TableOf};
pub use touchup_document::figure::{
    Axis, Drawing, Figure, LineStroke, Mark, Panel, Scale, Series, Spread,
};

/// Extent of the measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// the small report: under a minute instead of up to twenty-five
    pub is_quick: bool,
}

impl Effort {
    /// The value for the extent of the measurements.
    pub fn choose<T>(self, quick: T, full: T) -> T {
        if self.is_quick { quick } else { full }
    }
}

/// Run time of some work in seconds, and its result.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let started = std::time::Instant::now();
    let result = std::hint::black_box(work());
    (started.elapsed().as_secs_f64(), result)
}
