//! Where to touch next.
//!
//! [`Knowledge`] is what touches have told of a surface so far, and what one more would tell before it is made: the next touch
//! goes where it makes the number that was asked for known best. [`Explorer`] finds a feature from a flag and measures it so;
//! a [`Slide`] leads over the whole of what was found, for the mesh.

mod boss;
mod by_hand;
mod circle;
mod design;
mod edge;
mod error;
mod hole;
mod level;
mod looking;
mod measuring;
mod oblong;
mod pattern;
mod plane;
mod region;
mod round;
mod slide;
mod slot;
mod tolerance;

pub use by_hand::{NextTouch, next_by_hand};
pub use design::{Asked, Candidate, Knowledge};
pub use error::ExploreError;
pub use pattern::{Expected, Explorer, Felt, Found, PatternParams, Quantity, Wish};
pub use slide::{Slide, Station};
pub use tolerance::sigma_of;
