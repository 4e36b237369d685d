//! The types of messages that give a pose or a wrench.

use super::wire::WireFormat;
use crate::recording::layout::{TopicInfo, TopicKind};

/// A type that gives poses or wrenches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::recording) enum MessageType {
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Odometry,
    TransformStamped,
    Transforms,
    Wrench,
    WrenchStamped,
    FrankaState,
    FrankaRobotState,
    IiwaPose,
    IiwaWrench,
    PointCloud,
}

/// Each by its name; ROS 1 names have no `msg`.
const NAMES: [(&str, MessageType); 13] = [
    ("geometry_msgs/msg/PoseStamped", MessageType::PoseStamped),
    ("geometry_msgs/msg/Pose", MessageType::Pose),
    (
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        MessageType::PoseWithCovarianceStamped,
    ),
    ("nav_msgs/msg/Odometry", MessageType::Odometry),
    (
        "geometry_msgs/msg/TransformStamped",
        MessageType::TransformStamped,
    ),
    ("tf2_msgs/msg/TFMessage", MessageType::Transforms),
    (
        "geometry_msgs/msg/WrenchStamped",
        MessageType::WrenchStamped,
    ),
    ("geometry_msgs/msg/Wrench", MessageType::Wrench),
    ("franka_msgs/msg/FrankaState", MessageType::FrankaState),
    (
        "franka_msgs/msg/FrankaRobotState",
        MessageType::FrankaRobotState,
    ),
    ("iiwa_msgs/msg/CartesianPose", MessageType::IiwaPose),
    ("iiwa_msgs/msg/CartesianWrench", MessageType::IiwaWrench),
    ("sensor_msgs/msg/PointCloud2", MessageType::PointCloud),
];

impl MessageType {
    fn named(type_name: &str) -> Option<Self> {
        let ros2 = match type_name.split_once('/') {
            // before tf2 ROS 1 had a type of its own, with the same fields
            Some(("tf", "tfMessage")) => "tf2_msgs/msg/TFMessage".to_owned(),
            Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
            _ => type_name.to_owned(),
        };
        NAMES
            .iter()
            .find(|(name, _)| *name == ros2)
            .map(|(_, message_type)| *message_type)
    }

    /// Its name in ROS 2.
    pub fn name(self) -> &'static str {
        NAMES
            .iter()
            .find(|(_, known)| *known == self)
            .map_or("", |(name, _)| name)
    }

    /// Whether its header gives stamp and frame.
    pub fn has_header(self) -> bool {
        !matches!(self, Self::Pose | Self::Wrench)
    }

    fn gives(self, kind: TopicKind) -> bool {
        match (kind, self) {
            (
                TopicKind::Pose | TopicKind::Wrench | TopicKind::State,
                Self::FrankaState | Self::FrankaRobotState,
            ) => true,
            (TopicKind::State, _) => false,
            (TopicKind::Transforms | TopicKind::StaticTransforms, given) => {
                given == Self::Transforms
            }
            (TopicKind::Markers, given) => given == Self::PointCloud,
            (TopicKind::Wrench, given) => {
                matches!(given, Self::Wrench | Self::WrenchStamped | Self::IiwaWrench)
            }
            (TopicKind::Pose, given) => matches!(
                given,
                Self::Pose
                    | Self::PoseStamped
                    | Self::PoseWithCovarianceStamped
                    | Self::Odometry
                    | Self::TransformStamped
                    | Self::IiwaPose
            ),
        }
    }

    /// The type of a topic for `kind`; the error names the actual type, and the remedy.
    ///
    /// - `frame`, `topic`: names of the settings for the stylus frame, and for another topic.
    pub fn giving(
        kind: TopicKind,
        type_name: &str,
        frame: &str,
        topic: &str,
    ) -> Result<Self, String> {
        match Self::named(type_name) {
            Some(given) if given.gives(kind) => Ok(given),
            Some(Self::Transforms) if kind == TopicKind::Pose => Err(format!(
                "{type_name}, which holds many frames; name that of the stylus with {frame}"
            )),
            _ => Err(format!(
                "{type_name}, not {}; choose another with {topic}",
                kind.types()
            )),
        }
    }
}

/// Format of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::recording) struct MessageFormat {
    pub message_type: MessageType,
    pub wire: WireFormat,
}

impl MessageFormat {
    /// The format of a topic for `kind`; the error names the actual type, and the remedy.
    pub fn of(info: &TopicInfo, kind: TopicKind) -> Result<Self, String> {
        let type_name = &info.type_name;
        let message_type = MessageType::giving(kind, type_name, "--pose-frame", kind.flag())?;
        match (message_type, WireFormat::of(&info.encoding)) {
            (MessageType::PointCloud, Some(WireFormat::Ros1)) => Err(format!(
                "{type_name} of ROS 1; convert the recording with `rosbags-convert` to read markers"
            )),
            (_, Some(wire)) => Ok(Self { message_type, wire }),
            (_, None) => Err(format!(
                "encoded as {:?}; only ROS 2's \"cdr\" can be read",
                info.encoding
            )),
        }
    }
}
