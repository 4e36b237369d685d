//! Self-contained pages: HTML documents without scripts, charts as SVG, and readable numbers. The
//! same input gives the same bytes; fonts are the viewer's.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod chart;
mod document;
pub mod figure;
pub mod number;

pub use chart::{ChartSize, Looks};
pub use document::{css_string, document, picture_address, printable, table};
