//! Exploration of each kind of feature, and its fits.

pub mod boss;
pub mod cylinder_fit;
pub mod edge;
pub mod hole;
pub mod plane;
pub mod region;
pub mod slot;
pub mod slot_fit;
