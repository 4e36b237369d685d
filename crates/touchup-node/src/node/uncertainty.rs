//! Uncertainty of the touched vertices of a mesh, and the state of its computation.

use std::sync::mpsc::Receiver;

use nalgebra::Point3;

use super::side_work::SideWork;
use crate::ros::mesh_feed::{MeshVersion, VertexUncertainty};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::reconstruct::Patcher;
use touchup_session::clock::Clock;

/// Radius of marked vertices around a rejected contact, m.
const BESIDE_OUTLIER: f64 = 1e-3;

/// Running and last computation for a session.
#[derive(Debug)]
pub struct UncertaintyWork {
    /// its threads
    pub threads: SideWork,
    /// version of the last one, successful or not; 0: none
    pub done: u64,
    /// running one: its version, 0 for that of another session, and its result
    pub made: Option<(u64, Receiver<VertexUncertainty>)>,
}

impl UncertaintyWork {
    /// No computation yet. All waits use `clock`.
    pub fn on(clock: Clock) -> Self {
        Self {
            threads: SideWork::on(clock),
            done: 0,
            made: None,
        }
    }

    /// Begins with another session.
    pub fn restart(&mut self) {
        self.done = 0;
        self.made.iter_mut().for_each(|(version, _)| *version = 0);
    }
}

/// Uncertainty of the touched vertices in their order; no variances if the scene has no uncertainty.
pub fn uncertainty_of(
    mesh: &MeshVersion,
    (scan, tree): &(TriMesh, FaceTree),
    patcher: &mut Patcher,
) -> VertexUncertainty {
    let (vertices, places): (Vec<u32>, Vec<_>) = mesh.touched().unzip();
    let sigmas = patcher.sigma_at(scan, tree, &places);
    let variances = sigmas.iter().map(|sigma| (sigma * sigma) as f32);
    let variances = vertices.iter().copied().zip(variances);
    let is_new =
        |&(vertex, variance): &(u32, f32)| variance.to_bits() != mesh.variance(vertex).to_bits();
    let rejected: Vec<Point3<f64>> = patcher
        .outliers()
        .last()
        .map(|outlier| outlier.point)
        .collect();
    let is_beside = |place: &Point3<f64>| {
        rejected
            .iter()
            .any(|point| (point - place).norm() < BESIDE_OUTLIER)
    };
    let outliers = vertices.iter().zip(&places);
    let outliers = outliers.filter(|(_, (place, _))| is_beside(place));
    VertexUncertainty {
        variances: variances.filter(is_new).collect(),
        outliers: outliers.map(|(vertex, _)| *vertex).collect(),
    }
}
