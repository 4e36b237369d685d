//! Recordings for calibrations.

use std::path::{Path, PathBuf};

use touchup_io::recording::{RecordingLayout, StampSource};
use touchup_method::stylus::{Placement, Sample, WrenchFrame};

use crate::replay::{Recording, ReplayError, ReplaySummary, each_sample, marker_filter};
use crate::scene::Scene;

/// An open recording for a calibration.
pub struct CalibrationRecording {
    path: PathBuf,
    recording: Recording,
    /// topic of the markers that replace the pose
    markers_topic: Option<String>,
}

impl CalibrationRecording {
    /// Opens a recording: a file, or a rosbag2 folder.
    ///
    /// # Errors
    /// [`ReplayError::Read`]
    pub fn open(path: &Path, layout: impl Into<RecordingLayout>) -> Result<Self, ReplayError> {
        let layout = layout.into();
        let markers_topic = layout.topics.markers.clone();
        let recording = Recording::open(path, layout, StampSource::Header)?;
        Ok(Self {
            path: path.to_owned(),
            recording,
            markers_topic,
        })
    }

    /// Number of messages, if the recording states it.
    pub fn message_count(&self) -> Option<u64> {
        self.recording.message_count()
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Axes of the wrenches, as the recording names them.
    pub(super) fn wrench_frame(&self) -> WrenchFrame {
        self.recording.wrench_frame
    }

    /// Passes each sample to `each`, its pose in the frame of the recording; a pose of the ball, if
    /// the scene has the tip offset.
    ///
    /// - `at_each`: called after each record, to show the progress.
    pub(super) fn replay(
        self,
        scene: &Scene,
        at_each: &mut dyn FnMut(),
        each: impl FnMut(&Sample),
    ) -> Result<ReplaySummary, ReplayError> {
        let markers = marker_filter(scene, self.markers_topic.as_deref())?;
        let placement = scene.placement().map(|placement| Placement {
            pose_wo: None,
            // of another recording
            changes: Vec::new(),
            ..placement
        });
        each_sample(
            self.recording,
            placement,
            scene.sync_params(),
            markers,
            at_each,
            &mut |_| (),
            each,
        )
    }
}
