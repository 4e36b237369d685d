//! The recordings that a calibration reads.

use std::path::Path;

use clap::Args;

use crate::calibration::{CalibrationError, CalibrationRecording};
use crate::cli::CliError;
use crate::cli::progress::WorkProgress;
use crate::io::recording::Topics;

/// What is read of a recording made for a calibration.
#[derive(Debug, Args)]
pub(super) struct RecordingFlags {
    /// geometry_msgs/WrenchStamped
    #[arg(long, value_name = "TOPIC", default_value = "/stylus/wrench")]
    wrench_topic: String,
    /// geometry_msgs/PoseStamped
    #[arg(long, value_name = "TOPIC", default_value = "/stylus/pose")]
    pose_topic: String,
    /// sensor_msgs/PointCloud2: the markers on the stylus, read in place of the pose; the scene says where they sit
    #[arg(long, value_name = "TOPIC", conflicts_with = "pose_topic")]
    markers_topic: Option<String>,
}

impl RecordingFlags {
    /// What `calibrate` makes of a recording, with a bar while it is replayed.
    pub fn calibrate<C>(
        &self,
        bag: &Path,
        calibrate: impl FnOnce(CalibrationRecording, &mut dyn FnMut()) -> Result<C, CalibrationError>,
    ) -> Result<C, CliError> {
        let (pose, wrench) = (self.pose_topic.clone(), self.wrench_topic.clone());
        let topics = Topics { pose, wrench, markers: self.markers_topic.clone() };
        let recording = CalibrationRecording::open(bag, &topics)?;
        let mut progress = WorkProgress::new("replay", recording.message_count());
        Ok(calibrate(recording, &mut || progress.step())?)
    }
}
