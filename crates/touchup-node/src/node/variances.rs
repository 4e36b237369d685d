//! Variances of vertices along their normals, and the state of their computation.

use std::sync::mpsc::Receiver;

use nalgebra::Point3;

use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::reconstruct::{Patcher, Support};

/// Number of a vertex, and its variance along the normal, m².
pub type VertexVariance = (u32, f32);

/// Session and version.
pub type VarianceState = (String, u64);

/// Running and last computation.
#[derive(Debug, Default)]
pub struct VarianceWork {
    /// last one, successful or not
    pub done: Option<VarianceState>,
    /// running one, and its result
    pub made: Option<(VarianceState, Receiver<Vec<VertexVariance>>)>,
}

/// Variances of vertices in their order; none if the scene has no uncertainty.
pub fn evaluated(
    patcher: &mut Patcher,
    (scan, tree): &(TriMesh, FaceTree),
    vertices: &[(u32, Point3<f64>, Support)],
) -> Vec<VertexVariance> {
    let places: Vec<_> = vertices
        .iter()
        .map(|&(_, place, support)| (place, support))
        .collect();
    let sigmas = patcher.sigma_at(scan, tree, &places);
    vertices
        .iter()
        .zip(sigmas)
        .map(|(&(vertex, ..), sigma)| (vertex, (sigma * sigma) as f32))
        .collect()
}
