//! Result of any calibration on the page.

use std::fmt;

use serde::Serialize;

use touchup_session::calibration::{CalibrationResult, PayloadFound, ScanFound, TipFound};
use touchup_session::scene::Setting;

/// The result, as `touchup calibrate … --json` prints it.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum FoundCalibration {
    Tip(TipFound),
    Payload(PayloadFound),
    Scan(ScanFound),
}

impl fmt::Display for FoundCalibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tip(found) => write!(f, "{found}"),
            Self::Payload(found) => write!(f, "{found}"),
            Self::Scan(found) => write!(f, "{found}"),
        }
    }
}

impl CalibrationResult for FoundCalibration {
    fn settings(&self) -> (Vec<Setting>, String) {
        match self {
            Self::Tip(found) => found.settings(),
            Self::Payload(found) => found.settings(),
            Self::Scan(found) => found.settings(),
        }
    }
}
