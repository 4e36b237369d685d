//! Recordings for calibrations.

use std::path::Path;

use crate::cli::CliError;
use crate::cli::common::progress::WorkProgress;
use touchup_session::calibration::{CalibrationError, CalibrationRecording};
use touchup_session::replay::RecordedAs;
use touchup_session::scene::Scene;

/// Calibration of a recording, with a progress bar during its replay.
pub(super) fn calibrated<C>(
    bag: &Path,
    recorded: &RecordedAs,
    scene: &Scene,
    calibrate: impl FnOnce(CalibrationRecording, &mut dyn FnMut()) -> Result<C, CalibrationError>,
) -> Result<C, CliError> {
    let recording = CalibrationRecording::open(bag, recorded.layout(scene))?;
    let mut progress = WorkProgress::new("replay", recording.message_count());
    Ok(calibrate(recording, &mut || progress.step())?)
}
