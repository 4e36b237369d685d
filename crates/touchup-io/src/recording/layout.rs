//! Places of the poses and wrenches of a touch in a recording.

use super::tables::columns::TableColumns;

/// Names of the topics that make a touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// `geometry_msgs/msg/PoseStamped`, or another type that holds a pose: tip T in the object
    /// frame O, m.
    pub pose: String,
    /// `geometry_msgs/msg/WrenchStamped`, or another type that holds a wrench: of the object on the
    /// stylus, N and N·m.
    pub wrench: String,
    /// `sensor_msgs/msg/PointCloud2`: the markers on the stylus in O, m. If named, readers use it
    /// in place of the pose, and writers beside it.
    pub markers: Option<String>,
}

impl Default for Topics {
    /// `/stylus/pose` and `/stylus/wrench`, no markers.
    fn default() -> Self {
        Self {
            pose: "/stylus/pose".into(),
            wrench: "/stylus/wrench".into(),
            markers: None,
        }
    }
}

/// The frames of a pose from a tree of transforms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransformFrames {
    /// Frame of the stylus, as `tool0`.
    pub moving: String,
    /// Reference frame; `None`: the root of the tree.
    pub base: Option<String>,
}

/// Places of poses and wrenches, in a recording of any kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingLayout {
    /// Topics of a recording of ROS.
    pub topics: Topics,
    /// If given, the topic of the pose holds `tf2_msgs/msg/TFMessage`; static transforms are on the
    /// topic of the same name with `_static` behind it.
    pub frames: Option<TransformFrames>,
    /// Columns of a table.
    pub columns: TableColumns,
}

impl From<&Topics> for RecordingLayout {
    fn from(topics: &Topics) -> Self {
        Self {
            topics: topics.clone(),
            ..Self::default()
        }
    }
}

/// Layout from a reference borrowed once more, as closures pass it on.
impl From<&&Topics> for RecordingLayout {
    fn from(topics: &&Topics) -> Self {
        Self::from(*topics)
    }
}

impl From<&Self> for RecordingLayout {
    fn from(layout: &Self) -> Self {
        layout.clone()
    }
}

impl RecordingLayout {
    /// The topics in use: for the pose, and for the wrench.
    pub(super) fn kinds(&self) -> &'static [TopicKind] {
        match (&self.topics.markers, &self.frames) {
            (Some(_), _) => &[TopicKind::Markers, TopicKind::Wrench],
            (None, Some(_)) => &[
                TopicKind::Transforms,
                TopicKind::StaticTransforms,
                TopicKind::Wrench,
            ],
            (None, None) if self.topics.pose == self.topics.wrench => &[TopicKind::State],
            (None, None) => &[TopicKind::Pose, TopicKind::Wrench],
        }
    }

    /// Required topics.
    pub(super) fn needed(&self) -> impl Iterator<Item = TopicKind> + use<> {
        self.kinds()
            .iter()
            .copied()
            .filter(|kind| *kind != TopicKind::StaticTransforms)
    }

    pub(super) fn kind_of(&self, topic: &str) -> Option<TopicKind> {
        self.kinds()
            .iter()
            .copied()
            .find(|kind| self.is_topic(*kind, topic))
    }

    /// Whether a topic gives `kind`.
    pub(super) fn is_topic(&self, kind: TopicKind, topic: &str) -> bool {
        match kind {
            TopicKind::StaticTransforms => topic.strip_suffix("_static") == Some(&self.topics.pose),
            kind => topic == self.topics.name(kind),
        }
    }
}

/// A topic as a file describes it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TopicInfo {
    pub name: String,
    pub type_name: String,
    /// `cdr` in every ROS 2 recording, `ros1` in an older one.
    pub encoding: String,
}

impl TopicInfo {
    /// Memory of its names, bytes.
    pub fn name_bytes(&self) -> usize {
        self.name.len() + self.type_name.len() + self.encoding.len()
    }
}

/// Role of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum TopicKind {
    Pose,
    Wrench,
    /// Pose and wrench in each message.
    State,
    Markers,
    /// Moving transforms, and static ones.
    Transforms,
    StaticTransforms,
}

impl Topics {
    pub(super) fn name(&self, kind: TopicKind) -> &str {
        match kind {
            TopicKind::Wrench => &self.wrench,
            TopicKind::Markers => self.markers.as_deref().unwrap_or_default(),
            TopicKind::Pose
            | TopicKind::State
            | TopicKind::Transforms
            | TopicKind::StaticTransforms => &self.pose,
        }
    }
}

impl TopicKind {
    /// The type for writing.
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Pose => "geometry_msgs/msg/PoseStamped",
            Self::Wrench => "geometry_msgs/msg/WrenchStamped",
            Self::State => "franka_msgs/msg/FrankaState",
            Self::Markers => "sensor_msgs/msg/PointCloud2",
            Self::Transforms | Self::StaticTransforms => "tf2_msgs/msg/TFMessage",
        }
    }

    /// The readable types, in words.
    pub fn types(self) -> &'static str {
        match self {
            Self::Pose => {
                "geometry_msgs/msg/PoseStamped or another pose (PoseWithCovarianceStamped, TransformStamped, Odometry, Pose, \
                 FrankaState, FrankaRobotState, iiwa_msgs' CartesianPose)"
            }
            Self::Wrench => {
                "geometry_msgs/msg/WrenchStamped or another wrench (Wrench, FrankaState, FrankaRobotState, iiwa_msgs' \
                 CartesianWrench)"
            }
            Self::State => {
                "franka_msgs' FrankaState or FrankaRobotState, the only ones that hold both pose and wrench"
            }
            Self::Markers | Self::Transforms | Self::StaticTransforms => self.type_name(),
        }
    }

    pub fn flag(self) -> &'static str {
        match self {
            Self::Pose | Self::State | Self::Transforms | Self::StaticTransforms => "--pose-topic",
            Self::Wrench => "--wrench-topic",
            Self::Markers => "--markers-topic",
        }
    }
}
