//! The ROS 2 node: messages in, the refined mesh and its features out; its arms; the operator page.
//!
//! | module | purpose |
//! |---|---|
//! | [`log_lines`] | log lines for `/rosout` |
//! | `ros` | the port to ROS 2 (features `ros`, on its own DDS, and `r2r`, on a sourced ROS 2): messages, parameters, services |
//! | `node` | the workers of the node, one file each |
//! | `page` | the operator page, served by the node (feature `web`) |
//! | `ros2_control` | an arm behind ros2_control |
//! | `ur` | a UR arm, Python in a child process (feature `ur`) |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod log_lines;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod node;
#[cfg(all(feature = "web", any(feature = "ros", feature = "r2r")))]
pub mod page;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod ros;
#[cfg(any(feature = "ros", feature = "r2r"))]
pub mod ros2_control;
#[cfg(feature = "ur")]
pub mod ur;

/// Optional cargo features, and whether this build has them.
pub const FEATURES: [(&str, bool); 4] = [
    ("feature ros", cfg!(feature = "ros")),
    ("feature r2r", cfg!(feature = "r2r")),
    ("feature ur", cfg!(feature = "ur")),
    ("feature web", cfg!(feature = "web")),
];

#[cfg(test)]
#[path = "../../../tests/common/colour_vision.rs"]
mod colour_vision;
