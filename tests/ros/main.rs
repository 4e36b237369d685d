//! Tests of the node, of its port to ROS 2, and of an arm behind ros2_control.

#[expect(dead_code, reason = "the chain of a UR is tested elsewhere")]
#[path = "../common/chains.rs"]
mod chains;
#[expect(dead_code, reason = "no contact states are tested here")]
#[path = "../common/plate_stream.rs"]
mod plate_stream;
#[path = "../common/static_scan.rs"]
mod static_scan;

mod node;
mod port;
mod ros2_control;
