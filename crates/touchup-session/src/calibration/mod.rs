//! Calibrations of stylus, sensor and scan: from a recording, from a table, or from what an arm
//! measured, to what is put into a scene.
//!
//! `touchup calibrate` prints what comes of them, and the setup on the operator's page shows it;
//! the equations are in [`touchup_core::calibrate`] and [`touchup_core::align`].

mod calibrated;
mod error;
mod payload;
mod recording;
mod scan;
mod stiffness;
mod tip;
mod vector;

pub use calibrated::{Calibrated, Calibration, CalibrationKind, calibrated_on, calibrated_scene};
pub use error::CalibrationError;
pub use payload::{
    PayloadCalibrationParams, PayloadFound, WeighedFound, calibrate_payload,
    calibrate_payload_by_arm, calibrate_payload_by_table,
};
pub use recording::CalibrationRecording;
pub use scan::{ScanFound, calibrate_scan};
pub use stiffness::StiffnessFound;
pub use tip::{PivotFound, TipFound, calibrate_tip, calibrate_tip_by_arm};
