//! The setup as pages are shown it.

use serde::Serialize;

use super::facts::ScanFacts;
use super::found_calibration::FoundCalibration;
use super::recording_check::CheckFacts;
use super::scene_draft::{NamedCalibrations, StatedTip};
use crate::calibration::CalibrationKind;
use crate::io::scan_folder::FolderFile;
use crate::ros::web::access::Role;

/// A step of the setup, as one that can mend an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SetupStep {
    /// choose or send a scan
    Scan,
    /// say in which unit it is
    Unit,
    /// state the tip
    Tip,
    /// begin
    Start,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Stage {
    /// somebody chooses
    Choosing,
    /// the node is being made ready
    Starting,
}

/// The scan as far as it is known.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub(super) enum ScanChoice {
    None,
    Reading { file: String },
    Refused { file: String, why: String },
    Read(ScanFacts),
}

/// A recording that was looked at.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub(super) enum CheckChoice {
    None,
    Running { file: String },
    Refused { file: String, why: String },
    Found(CheckFacts),
}

/// A calibration that was made.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub(super) enum CalibrationChoice {
    None,
    Running {
        what: CalibrationKind,
        file: String,
        share: Option<f64>,
    },
    Refused {
        what: CalibrationKind,
        file: String,
        why: String,
    },
    Found(Box<CalibrationFacts>),
}

/// What it found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct CalibrationFacts {
    pub what: CalibrationKind,
    pub file: String,
    pub found: FoundCalibration,
    /// what should be looked at before it is used
    pub doubts: Vec<String>,
    /// what is missing in the recording
    pub losses: Vec<String>,
    /// whether it is in the scene
    pub is_used: bool,
}

/// Why the node did not begin.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SetupFailure {
    pub step: SetupStep,
    pub why: String,
}

/// How much of an upload has come.
#[derive(Clone, Debug, Serialize)]
pub(super) struct UploadShown {
    pub name: String,
    pub bytes: u64,
    pub of: Option<u64>,
}

/// What a page is shown.
#[derive(Debug, Serialize)]
pub(super) struct SetupShown {
    pub stage: Stage,
    pub role: Role,
    pub program: &'static str,
    /// name of the folder of scans
    pub folder: String,
    /// name of the scene that will be written
    pub scene: String,
    pub files: Vec<FolderFile>,
    pub largest_upload: u64,
    pub upload: Option<UploadShown>,
    pub scan: ScanChoice,
    pub unit: Option<&'static str>,
    pub tip: Option<StatedTip>,
    /// whether the scene has a tip with a radius
    pub needs_radius: bool,
    /// that of the scene or of who started the program, to be confirmed
    pub known_radius_mm: Option<f64>,
    pub calibrations: NamedCalibrations,
    pub recordings: Vec<FolderFile>,
    /// of points
    pub tables: Vec<FolderFile>,
    pub calibration: CalibrationChoice,
    pub check: CheckChoice,
    pub is_check_over: bool,
    pub failure: Option<SetupFailure>,
}
