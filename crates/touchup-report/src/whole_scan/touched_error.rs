//! Errors of a mesh against the part in the touched region.

use touchup_features::compare::{
    CompareError, Summary, TouchedRegion, angle_between, closest_places, deviations,
    sample_surface, surface_area,
};
use touchup_geometry::mesh::{FaceTree, SerialWorkers, TriMesh};
use touchup_geometry::numeric::quantile;

/// Points on the mesh for each m²: four in a square millimetre.
const DENSITY: f64 = 4e6;
/// Largest number of points: a mesh that blew up has a huge area.
const MOST_POINTS: f64 = 200e3;
/// Seed of the points on the mesh.
const SEED: u64 = 1;

/// Distances and angles between mesh and part in the touched region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchedError {
    /// mean distance from the touched places to the mesh (completeness), mm
    pub part_to_mesh_mean_mm: f64,
    /// its 95th percentile, mm
    pub part_to_mesh_p95_mm: f64,
    /// mean distance from the mesh to the part, limited to touched closest places of the part
    /// (accuracy), mm
    pub mesh_to_part_mean_mm: f64,
    /// its 95th percentile, mm
    pub mesh_to_part_p95_mm: f64,
    /// mean angle between the mesh's normal and the part's in the same places, by area, 0 to 180
    /// deg
    pub normal_mean_deg: f64,
    /// its 95th percentile, deg
    pub normal_p95_deg: f64,
}

impl TouchedError {
    /// Errors of `mesh` against the touched part of `truth` with its tree.
    ///
    /// # Errors
    /// [`CompareError::NoPoints`] if no part of the mesh is near the touches, or without touches;
    /// [`CompareError::NoFaces`]; [`CompareError::NotFinite`].
    pub fn of(
        mesh: &TriMesh,
        truth: &TriMesh,
        tree: &FaceTree,
        region: &TouchedRegion,
    ) -> Result<Self, CompareError> {
        let missing = Summary::of(&deviations(
            region.contacts(),
            mesh,
            &FaceTree::new(mesh),
            &SerialWorkers,
        )?);
        let density = DENSITY.min(MOST_POINTS / surface_area(mesh));
        let places = sample_surface(mesh, density, SEED);
        let points: Vec<_> = places.iter().map(|place| place.point).collect();
        let (mut wrong, mut angles) = (Vec::new(), Vec::new());
        closest_places(&points, truth, tree, |at, hit| {
            if region.is_near(&hit.point) {
                wrong.push(hit.distance_squared.sqrt());
                let normals = (
                    mesh.double_area_normal(places[at].face),
                    truth.double_area_normal(hit.face),
                );
                angles.push(angle_between(&normals.0, &normals.1).to_degrees());
            }
        })?;
        let (Some(missing), Some(wrong)) = (missing, Summary::of(&wrong)) else {
            return Err(CompareError::NoPoints);
        };
        angles.sort_unstable_by(f64::total_cmp);
        Ok(Self {
            part_to_mesh_mean_mm: missing.mean * 1e3,
            part_to_mesh_p95_mm: missing.p95 * 1e3,
            mesh_to_part_mean_mm: wrong.mean * 1e3,
            mesh_to_part_p95_mm: wrong.p95 * 1e3,
            normal_mean_deg: angles.iter().sum::<f64>() / angles.len() as f64,
            normal_p95_deg: quantile(&angles, 0.95),
        })
    }

    /// The worse of the two mean distances, mm: neither completeness nor accuracy hides the other.
    pub fn mean_mm(&self) -> f64 {
        self.part_to_mesh_mean_mm.max(self.mesh_to_part_mean_mm)
    }

    /// The worse of the two 95th percentiles, mm.
    pub fn p95_mm(&self) -> f64 {
        self.part_to_mesh_p95_mm.max(self.mesh_to_part_p95_mm)
    }
}
