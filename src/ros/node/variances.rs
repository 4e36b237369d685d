//! Variances of vertices along their normals, and the work that evaluates them.

use std::sync::mpsc::Receiver;

use nalgebra::Point3;

use crate::mesh::{FaceTree, TriMesh};
use crate::reconstruct::{Patcher, Support};

/// Number of a vertex, and its variance along the normal, m².
pub type VertexVariance = (u32, f32);

/// Variances of vertices, those that are others than before.
#[derive(Debug)]
pub struct Variances {
    /// state of the mesh with these in it
    pub version: u64,
    /// of which vertices
    pub of: Vec<VertexVariance>,
}

/// Session and version.
pub type VarianceState = (String, u64);

/// What is evaluated now, and what was.
#[derive(Debug, Default)]
pub struct VarianceWork {
    /// evaluated last, or tried
    pub done: Option<VarianceState>,
    /// what is being evaluated, and where it comes
    pub made: Option<(VarianceState, Receiver<Vec<VertexVariance>>)>,
}

/// Variances of vertices in their order; none where the scene asks for no uncertainty.
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
