//! refine
pub mod dynamics;

pub use dynamics::{Along, ContactModel, DynamicsError, DynamicsParams, FaceDynamics, FaceState, StepRule};
