//! Baselines: alternatives named by the paper.
//!
//! Contact points alone: the mesh moves so that it passes through the ball's contact point; no
//! force, no measured normal, no guard on updates.
//!
//! An exact Gaussian-process implicit surface, refitted at each touch: f(x) = d(x) + g(x), where d
//! is the signed distance from the scan and g a Gaussian process of mean 0 and covariance k(x, y) =
//! s² exp(−|x − y|² / 2ℓ²). Each contact p says f(p) = 0 up to noise σ, that is g(p) = −d(p). The
//! mean of g is Σ k(x, pᵢ) wᵢ with (K + σ² I) w = −d(p), solved by Cholesky: n³/3 operations for n
//! touches, refitted each time.

use nalgebra::{Cholesky, DMatrix, DVector, Point3, Vector3};

use touchup_geometry::mesh::{
    FaceHit, FaceId, FaceTree, TriMesh, VertexId, pseudo_normal, signed_distance,
};

/// Rounds that move a vertex to the zero of f along its normal.
const ROUNDS: usize = 4;
/// Vertices beyond this multiple of ℓ from every touch stay: there k is below 1e-4 of its height.
const FAR: f64 = 4.5;

/// A mesh pulled through contact points.
///
/// The contact point of the ball is unknown without a force: the model takes the one under the
/// normal of the unrefined scan, at the place closest to the centre. The corners of the face
/// closest to that point make the least moves along that normal that bring it there, wᵢ / Σ w² of
/// the displacement by its barycentric coordinates w; the vertices around it make (1 − (d/R)²)² of
/// the displacement, d their distance from the moved place.
#[derive(Clone, Debug)]
pub struct ContactSculptor<'a> {
    scan: &'a TriMesh,
    scan_tree: FaceTree,
    /// current mesh
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
        Self {
            scan,
            scan_tree,
            mesh,
            tree,
            radius,
            reach,
            moving: Vec::new(),
            faces: Vec::new(),
        }
    }

    /// Takes the centre (m, in O) of a ball in contact; returns the contact point, now on the mesh,
    /// or `None` if the scan has no normal there.
    pub fn push(&mut self, centre: &Point3<f64>) -> Option<Point3<f64>> {
        let scanned = self.scan_tree.closest(self.scan, centre, f64::INFINITY)?;
        let normal = pseudo_normal(self.scan, &scanned);
        if normal == Vector3::zeros() {
            return None;
        }
        let contact = centre - self.radius * normal;
        let hit = self.tree.closest(&self.mesh, &contact, f64::INFINITY)?;
        self.gather(&hit);
        // no sideways motion, or a sliding ball drives the mesh before it
        let step = normal * normal.dot(&(contact - hit.point));
        for &(vertex, share) in &self.moving {
            self.mesh
                .set_position(vertex, self.mesh.position(vertex) + step * share);
        }
        self.faces.clear();
        self.faces.extend(
            self.moving
                .iter()
                .flat_map(|&(vertex, _)| self.mesh.star(vertex)),
        );
        self.tree.refit(&self.mesh, &self.faces);
        Some(contact)
    }

    /// Finds the corners of the handle, and the vertices within reach that are connected to them.
    fn gather(&mut self, hit: &FaceHit) {
        let squares: f64 = hit.barycentric.iter().map(|weight| weight * weight).sum();
        let corners = self.mesh.corners(hit.face).into_iter().zip(hit.barycentric);
        self.moving.clear();
        self.moving
            .extend(corners.map(|(corner, weight)| (corner, weight / squares)));
        let mut at = 0;
        while let Some(&(vertex, _)) = self.moving.get(at) {
            for corner in self
                .mesh
                .star(vertex)
                .iter()
                .flat_map(|&face| self.mesh.corners(face))
            {
                let distance = (self.mesh.position(corner) - hit.point).norm() / self.reach;
                if distance < 1.0 && self.moving.iter().all(|&(known, _)| known != corner) {
                    self.moving
                        .push((corner, (1.0 - distance * distance).powi(2)));
                }
            }
            at += 1;
        }
    }
}

