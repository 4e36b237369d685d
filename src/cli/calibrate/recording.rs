//! The recordings that a calibration reads.

use std::path::Path;

use clap::Args;

use crate::cli::CliError;
use crate::cli::progress::WorkProgress;
use crate::io::recording::{StampSource, Topics};
use crate::replay::{Recording, Replayed, each_sample, marker_filter};
use crate::scene::Scene;
use crate::stylus::{Placement, Sample};

/// A recording made for a calibration.
#[derive(Debug, Args)]
pub(super) struct CalibrationRecording {
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

impl CalibrationRecording {
    pub fn open(&self, bag: &Path) -> Result<Recording, CliError> {
        let (pose, wrench) = (self.pose_topic.clone(), self.wrench_topic.clone());
        let topics = Topics { pose, wrench, markers: self.markers_topic.clone() };
        Ok(Recording::open(bag, &topics, StampSource::Header)?)
    }

    /// Gives each sample to `each`, its pose in the frame of the recording: of the ball where the scene says where it
    /// is.
    pub fn replay(&self, recording: Recording, scene: &Scene, each: impl FnMut(&Sample)) -> Result<Replayed, CliError> {
        let markers = marker_filter(scene, self.markers_topic.as_deref())?;
        let placement = scene.placement().map(|placement| Placement { pose_wo: None, ..placement });
        let mut progress = WorkProgress::new("replay", recording.message_count());
        Ok(each_sample(recording, placement, scene.sync_params(), markers, &mut || progress.step(), &mut |_| (), each)?)
    }
}
