//! Check of scan, tip and sensors by a recording of touches, as `touchup doctor` prints it.

use std::path::Path;

use serde::Serialize;

use touchup_features::diagnose::InputFinding;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::{StampSource, Topics};
use touchup_session::input_check::{InputCheck, check_input};
use touchup_session::replay::Recording;
use touchup_session::scan::read_scan;
use touchup_session::scene::Scene;

/// Findings of a check.
#[derive(Clone, Debug, Serialize)]
pub(super) struct CheckFacts {
    file: String,
    /// the surest first; empty: no objection
    findings: Vec<InputFinding>,
    /// missing parts of the recording
    losses: Vec<String>,
}

/// Inputs of a check.
pub(super) struct CheckInputs<'a> {
    pub scan: (&'a Path, MeshUnit),
    pub recording: &'a Path,
    pub scene: &'a Scene,
    pub topics: &'a Topics,
}

/// Replays a recording on the scan.
///
/// - `file`: name of the recording.
///
/// # Errors
/// In words: the reason of a failed replay.
pub(super) fn check_recording(file: &str, inputs: &CheckInputs<'_>) -> Result<CheckFacts, String> {
    let CheckInputs {
        scan: (scan, unit),
        recording,
        scene,
        topics,
    } = inputs;
    let mesh = read_scan(scan, *unit)
        .map_err(|error| error.to_string())?
        .mesh;
    let opened = Recording::open(recording, topics, StampSource::Header)
        .map_err(|error| error.to_string())?;
    let found =
        check_input(opened, &mesh, scene, None, &mut || {}).map_err(|error| error.to_string())?;
    let InputCheck {
        findings, losses, ..
    } = found;
    Ok(CheckFacts {
        file: file.to_owned(),
        findings,
        losses,
    })
}
