//! What a mesh and the touches on it are made of: fitted surfaces with their uncertainty.

pub mod fit;
