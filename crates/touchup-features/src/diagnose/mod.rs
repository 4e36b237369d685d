//! Checks whether scan and touches belong together: wrong signs, axes, units, frames, tare, stamps
//! and clocks show in the data themselves.
//!
//! [`InputMonitor`] takes the same messages and samples as the refinement, in bounded memory, and
//! gives [`InputFinding`]s at any time. A rigid ball in contact has its centre one radius off the
//! surface and a force along the surface's outward normal; in free motion it has no force. The
//! monitor compares each violation with candidate corrections.

mod clock;
mod correction;
mod finding;
mod forces;
mod input_record;
mod judge;
mod mends;
mod monitor;
mod monitor_params;
mod placed;
mod places;
mod pose_course;
mod registration;
mod sensor;
mod session;
mod shift;
mod stamps;
mod wrench;

pub use correction::InputCorrection;
pub use finding::{FoundNumber, InputCause, InputFinding};
pub use monitor::InputMonitor;
pub use monitor_params::InputMonitorParams;
