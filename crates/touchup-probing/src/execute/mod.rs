//! Probing of flagged features by an arm: from a flag to links through free air, touches, and a
//! feature with its uncertainty.
//!
//! [`crate::plan`] plans touches, [`crate::arm`] makes each; here a planned touch
//! becomes a path of the arm within its limits and clear of the present mesh, and each outcome
//! becomes an [`Ending`] with its reason. On request the ball then slides over the whole feature.

mod cell;
mod cone;
mod dry_run;
mod ending;
mod feature_probing;
mod links;
mod opening_surface;
mod payload;
mod prober;
mod reference;
mod repeat;
mod route;
mod sliding;
mod sphere;
mod tip;
mod touched_again;
mod way_out;
mod world;

pub use cell::RobotCell;
pub use cone::{NotReached, ShaftOrientation};
pub use dry_run::{HeldBack, Plan, PlannedMotion, plan};
pub use ending::{Ending, FlagResult, ProbedSlide, ProbedTouch, ReferenceTouch};
pub use links::{LinkError, Tool};
pub use payload::{PayloadProbeError, PayloadReadings};
pub use prober::{Flag, ProbeParams, Prober};
pub use reference::References;
pub use repeat::{Repeatability, SpotError, SpotTouch};
pub use sphere::{SphereOrientation, SphereTouches};
pub use tip::TipPoses;
pub use way_out::WayOut;
pub use world::{Phase, Progress, StaticWorld, World};
