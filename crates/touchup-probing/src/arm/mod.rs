//! An arm that holds a probe, and its touches.
//!
//! [`Arm`] is the interface of an arm, [`Limits`] its bounds. [`SupervisedArm::touch`] makes one touch
//! and returns the contact: the corner of force over travel ([`find_onset`]), not the position of
//! rest. [`SupervisedArm::slide`] presses with a constant force and follows a path.

mod bodies;
mod capsule;
mod freshness;
mod geometry;
mod interface;
mod joints;
mod kinematics;
mod limits;
mod liveness;
mod measured_motion;
mod obedience;
mod onset;
mod serial_chain;
mod sliding;
mod straight_line;
mod touch_params;
mod touching;
mod watched;

pub use bodies::{ArmBodies, Link};
pub use capsule::Capsule;
pub use freshness::Freshness;
pub use geometry::ArmGeometry;
pub use interface::{Arm, ArmError, ArmState, Command, Safety, SpeedReduction, check_parameters};
pub(crate) use joints::largest_turn;
pub use joints::{Joints, MOST_JOINTS};
pub use kinematics::UrGeometry;
pub(crate) use limits::millimetres;
pub use limits::{LimitError, Limits, RequestLimits};
pub use liveness::StuckForce;
pub use obedience::{Obedience, OrderedMotion};
pub use onset::{Onset, OnsetError, OnsetParams, OnsetVerdict, TouchMoment, find_onset};
pub use serial_chain::{ChainError, ChainJoint, ChainLink, IkFailure, SerialChain};
pub use sliding::{SlideEnding, SlideRecord, SlideTarget};
pub use straight_line::velocity_towards;
pub use touch_params::{CRAWL, TouchParams, UNEXPECTED};
pub use touching::{TouchOutcome, TouchRecord, TouchTarget};
pub use watched::{Observer, ProbeError, StopRequest, SupervisedArm};
