//! An arm probes flagged features by itself: from a flag to links through free air, touches, and a feature with its uncertainty.
//!
//! [`crate::probing::plan`] wishes for touches, [`crate::probing::arm`] makes each; here a wish becomes a way of the arm that is within its limits
//! and keeps clear of the mesh as it is now, and whatever happens becomes an [`Ending`] with its reason. Where it is wanted the ball then
//! slides over all of what was found.

mod cell;
mod cone;
mod course;
mod dry_run;
mod ending;
mod links;
mod pivot;
mod prober;
mod repeat;
mod route;
mod sliding;
mod weigh;
mod world;

pub use cell::Cell;
pub use cone::{NotReached, Orientation};
pub use dry_run::{Plan, plan};
pub use ending::{Ending, Probed, ProbedSlide, ProbedTouch};
pub use links::{LinkError, Tool, turning_place, way};
pub use pivot::Pivoted;
pub use prober::{Flag, ProbeParams, Prober};
pub use repeat::{Repeatability, SpotError, SpotTouch};
pub use weigh::{WeighError, Weighed, WeighedRest};
pub use world::{Phase, Progress, StillWorld, World};