/// Assumptions of a Gaussian process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianParams {
    /// s: root mean square of the values
    pub amplitude: f64,
    /// ℓ: correlation length, m
    pub length: f64,
    /// σ: standard deviation of a measured value
    pub noise: f64,
}

impl GaussianParams {
    fn covariance(&self, x: &Point3<f64>, y: &Point3<f64>) -> f64 {
        self.amplitude.powi(2) * (-(x - y).norm_squared() / (2.0 * self.length.powi(2))).exp()
    }
}

/// A Gaussian process fitted to values at points.
#[derive(Clone, Debug)]
pub struct GaussianProcess {
    params: GaussianParams,
    points: Vec<Point3<f64>>,
    weights: DVector<f64>,
}

impl GaussianProcess {
    /// Fits exactly; `None` if K + σ² I is not positive definite to rounding: two points in one
    /// place without noise.
    ///
    /// - `points`: m; `values`: one per point, in any unit.
    pub fn fit(params: GaussianParams, points: &[Point3<f64>], values: &[f64]) -> Option<Self> {
        let count = points.len().min(values.len());
        let noise = params.noise.powi(2);
        let matrix = DMatrix::from_fn(count, count, |i, j| {
            params.covariance(&points[i], &points[j]) + if i == j { noise } else { 0.0 }
        });
        let weights = Cholesky::new(matrix)?.solve(&DVector::from_column_slice(&values[..count]));
        Some(Self {
            params,
            points: points[..count].to_vec(),
            weights,
        })
    }

    /// The expected value at `x` (m).
    pub fn mean(&self, x: &Point3<f64>) -> f64 {
        self.points
            .iter()
            .zip(&self.weights)
            .map(|(point, weight)| self.params.covariance(x, point) * weight)
            .sum()
    }

    fn is_far(&self, x: &Point3<f64>) -> bool {
        let far = (FAR * self.params.length).powi(2);
        self.points
            .iter()
            .all(|point| (point - x).norm_squared() > far)
    }
}

/// The implicit surface over a scan.
#[derive(Clone, Debug)]
pub struct GaussianSurface<'a> {
    scan: &'a TriMesh,
    tree: FaceTree,
    params: GaussianParams,
    points: Vec<Point3<f64>>,
    /// −d at the points, m
    values: Vec<f64>,
    process: Option<GaussianProcess>,
}

impl<'a> GaussianSurface<'a> {
    /// A surface equal to the scan.
    pub fn new(scan: &'a TriMesh, params: GaussianParams) -> Self {
        Self {
            scan,
            tree: FaceTree::new(scan),
            params,
            points: Vec::new(),
            values: Vec::new(),
            process: None,
        }
    }

    /// Takes a contact point (m, in O) and refits; returns success. Forgets a touch that makes the
    /// fit fail.
    pub fn push(&mut self, contact: Point3<f64>) -> bool {
        let Some(distance) = signed_distance(self.scan, &self.tree, &contact, f64::INFINITY) else {
            return false;
        };
        self.points.push(contact);
        self.values.push(-distance);
        let process = GaussianProcess::fit(self.params, &self.points, &self.values);
        let is_possible = process.is_some();
        if is_possible {
            self.process = process;
        } else {
            self.points.pop();
            self.values.pop();
        }
        is_possible
    }

    /// The scan with its vertices moved along their normals to the zero of f.
    pub fn mesh(&self) -> TriMesh {
        let mut mesh = self.scan.clone();
        let Some(process) = &self.process else {
            return mesh;
        };
        for vertex in (0..mesh.vertex_slots() as u32)
            .map(VertexId)
            .filter(|&vertex| self.scan.has_vertex(vertex))
        {
            let position = self.scan.position(vertex);
            let sum: Vector3<f64> = self
                .scan
                .star(vertex)
                .iter()
                .map(|&face| self.scan.double_area_normal(face))
                .sum();
            let Some(normal) = sum
                .try_normalize(0.0)
                .filter(|_| !process.is_far(&position))
            else {
                continue;
            };
            // along the normal d is the displacement, so f vanishes at a displacement of −g
            let gone = (0..ROUNDS).fold(0.0, |gone, _| -process.mean(&(position + gone * normal)));
            mesh.set_position(vertex, position + gone * normal);
        }
        mesh
    }
}
