//! What a mesh and the touches on it are made of: curvature, its clusters, and fitted surfaces with their uncertainty.

pub mod clusters;
mod creases;
pub mod curvature;
pub mod fit;
mod k_means;

pub use k_means::{KMeans, k_means};
