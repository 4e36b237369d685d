//! Messages as ROS 2 has them: plain structs, fields in the order in which they are on the wire.
//!
//! Units are m, rad, N, N·m and s. What has a header is in the frame that it names; what has none is in that of the message
//! around it.

mod feature;
mod mesh;
mod probe;
mod services;
mod standard;
mod visual;

use serde::Serialize;
use serde::de::DeserializeOwned;

pub use feature::{Feature, FeatureArray};
pub use mesh::{HapticMismatch, MeshPatch};
pub use probe::{ProbeFeedback, ProbeGoal, ProbeResponse, ProbeResult, ProbeSettings, ProbeTouch};
pub use services::{
    DetectFeaturesRequest, DetectFeaturesResponse, FlagFeatureRequest, FlagFeatureResponse, ProbeFeatureRequest,
    ProbeFeatureResponse, ResyncMeshRequest, ResyncMeshResponse, SaveMeshRequest, SaveMeshResponse, SetBoolRequest,
    SetBoolResponse, TriggerRequest, TriggerResponse, UndoRequest, UndoResponse, UnflagFeatureRequest,
    UnflagFeatureResponse,
};
pub use standard::{
    Clock, DiagnosticArray, DiagnosticStatus, Duration, GoalID, Header, KeyValue, Path, Point, PointStamped, Pose,
    PoseStamped, Quaternion, TFMessage, Time, Transform, TransformStamped, Vector3, Wrench, WrenchStamped,
};
pub use visual::{ColorRGBA, CompressedImage, Marker, MarkerArray, MeshFile, UVCoordinate};

/// A message with a name of its own.
pub trait RosMessage: Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned + Send + 'static {
    /// as `ros2 interface show` takes it: package, kind, name
    const TYPE_NAME: &'static str;
}

/// Gives structs the name that they have in a package: `named!("std_msgs/msg": Header)`.
macro_rules! named {
    ($package:literal: $($name:ident),+ $(,)?) => {
        $(impl $crate::ros::messages::RosMessage for $name {
            const TYPE_NAME: &'static str = concat!($package, "/", stringify!($name));
        })+
    };
}
use named;
