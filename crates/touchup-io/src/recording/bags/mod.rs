//! ROS 1 bags, version 2.0.

pub mod bag;
pub mod bag_index;
