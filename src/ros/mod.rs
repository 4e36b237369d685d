//! The node's side of ROS 2: the messages, the parameters, and the port through which both go.
//!
//! The node knows [`port`] alone. What is behind it is chosen when the program is built.

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
#[cfg(any(feature = "ros", feature = "r2r"))]
mod send_queue;

#[cfg(all(feature = "ros", not(feature = "r2r")))]
pub use dds::{RosError, samples, start};
#[cfg(feature = "r2r")]
pub use r2r::{RosError, samples, start};
