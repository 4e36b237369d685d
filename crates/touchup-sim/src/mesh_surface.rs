//! Any closed triangle mesh as a known surface.

use nalgebra::{Point3, Vector3};

use super::error::SimError;
use super::surface::{Bounds, Surface, SurfacePoint};
use touchup_core::mesh::triangle::closest_point;
use touchup_core::mesh::{BoxQuery, FaceHit, FaceId, FaceTree, MeshError, TriMesh, VertexId};

/// A triangle mesh with exact distances to its triangles.
///
/// Inside and outside are distinguished by the face, edge or vertex that is closest: by the sum of the normals of the faces
/// that meet there, weighted by their angles [Bærentzen & Aanæs 2005]. That is right for closed meshes without
/// self-intersection whose faces look outwards; where a mesh is open, the side of the nearest face decides.
pub struct MeshSurface<'a> {
    mesh: &'a TriMesh,
    tree: FaceTree,
    bounds: Bounds,
}

/// A barycentric coordinate below this is none: the point lies on the opposite edge.
const ON_EDGE: f64 = 1e-9;

impl<'a> MeshSurface<'a> {
    /// Builds the index over the faces.
    ///
    /// # Errors
    /// [`MeshError::Empty`] for a mesh without a face.
    pub fn new(mesh: &'a TriMesh) -> Result<Self, SimError> {
        let corners: Vec<_> = mesh.faces().flat_map(|(face, _)| mesh.triangle(face)).collect();
        let bounds = Bounds::around(&corners).ok_or(MeshError::Empty)?;
        Ok(Self { mesh, tree: FaceTree::new(mesh), bounds })
    }

    /// The closest face; `None` for a point that is not finite.
    fn closest_face(&self, p: &Point3<f64>) -> Option<FaceHit> {
        self.tree.closest(self.mesh, p, f64::INFINITY).filter(|hit| hit.distance_squared.is_finite())
    }

    /// Sum of the normals of all faces that meet at a point of a face, each weighted by its angle there.
    fn pseudo_normal(&self, face: FaceId, weights: &[f64; 3]) -> Vector3<f64> {
        let corners = self.mesh.corners(face);
        let on: Vec<usize> = (0..3).filter(|&i| weights[i] > ON_EDGE).collect();
        match on[..] {
            [i] => {
                let vertex = corners[i];
                let star = self.mesh.star(vertex).iter();
                star.map(|&f| self.mesh.normal(f) * self.angle_at(f, vertex)).sum()
            }
            [i, j] => self.mesh.faces_at_edge(corners[i], corners[j]).map(|f| self.mesh.normal(f)).sum(),
            _ => self.mesh.normal(face),
        }
    }

    fn angle_at(&self, face: FaceId, vertex: VertexId) -> f64 {
        let at = self.mesh.position(vertex);
        let others = self.mesh.corners(face).map(|v| self.mesh.position(v) - at);
        let sides: Vec<_> = others.iter().filter(|side| side.norm_squared() > 0.0).collect();
        if let [a, b] = sides[..] { a.angle(b) } else { 0.0 }
    }
}

impl Surface for MeshSurface<'_> {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        let Some(hit) = self.closest_face(p) else { return f64::NAN };
        let offset = p - hit.point;
        offset.norm().copysign(offset.dot(&self.pseudo_normal(hit.face, &hit.barycentric)))
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        let nowhere = SurfacePoint { point: Vector3::repeat(f64::NAN).into(), normal: Vector3::repeat(f64::NAN) };
        self.closest_face(p)
            .map_or(nowhere, |hit| SurfacePoint { point: hit.point, normal: self.mesh.normal(hit.face) })
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
