//! Viewpoint of the pictures.

use nalgebra::{Point3, Vector2, Vector3};

use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};
use touchup_geometry::numeric::scatter;

/// Tilt of the view from the direction of touch: about 37°, so that walls and steps are visible
/// too.
const TILT: f64 = 0.7;
/// Sideways turn of the view.
const YAW: f64 = 0.25;

/// Minimum share of the surface with one direction for a side: less occurs by chance.
const LEAST_SIDE: f64 = 0.05;

/// A parallel projection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    /// to the right in the picture, unit
    pub right: Vector3<f64>,
    /// up in the picture, unit
    pub up: Vector3<f64>,
    /// towards the viewer, unit
    pub out: Vector3<f64>,
}

impl Camera {
    /// Views from the direction `out` with `up` upwards, as far as possible.
    pub(crate) fn new(out: &Vector3<f64>, up: &Vector3<f64>) -> Self {
        let out = out.try_normalize(0.0).unwrap_or_else(Vector3::z);
        // nearly along the view `up` is useless
        let other = if out.y.abs() < 0.9 {
            Vector3::y()
        } else {
            Vector3::z()
        };
        let right = up
            .cross(&out)
            .try_normalize(1e-6)
            .unwrap_or_else(|| other.cross(&out).normalize());
        Self {
            right,
            up: out.cross(&right),
            out,
        }
    }

    /// Views obliquely the side with the most `weight`, with the longest extent of the part across
    /// the picture.
    ///
    /// - `weight`: of each vertex slot, 0 or more.
    pub(crate) fn towards(mesh: &TriMesh, weight: impl Fn(VertexId) -> f64) -> Self {
        let weighted = |(face, corners): (FaceId, [VertexId; 3])| {
            mesh.double_area_normal(face) * corners.into_iter().map(&weight).sum::<f64>()
        };
        let total: f64 = mesh.faces().map(weighted).map(|n| n.norm()).sum();
        let sum: Vector3<f64> = mesh.faces().map(weighted).sum();
        // a closed shell of uniform weight has no such side
        let facing = if sum.norm() > LEAST_SIDE * total {
            sum.normalize()
        } else {
            Vector3::z()
        };
        let flat = Self::new(&facing, &Vector3::y());
        let across = flat.longest(mesh);
        let along = facing.cross(&across);
        Self::new(&(facing - along * TILT + across * YAW), &facing)
    }

    /// Direction of largest spread of the vertices across the view; its largest coordinate is
    /// positive.
    fn longest(&self, mesh: &TriMesh) -> Vector3<f64> {
        let flat =
            |p: &Point3<f64>| Vector2::new(self.right.dot(&p.coords), self.up.dot(&p.coords));
        let eigen = scatter(mesh.positions().iter().map(flat)).symmetric_eigen();
        let v = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        let across = self.right * v[0] + self.up * v[1];
        if across[across.iamax()] < 0.0 {
            -across
        } else {
            across
        }
    }

    /// Right, up and towards the viewer, m.
    #[inline]
    pub(crate) fn project(&self, p: &Point3<f64>) -> Vector3<f64> {
        Vector3::new(
            self.right.dot(&p.coords),
            self.up.dot(&p.coords),
            self.out.dot(&p.coords),
        )
    }

    /// The box around all vertices in the picture, m: lower left, upper right.
    pub(crate) fn bounds<'a>(
        &self,
        meshes: impl Iterator<Item = &'a TriMesh>,
    ) -> [Vector2<f64>; 2] {
        let empty = [f64::INFINITY, f64::NEG_INFINITY].map(Vector2::repeat);
        let flat = meshes
            .flat_map(TriMesh::positions)
            .map(|p| self.project(p).xy());
        flat.fold(empty, |[lo, hi], p| [lo.inf(&p), hi.sup(&p)])
    }
}
