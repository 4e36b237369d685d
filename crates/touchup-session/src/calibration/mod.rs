//! Calibrations of stylus, sensor and scan: from a recording, a table, or measurements of an arm to
//! settings of a scene.
//!
//! `touchup calibrate` prints the results, and the setup on the operator's page shows them; the
//! equations are in [`touchup_features::calibrate`] and [`touchup_features::align`].

mod calibrated;
mod error;
mod payload;
mod recording;
mod scan;
mod stiffness;
mod tip;
mod vector;

pub use calibrated::{
    Calibration, CalibrationKind, CalibrationResult, calibrated_on, calibrated_scene,
};
pub use error::CalibrationError;
pub use payload::{
    PayloadCalibrationParams, PayloadFound, WeighedFound, calibrate_payload,
    calibrate_payload_by_arm, calibrate_payload_by_table,
};
pub use recording::CalibrationRecording;
pub use scan::{ScanFound, calibrate_scan};
pub use stiffness::StiffnessFound;
pub use tip::{PivotFound, TipFound, calibrate_tip, calibrate_tip_by_arm};
