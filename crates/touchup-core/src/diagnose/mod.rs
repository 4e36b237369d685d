//! Whether scan and touches belong together: wrong signs, axes, units, frames, tare, stamps and
//! clocks show in the data themselves.
//!
//! [`InputMonitor`] takes what everything else takes, message by message and sample by sample, in
//! bounded memory, and gives [`InputFinding`]s at any time. A rigid ball that touches has its
//! centre one radius off the surface and a force along the outward normal of it; free, it has no
//! force. What breaks one of these is compared with what would mend it.

mod finding;
mod forces;
mod input_record;
mod judge;
mod mends;
mod monitor;
mod monitor_params;
mod placed;
mod places;
mod registration;
mod shift;
mod stamps;
mod stiffness;
mod wrench;

pub use finding::{InputCause, InputFinding};
pub use monitor::InputMonitor;
pub use monitor_params::InputMonitorParams;
