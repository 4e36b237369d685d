//! The node's side of ROS 2: the messages, the parameters, and the port for both.
//!
//! The node knows [`port`] alone. The build selects its implementation.

pub mod arguments;
mod arm_samples;
pub mod clock;
pub(crate) mod convert;
#[cfg(feature = "ros")]
pub mod dds;
pub(crate) mod exchange;
pub mod in_process;
pub mod inbox;
pub(crate) mod mesh_feed;
pub mod messages;
pub mod names;
mod parameter_services;
pub mod parameters;
pub mod playback;
pub mod port;
#[cfg(feature = "r2r")]
pub mod r2r;
pub(crate) mod refusal;
mod sample_source;
mod send_queue;
pub(crate) mod services;
pub mod stop;
mod topics;

pub use arm_samples::ArmSamples;
#[cfg(all(feature = "ros", any(not(feature = "r2r"), feature = "r2r-check")))]
pub use dds::{arm_port, samples, start};
pub use exchange::RosError;
pub use mesh_feed::MeshFeed;

/// Locks a mutex. A poisoned value is still whole: none of our code panics while it holds the lock.
pub(crate) fn locked<T>(mutex: &std::sync::Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}
#[cfg(all(feature = "r2r", not(all(feature = "ros", feature = "r2r-check"))))]
pub use r2r::{arm_port, samples, start};
