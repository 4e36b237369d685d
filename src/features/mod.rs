//! What a mesh and the touches on it are made of: curvature, its clusters, and fitted surfaces with their uncertainty.

pub mod curvature;
pub mod fit;
