//! Choice of the next touch.
//!
//! `Knowledge` is the covariance of a surface after its touches, and predicts the gain of one
//! more: the next touch reduces the uncertainty of the requested number most. [`Explorer`] finds a
//! feature from a flag and measures it this way; a [`Slide`] covers all of it, for the mesh.

mod advice;
mod arm_uncertainty;
mod decision;
mod design;
mod error;
mod explorer;
mod kinds;
mod known_surfaces;
mod level;
mod measuring;
mod outline;
mod pattern;
mod search;
mod search_context;
mod slide;
mod tolerance;

pub use advice::{NextTouch, advise_next_touch};
pub use arm_uncertainty::ArmUncertainty;
pub use decision::{DecidedCharacteristic, DecisionGoal, SoughtCharacteristic};
pub use error::ExploreError;
pub use explorer::{ExplorationResult, Explorer};
pub use search_context::{ExpectedTravel, FeatureQuantity, PatternParams, TouchPlan, TouchResult};
pub use slide::{Slide, Station};
pub use tolerance::sigma_of;
