//! The types of messages that give a pose or a wrench.

use super::layout::{TopicInfo, TopicKind};
use super::wire::Wire;

/// A type of which poses or wrenches are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MessageType {
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Odometry,
    TransformStamped,
    Transforms,
    Wrench,
    WrenchStamped,
    FrankaState,
    IiwaPose,
    IiwaWrench,
    PointCloud,
}

/// Each by its name without `/msg`, which ROS 1 does not have.
const NAMES: [(&str, MessageType); 12] = [
    ("geometry_msgs/PoseStamped", MessageType::PoseStamped),
    ("geometry_msgs/Pose", MessageType::Pose),
    ("geometry_msgs/PoseWithCovarianceStamped", MessageType::PoseWithCovarianceStamped),
    ("nav_msgs/Odometry", MessageType::Odometry),
    ("geometry_msgs/TransformStamped", MessageType::TransformStamped),
    ("tf2_msgs/TFMessage", MessageType::Transforms),
    ("geometry_msgs/WrenchStamped", MessageType::WrenchStamped),
    ("geometry_msgs/Wrench", MessageType::Wrench),
    ("franka_msgs/FrankaState", MessageType::FrankaState),
    ("iiwa_msgs/CartesianPose", MessageType::IiwaPose),
    ("iiwa_msgs/CartesianWrench", MessageType::IiwaWrench),
    ("sensor_msgs/PointCloud2", MessageType::PointCloud),
];

impl MessageType {
    fn named(type_name: &str) -> Option<Self> {
        let plain = type_name.replacen("/msg/", "/", 1);
        // before tf2 ROS 1 had a type of its own, with the same fields
        let plain = if plain == "tf/tfMessage" { "tf2_msgs/TFMessage" } else { &plain };
        NAMES.iter().find(|(name, _)| *name == plain).map(|(_, message_type)| *message_type)
    }

    fn gives(self, kind: TopicKind) -> bool {
        match (kind, self) {
            (TopicKind::Pose | TopicKind::Wrench | TopicKind::State, Self::FrankaState) => true,
            (TopicKind::State, _) => false,
            (TopicKind::Transforms | TopicKind::StaticTransforms, given) => given == Self::Transforms,
            (TopicKind::Markers, given) => given == Self::PointCloud,
            (TopicKind::Wrench, given) => matches!(given, Self::Wrench | Self::WrenchStamped | Self::IiwaWrench),
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
}

/// How a topic is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MessageFormat {
    pub message_type: MessageType,
    pub wire: Wire,
}

impl MessageFormat {
    /// That of a topic which is to give what `kind` says; the error is what the topic is instead, and what to do.
    pub fn of(info: &TopicInfo, kind: TopicKind) -> Result<Self, String> {
        let named = MessageType::named(&info.type_name);
        let (type_name, flag) = (&info.type_name, kind.flag());
        match (named.filter(|given| given.gives(kind)), Wire::of(&info.encoding)) {
            (Some(MessageType::PointCloud), Some(Wire::Ros1)) => {
                Err(format!("{type_name} of ROS 1; convert the recording with `rosbags-convert` to read markers"))
            }
            (Some(message_type), Some(wire)) => Ok(Self { message_type, wire }),
            (Some(_), None) => Err(format!("encoded as {:?}; only ROS 2's \"cdr\" can be read", info.encoding)),
            (None, _) if named == Some(MessageType::Transforms) && kind == TopicKind::Pose => {
                Err(format!("{type_name}, which holds many frames; name that of the stylus with --pose-frame"))
            }
            (None, _) => Err(format!("{type_name}, not {}; choose another with {flag}", kind.types())),
        }
    }
}
