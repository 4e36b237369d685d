//! Any closed triangle mesh as a known surface.

use nalgebra::{Point3, Vector3};

use super::surface::{Bounds, Surface, SurfacePoint};
use crate::error::SimError;
use touchup_geometry::mesh::triangle::closest_point;
use touchup_geometry::mesh::{BoxQuery, FaceHit, FaceTree, MeshError, TriMesh, pseudo_normal};

/// A triangle mesh with exact distances to its triangles.
///
/// The [`pseudo_normal`] at the closest point distinguishes inside and outside. That is right for
/// closed meshes without self-intersection and with outward faces; at an open rim the side of the
/// nearest face decides.
pub struct MeshSurface<'a> {
    mesh: &'a TriMesh,
    tree: FaceTree,
    bounds: Bounds,
}

impl<'a> MeshSurface<'a> {
    /// Builds the index over the faces.
    ///
    /// # Errors
    /// [`MeshError::Empty`] for a mesh without a face.
    pub fn new(mesh: &'a TriMesh) -> Result<Self, SimError> {
        let corners: Vec<_> = mesh
            .faces()
            .flat_map(|(face, _)| mesh.triangle(face))
            .collect();
        let bounds = Bounds::around(&corners).ok_or(MeshError::Empty)?;
        Ok(Self {
            mesh,
            tree: FaceTree::new(mesh),
            bounds,
        })
    }

    /// The closest face; `None` for a point that is not finite.
    fn closest_face(&self, p: &Point3<f64>) -> Option<FaceHit> {
        self.tree
            .closest(self.mesh, p, f64::INFINITY)
            .filter(|hit| hit.distance_squared.is_finite())
    }
}

impl Surface for MeshSurface<'_> {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        let Some(hit) = self.closest_face(p) else {
            return f64::NAN;
        };
        let offset = p - hit.point;
        offset
            .norm()
            .copysign(offset.dot(&pseudo_normal(self.mesh, &hit)))
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        let nowhere = SurfacePoint {
            point: Vector3::repeat(f64::NAN).into(),
            normal: Vector3::repeat(f64::NAN),
        };
        self.closest_face(p).map_or(nowhere, |hit| SurfacePoint {
            point: hit.point,
            normal: self.mesh.normal(hit.face),
        })
    }

    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>) {
        let around = Bounds { min: *p, max: *p }.grown(reach);
        let mut query = BoxQuery::default();
        self.tree.faces_in_box(&around.min, &around.max, &mut query);
        let mut faces = query.faces;
        // the order of the tree must not reach the result
        faces.sort_unstable();
        let points = faces.into_iter().map(|face| SurfacePoint {
            point: closest_point(p, &self.mesh.triangle(face)).0,
            normal: self.mesh.normal(face),
        });
        found.extend(points.filter(|s| (p - s.point).norm() <= reach));
    }
}
