//! Distance between a mesh and the part in the region touched by a simulated stylus.

use nalgebra::Point3;
use serde::Serialize;

use crate::compare::TouchedRegion;
use crate::mesh::{FaceTree, TriMesh};
use crate::sim::{Moment, Surface, measure_quality};

/// True contacts of the ball with the part.
#[derive(Debug)]
pub(super) struct TouchedTruth(TouchedRegion);

/// Distances between part and mesh in the touched region, mean and 95th percentile, mm.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct RegionError {
    /// from the points that were touched to the mesh: what is missing
    pub part_to_mesh_mm: [f64; 2],
    /// from the mesh to the part, where its closest point belongs to the region: what is wrong
    pub mesh_to_part_mm: [f64; 2],
}

impl TouchedTruth {
    /// The true contacts of a simulated touch.
    pub fn of(moments: &[Moment]) -> Self {
        Self(TouchedRegion::of(moments.iter().flat_map(|moment| &moment.contacts).map(|contact| contact.point)))
    }

    /// Distances between `mesh` and `part` in the touched region.
    pub fn error(&self, part: &dyn Surface, mesh: &TriMesh) -> RegionError {
        let tree = FaceTree::new(mesh);
        let to_mesh = |p: &Point3<f64>| tree.closest(mesh, p, f64::INFINITY).map(|hit| (hit.point - p).norm());
        let mut distances: Vec<f64> = self.0.contacts().iter().filter_map(to_mesh).collect();
        distances.sort_by(f64::total_cmp);
        let mean = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
        let p95 = distances.get(distances.len() * 95 / 100).copied().unwrap_or_default();
        let from_mesh = measure_quality(mesh, part, |p| self.0.is_near(&part.closest(p).point));
        RegionError {
            part_to_mesh_mm: [mean * 1e3, p95 * 1e3],
            mesh_to_part_mm: from_mesh.map_or([0.0; 2], |quality| [quality.mean * 1e3, quality.p95 * 1e3]),
        }
    }
}
