//! Pages that need nothing beside them: HTML documents without scripts, charts as SVG, and numbers
//! as a person reads them. The same input gives the same bytes; letters are those of the viewer.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod chart;
mod document;
pub mod figure;
pub mod number;

pub use chart::{ChartSize, Looks};
pub use document::{css_string, document, picture_address, printable, table};
