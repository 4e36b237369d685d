//! A UR arm, through the Python library ur-rtde in a process of its own (feature `ur`).
//!
//! The library waits without end for a silent controller, ends with a memory fault when a
//! connection drops and returns, and leaves the arm moving when it ends. So it lives in a child
//! process: `touchup ur child`. [`UrArm`] speaks to it over a pipe, watches each line with a
//! deadline, and on a missing line stops the arm over the dashboard, without Python. Three things
//! stop an uncommanded arm, each if the one before fails: the child, which brakes without orders;
//! the dashboard; the watchdog of the controller, which the child feeds while it lives.

mod arm;
pub mod child;
mod client;
mod dashboard;
mod error;
mod guard;
mod lateness;
mod params;
mod priority;
mod probe;
mod protocol;
mod setup;

pub use arm::UrArm;
pub use error::UrError;
pub use guard::Halt;
pub use params::{Deadlines, UrParams};
pub use setup::{SetupError, setup};
