//! Where in a recording the poses and wrenches are, as flags name it: the same for every verb that
//! reads one.

use clap::Args;

use crate::io::recording::{RecordingLayout, StampSource, Topics};
use crate::replay::RecordedAs;
use crate::scene::Scene;

#[derive(Clone, Debug, Default, Args)]
pub(super) struct RecordedFlags {
    /// geometry_msgs/WrenchStamped or another wrench: of the part on the stylus [default:
    /// /stylus/wrench]
    #[arg(long, value_name = "TOPIC")]
    wrench_topic: Option<String>,
    /// geometry_msgs/PoseStamped or another pose: centre of the ball in the frame of the scan, or
    /// as tip.offset_mm and scan_to_space in the scene say [default: /stylus/pose, with
    /// --pose-frame /tf]
    #[arg(long, value_name = "TOPIC")]
    pose_topic: Option<String>,
    /// The pose of this frame is taken from the transforms on --pose-topic and its _static, as that
    /// of tool0
    #[arg(long, value_name = "FRAME")]
    pose_frame: Option<String>,
    /// With --pose-frame: the frame in which the pose is wanted [default: the root of the tree]
    #[arg(long, value_name = "FRAME", requires = "pose_frame")]
    base_frame: Option<String>,
    /// sensor_msgs/PointCloud2: the markers on the stylus, read in place of the pose; the scene
    /// says where they sit
    #[arg(long, value_name = "TOPIC", conflicts_with_all = ["pose_topic", "pose_frame"])]
    pub markers_topic: Option<String>,
}

impl From<Topics> for RecordedFlags {
    fn from(topics: Topics) -> Self {
        let Topics {
            pose,
            wrench,
            markers,
        } = topics;
        Self {
            wrench_topic: Some(wrench),
            pose_topic: Some(pose),
            markers_topic: markers,
            ..Self::default()
        }
    }
}

impl RecordedFlags {
    /// What they name, and the scene of the columns of a table.
    pub fn layout(&self, scene: &Scene) -> RecordingLayout {
        self.named(StampSource::default()).layout(scene)
    }

    /// The names that they give.
    ///
    /// - `stamp`: which time of a message counts.
    pub fn named(&self, stamp: StampSource) -> RecordedAs {
        let Self {
            wrench_topic,
            pose_topic,
            pose_frame,
            base_frame,
            markers_topic,
        } = self.clone();
        RecordedAs {
            wrench_topic,
            pose_topic,
            pose_frame,
            base_frame,
            markers_topic,
            stamp: Some(stamp.to_string()),
        }
    }
}
