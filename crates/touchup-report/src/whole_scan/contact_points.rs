//! A baseline: contact points alone. The mesh is moved so that it passes through the point where the ball touches; no
//! force, no measured normal, no guard on what an update may do.

use nalgebra::{Point3, Vector3};

use touchup_core::mesh::{FaceHit, FaceId, FaceTree, TriMesh, VertexId, pseudo_normal};

/// A mesh that is pulled through contact points.
///
/// Which point of the ball touches is not known without a force: the one under the normal of the unrefined scan is taken,
/// in the place that is closest to the centre. The corners of the face closest to that point make the least moves along that
/// normal that bring it as far, wᵢ / Σ w² of the displacement by its barycentric coordinates w; the vertices around it make (1 −
/// (d/R)²)² of the displacement, d their distance from the place that is moved.
#[derive(Clone, Debug)]
pub struct ContactSculptor<'a> {
    scan: &'a TriMesh,
    scan_tree: FaceTree,
    /// as it is now
    pub mesh: TriMesh,
    tree: FaceTree,
    radius: f64,
    reach: f64,
    /// vertices that move, each with its share
    moving: Vec<(VertexId, f64)>,
    faces: Vec<FaceId>,
}

impl<'a> ContactSculptor<'a> {
    /// - `radius`: of the ball, m; `reach`: R, radius within which vertices follow, m.
    pub fn new(scan: &'a TriMesh, radius: f64, reach: f64) -> Self {
        let (scan_tree, mesh) = (FaceTree::new(scan), scan.clone());
        let tree = scan_tree.clone();
        Self { scan, scan_tree, mesh, tree, radius, reach, moving: Vec::new(), faces: Vec::new() }
    }

    /// Takes the centre (m, in O) of a ball in contact; returns the point of contact through which the mesh passes now, or
    /// `None` where the scan has no normal.
    pub fn push(&mut self, centre: &Point3<f64>) -> Option<Point3<f64>> {
        let scanned = self.scan_tree.closest(self.scan, centre, f64::INFINITY)?;
        let normal = pseudo_normal(self.scan, &scanned);
        if normal == Vector3::zeros() {
            return None;
        }
        let contact = centre - self.radius * normal;
        let hit = self.tree.closest(&self.mesh, &contact, f64::INFINITY)?;
        self.gather(&hit);
        // sideways nothing moves, or a sliding ball drives the mesh before it
        let step = normal * normal.dot(&(contact - hit.point));
        for &(vertex, share) in &self.moving {
            self.mesh.set_position(vertex, self.mesh.position(vertex) + step * share);
        }
        self.faces.clear();
        self.faces.extend(self.moving.iter().flat_map(|&(vertex, _)| self.mesh.star(vertex)));
        self.tree.refit(&self.mesh, &self.faces);
        Some(contact)
    }

    /// Finds the corners of the handle, and from there on the vertices within reach, as far as they hang together.
    fn gather(&mut self, hit: &FaceHit) {
        let squares: f64 = hit.barycentric.iter().map(|weight| weight * weight).sum();
        let corners = self.mesh.corners(hit.face).into_iter().zip(hit.barycentric);
        self.moving.clear();
        self.moving.extend(corners.map(|(corner, weight)| (corner, weight / squares)));
        let mut at = 0;
        while let Some(&(vertex, _)) = self.moving.get(at) {
            for corner in self.mesh.star(vertex).iter().flat_map(|&face| self.mesh.corners(face)) {
                let distance = (self.mesh.position(corner) - hit.point).norm() / self.reach;
                if distance < 1.0 && self.moving.iter().all(|&(known, _)| known != corner) {
                    self.moving.push((corner, (1.0 - distance * distance).powi(2)));
                }
            }
            at += 1;
        }
    }
}
