//! Messages of ROS to poses, wrenches, markers and transforms.

pub mod cdr;
pub mod decode;
pub mod franka;
pub mod live_message;
pub mod message_type;
pub mod point_cloud;
pub mod transforms;
pub mod wire;
