//! Messages of the packages that every ROS 2 has.

use serde::{Deserialize, Serialize};

use super::named;

/// A moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// s since 1970, or since the start of a simulation
    pub sec: i32,
    /// ns since then, 0 to 999 999 999
    pub nanosec: u32,
}

/// How long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Duration {
    /// s
    pub sec: i32,
    /// ns to be added, 0 to 999 999 999
    pub nanosec: u32,
}
named!("builtin_interfaces/msg": Time, Duration);

/// When, and in which frame.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// of what is told, not of its sending
    pub stamp: Time,
    /// name of the frame
    pub frame_id: String,
}
named!("std_msgs/msg": Header);

/// A place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// m
    pub x: f64,
    /// m
    pub y: f64,
    /// m
    pub z: f64,
}

/// A direction or an amount with one; the unit is said where it is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// along x
    pub x: f64,
    /// along y
    pub y: f64,
    /// along z
    pub z: f64,
}

/// A rotation, the real part last; the default is none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// i
    pub x: f64,
    /// j
    pub y: f64,
    /// k
    pub z: f64,
    /// real part
    pub w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// Place and axes of a frame in another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// its origin, m
    pub position: Point,
    /// its axes
    pub orientation: Quaternion,
}

/// What maps the child frame to the frame of the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// origin of the child, m
    pub translation: Vector3,
    /// axes of the child
    pub rotation: Quaternion,
}

/// Force and torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// N
    pub force: Vector3,
    /// about the frame's origin, N·m
    pub torque: Vector3,
}

/// A place at a moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointStamped {
    /// frame of the point
    pub header: Header,
    /// m
    pub point: Point,
}

/// A pose at a moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// frame in which the pose is
    pub header: Header,
    /// of the frame that the topic is about
    pub pose: Pose,
}

/// Force and torque at a moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WrenchStamped {
    /// frame in whose axes, and about whose origin
    pub header: Header,
    /// what the object does to the tip
    pub wrench: Wrench,
}

/// Where a frame is in another, at a moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// the parent frame
    pub header: Header,
    /// the child frame
    pub child_frame_id: String,
    /// maps child to parent
    pub transform: Transform,
}
named!("geometry_msgs/msg": Point, Vector3, Quaternion, Pose, Transform, Wrench);
named!("geometry_msgs/msg": PointStamped, PoseStamped, WrenchStamped, TransformStamped);

/// Frames in their parents.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TFMessage {
    /// in any order
    pub transforms: Vec<TransformStamped>,
}
named!("tf2_msgs/msg": TFMessage);

/// The time of a simulation or of a recording that is played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    /// now
    pub clock: Time,
}
named!("rosgraph_msgs/msg": Clock);

/// A way, as poses one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// frame of the path
    pub header: Header,
    /// in their order
    pub poses: Vec<PoseStamped>,
}
named!("nav_msgs/msg": Path);

/// One number or word of a diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// what, with its unit
    pub key: String,
    /// how much
    pub value: String,
}

/// How one part of the node is.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// one of the constants
    pub level: u8,
    /// which part
    pub name: String,
    /// how it is, in words
    pub message: String,
    /// of what hardware
    pub hardware_id: String,
    /// in numbers
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// all is well
    pub const OK: u8 = 0;
    /// it goes on, but somebody should look
    pub const WARN: u8 = 1;
    /// it does not go on
    pub const ERROR: u8 = 2;
    /// nothing came for too long
    pub const STALE: u8 = 3;
}

/// How all parts of the node are.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// when; the frame is empty
    pub header: Header,
    /// of each part
    pub status: Vec<DiagnosticStatus>,
}
named!("diagnostic_msgs/msg": KeyValue, DiagnosticStatus, DiagnosticArray);

/// Number of a goal of an action, given by who asks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct GoalID {
    /// sixteen random bytes
    pub uuid: [u8; 16],
}

impl super::RosMessage for GoalID {
    const TYPE_NAME: &'static str = "unique_identifier_msgs/msg/UUID";
}
