//! Measured features against a drawing: each characteristic with its decision, and the report of
//! all of them as HTML, CSV, JSON and QIF.
//!
//! Measurement ([`InspectionSource`]) and nominal part ([`PartDrawing`]) give the characteristics
//! ([`inspected`]); [`touchup_features::conformity`] decides. Command line and operator page make
//! the same report from the same files.

mod alignment;
mod calibration;
mod drawing;
mod drawn_feature;
mod error;
mod evidence;
mod files;
mod measured;
mod page;
mod params;
mod rows;
mod source;
mod words;

pub use self::alignment::AlignmentMethod;
pub use self::drawing::{DrawingParams, PartDrawing, template};
pub use self::error::InspectionError;
pub use self::files::ReportFiles;
pub use self::params::{InspectionParams, PartPicture, ReportParams};
pub use self::rows::{Inspection, inspected};
pub use self::source::InspectionSource;
pub use self::words::{first_few, percent};

#[cfg(test)]
#[path = "../../../tests/common/colour_vision.rs"]
mod colour_vision;
