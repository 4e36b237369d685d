//! The node's side of ROS 2: the messages, the parameters, and the port through which both go.
//!
//! The node knows [`port`] alone. What is behind it is chosen when the process starts.

pub mod arguments;
mod arrivals;
pub mod clock;
#[cfg(feature = "ros")]
pub mod dds;
pub mod in_process;
pub mod messages;
pub mod names;
pub mod node;
pub mod parameters;
pub mod port;
#[cfg(feature = "r2r")]
pub mod r2r;
