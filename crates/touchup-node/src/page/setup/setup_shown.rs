//! The setup as pages show it.

use serde::Serialize;

use super::facts::ScanFacts;
use super::found_calibration::FoundCalibration;
use super::recording_check::CheckFacts;
use super::scene_draft::{NamedCalibrations, StatedTip};
use crate::page::admission::access::Role;
use touchup_io::scan_folder::FolderFile;
use touchup_session::calibration::CalibrationKind;

/// A step of the setup, also as the remedy of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SetupStep {
    /// choose or send a scan
    Scan,
    /// choose its unit
    Unit,
    /// state the tip
    Tip,
    /// start
    Start,
}

/// Stage of the setup.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum SetupStage {
    /// operators choose
    Choosing,
    /// the node starts
    Starting,
}

/// The scan and its reading.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub(super) enum ScanChoice {
    None,
    Reading { file: String },
    Refused { file: String, why: String },
    Read(ScanFacts),
}

/// The check of a recording.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub(super) enum CheckChoice {
    None,
    Running { file: String },
    Refused { file: String, why: String },
    Found(CheckFacts),
}

/// A calibration and its progress.
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

/// Result of a calibration.
#[derive(Clone, Debug, Serialize)]
pub(super) struct CalibrationFacts {
    pub what: CalibrationKind,
    pub file: String,
    pub found: FoundCalibration,
    /// warnings to read before its use
    pub doubts: Vec<String>,
    /// missing parts of the recording
    pub losses: Vec<String>,
    /// whether the scene contains it
    pub is_used: bool,
}

/// Reason of a failed start.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SetupFailure {
    pub step: SetupStep,
    pub why: String,
}

/// Progress of an upload.
#[derive(Clone, Debug, Serialize)]
pub(super) struct UploadShown {
    pub name: String,
    pub bytes: u64,
    pub of: Option<u64>,
}

/// The setup for a page.
#[derive(Debug, Serialize)]
pub(super) struct SetupShown {
    pub stage: SetupStage,
    pub role: Role,
    pub program: &'static str,
    /// name of the folder of scans
    pub folder: String,
    /// file name of the new scene
    pub scene: String,
    pub files: Vec<FolderFile>,
    pub largest_upload: u64,
    pub upload: Option<UploadShown>,
    pub scan: ScanChoice,
    pub unit: Option<&'static str>,
    pub tip: Option<StatedTip>,
    /// whether the scene has a tip with a radius
    pub needs_radius: bool,
    /// radius in the scene or on the command line, to be confirmed
    pub known_radius_mm: Option<f64>,
    pub calibrations: NamedCalibrations,
    pub recordings: Vec<FolderFile>,
    /// tables of points
    pub tables: Vec<FolderFile>,
    pub calibration: CalibrationChoice,
    pub check: CheckChoice,
    pub is_check_over: bool,
    pub failure: Option<SetupFailure>,
}
