//! Error against run time, stability, what each part costs, and whether stated uncertainties hold:
//! everything that `touchup-report` measures and shows.
//!
//! Each part measures into a type of its own, writes it as a [`Chapter`], and returns what the
//! verdict needs.
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
pub use touchup_page::figure::{
    Axis, Drawing, Figure, LineStroke, Mark, Panel, Scale, Series, Spread,
};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// the small report: under a minute where the whole one takes up to twenty-five
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
