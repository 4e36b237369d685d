//! Exploration of each kind of feature, and its fits.

pub(super) mod boss;
pub(super) mod cylinder_fit;
pub(super) mod edge;
pub(super) mod hole;
pub(super) mod plane;
pub(super) mod region;
pub(super) mod slot;
pub(super) mod slot_fit;
