//! The node's side of ROS 2: the messages, the parameters, and the port through which both go.
//!
//! The node knows [`port`] alone. What is behind it is chosen when the program is built.

pub mod arguments;
mod arrivals;
pub mod clock;
#[cfg(feature = "ros")]
pub mod dds;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod exchange;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod graph;
pub mod in_process;
pub mod messages;
pub mod names;
pub mod node;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod parameter_services;
pub mod parameters;
pub mod port;
#[cfg(feature = "r2r")]
pub mod r2r;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod send_queue;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod services;
#[cfg(any(feature = "ros", feature = "r2r"))]
mod topics;

#[cfg(all(feature = "ros", not(feature = "r2r")))]
pub use dds::{RosError, samples, start};
#[cfg(feature = "r2r")]
pub use r2r::{RosError, samples, start};
