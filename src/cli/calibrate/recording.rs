//! Recordings for calibrations.

use std::path::Path;

use clap::Args;

use crate::cli::CliError;
use crate::cli::common::progress::WorkProgress;
use crate::cli::common::recorded::RecordedFlags;
use touchup_session::calibration::{CalibrationError, CalibrationRecording};
use touchup_session::scene::Scene;

/// Recording flags of a calibration.
#[derive(Debug, Args)]
pub(super) struct RecordingFlags {
    #[command(flatten)]
    recorded: RecordedFlags,
}

impl RecordingFlags {
    /// Calibration of a recording, with a progress bar during its replay.
    pub fn calibrate<C>(
        &self,
        bag: &Path,
        scene: &Scene,
        calibrate: impl FnOnce(CalibrationRecording, &mut dyn FnMut()) -> Result<C, CalibrationError>,
    ) -> Result<C, CliError> {
        let recording = CalibrationRecording::open(bag, self.recorded.layout(scene))?;
        let mut progress = WorkProgress::new("replay", recording.message_count());
        Ok(calibrate(recording, &mut || progress.step())?)
    }
}
