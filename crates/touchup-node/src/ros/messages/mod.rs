//! Messages of ROS 2: plain structs, fields in wire order.
//!
//! Units are m, rad, N, N·m and s. A message with a header is in the frame named there; without one
//! it is in the frame of the enclosing message.
//!
//! `generate/` makes them from the definitions in `msg/` and, for packages of every ROS 2, in
//! `standard/`.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A message with a name of its own.
pub trait RosMessage:
    Clone + PartialEq + std::fmt::Debug + Serialize + DeserializeOwned + Send + 'static
{
    /// package, kind, name, as for `ros2 interface show`
    const TYPE_NAME: &'static str;
}

/// A service: request and response.
pub trait RosService: 'static {
    /// message of a request
    type Request: RosMessage + Sync;
    /// message of a response
    type Response: RosMessage + Sync;
    /// package and name
    const TYPE_NAME: [&'static str; 2];
}

include!(concat!(env!("OUT_DIR"), "/messages.rs"));
