//! Flags for poses and wrenches in a recording, common to all verbs with one.

use clap::Args;

use touchup_io::recording::{RecordingLayout, StampSource, Topics};
use touchup_session::replay::RecordedAs;
use touchup_session::scene::Scene;

#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct RecordedFlags {
    /// geometry_msgs/WrenchStamped or another wrench: of the part on the stylus [default:
    /// /stylus/wrench]
    #[arg(long, value_name = "TOPIC")]
    wrench_topic: Option<String>,
    /// geometry_msgs/PoseStamped or another pose: ball centre in the frame of the scan, unless
    /// tip.offset_mm and scan_to_space of the scene apply [default: /stylus/pose, with --pose-frame
    /// /tf]
    #[arg(long, value_name = "TOPIC")]
    pose_topic: Option<String>,
    /// Frame with the pose, such as tool0, in the transforms on --pose-topic and its _static
    #[arg(long, value_name = "FRAME")]
    pose_frame: Option<String>,
    /// With --pose-frame: reference frame of the pose [default: the root of the tree]
    #[arg(long, value_name = "FRAME", requires = "pose_frame")]
    base_frame: Option<String>,
    /// sensor_msgs/PointCloud2: markers on the stylus, in place of the pose; the scene has their
    /// positions
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
    /// Layout from the flags, and from the scene for the columns of a table.
    pub fn layout(&self, scene: &Scene) -> RecordingLayout {
        self.named(StampSource::default()).layout(scene)
    }

    /// Names from the flags.
    ///
    /// - `stamp`: time source of a message.
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
