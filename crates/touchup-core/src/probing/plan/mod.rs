//! Where to touch next.
//!
//! [`Knowledge`] is what touches have told of a surface so far, and what one more would tell before it is made: the next touch
//! goes where it makes the number that was asked for known best. [`Explorer`] finds a feature from a flag and measures it so;
//! a [`Slide`] leads over the whole of what was found, for the mesh.

mod advice;
mod boss;
mod cylinder_fit;
mod design;
mod edge;
mod error;
mod explorer;
mod hole;
mod level;
mod measuring;
mod pattern;
mod plane;
mod region;
mod search;
mod search_context;
mod slide;
mod slot;
mod slot_fit;
mod tolerance;

pub use advice::{NextTouch, next_by_hand};
pub use design::{Asked, Candidate, Knowledge};
pub use error::ExploreError;
pub use explorer::{Explorer, Found};
pub use search_context::{Expected, PatternParams, Quantity, TouchPlan, TouchResult};
pub use slide::{Slide, Station};
pub use tolerance::sigma_of;
