//! Messages as ROS 2 has them: plain structs, fields in the order in which they are on the wire.
//!
//! Units are m, rad, N, N·m and s. What has a header is in the frame that it names; what has none
//! is in that of the message around it.
//!
//! `generate/` makes them from the definitions in `msg/` and, of the packages that every ROS 2 has,
//! in `standard/`.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A message with a name of its own.
pub trait RosMessage:
    Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned + Send + 'static
{
    /// as `ros2 interface show` takes it: package, kind, name
    const TYPE_NAME: &'static str;
}

/// A service: what is asked, and what is answered.
pub trait RosService: 'static {
    /// what is asked
    type Request: RosMessage + Sync;
    /// what is answered
    type Response: RosMessage + Sync;
    /// package and name
    const TYPE_NAME: [&'static str; 2];
}

include!(concat!(env!("OUT_DIR"), "/messages.rs"));
