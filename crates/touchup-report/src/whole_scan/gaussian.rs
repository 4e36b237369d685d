//! A baseline: an exact Gaussian-process implicit surface, refitted at each touch.
//!
//! f(x) = d(x) + g(x), where d is the signed distance from the scan and g a Gaussian process of mean 0 and covariance
//! k(x, y) = s² exp(−|x − y|² / 2ℓ²). Each contact p says f(p) = 0 up to noise σ, that is g(p) = −d(p). The mean of g is
//! Σ k(x, pᵢ) wᵢ with (K + σ² I) w = −d(p), solved by Cholesky: n³/3 operations for n touches, refitted each time.

use nalgebra::{Cholesky, DMatrix, DVector, Point3};

use touchup_core::mesh::{FaceTree, TriMesh, VertexId, signed_distance};

/// Rounds in which a vertex is moved to the zero of f along its normal.
const ROUNDS: usize = 4;
/// Vertices beyond this many ℓ from every touch stay: there k is below 1e-4 of its height.
const FAR: f64 = 4.5;

/// What a Gaussian process assumes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianParams {
    /// s: root mean square of the values
    pub amplitude: f64,
    /// ℓ: distance over which values are alike, m
    pub length: f64,
    /// σ: standard deviation of a measured value
    pub noise: f64,
}

impl GaussianParams {
    fn covariance(&self, x: &Point3<f64>, y: &Point3<f64>) -> f64 {
        self.amplitude.powi(2) * (-(x - y).norm_squared() / (2.0 * self.length.powi(2))).exp()
    }
}

/// A Gaussian process that was fitted to values at points.
#[derive(Clone, Debug)]
pub struct GaussianProcess {
    params: GaussianParams,
    points: Vec<Point3<f64>>,
    weights: DVector<f64>,
}

impl GaussianProcess {
    /// Fits exactly; `None` where K + σ² I is not positive definite to rounding: two points in one place without noise.
    ///
    /// - `points`: m; `values`: as many, in any unit.
    pub fn fit(params: GaussianParams, points: &[Point3<f64>], values: &[f64]) -> Option<Self> {
        let count = points.len().min(values.len());
        let noise = params.noise.powi(2);
        let matrix = DMatrix::from_fn(count, count, |i, j| {
            params.covariance(&points[i], &points[j]) + if i == j { noise } else { 0.0 }
        });
        let weights = Cholesky::new(matrix)?.solve(&DVector::from_column_slice(&values[..count]));
        Some(Self { params, points: points[..count].to_vec(), weights })
    }

    /// The expected value at `x` (m).
    pub fn mean(&self, x: &Point3<f64>) -> f64 {
        self.points.iter().zip(&self.weights).map(|(point, weight)| self.params.covariance(x, point) * weight).sum()
    }

    fn is_far(&self, x: &Point3<f64>) -> bool {
        let far = (FAR * self.params.length).powi(2);
        self.points.iter().all(|point| (point - x).norm_squared() > far)
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
    /// A surface that is the scan.
    pub fn new(scan: &'a TriMesh, params: GaussianParams) -> Self {
        Self { scan, tree: FaceTree::new(scan), params, points: Vec::new(), values: Vec::new(), process: None }
    }

    /// Takes a contact point (m, in O) and refits; whether that was possible. A touch that makes it impossible is
    /// forgotten.
    pub fn push(&mut self, contact: Point3<f64>) -> bool {
        let Some(distance) = signed_distance(self.scan, &self.tree, &contact, f64::INFINITY) else { return false };
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

    /// The scan with its vertices moved along their normals to where f is zero.
    pub fn mesh(&self) -> TriMesh {
        let mut mesh = self.scan.clone();
        let Some(process) = &self.process else { return mesh };
        for vertex in (0..mesh.vertex_slots() as u32).map(VertexId).filter(|&vertex| self.scan.has_vertex(vertex)) {
            let position = self.scan.position(vertex);
            let sum: nalgebra::Vector3<f64> =
                self.scan.star(vertex).iter().map(|&face| self.scan.double_area_normal(face)).sum();
            let Some(normal) = sum.try_normalize(0.0).filter(|_| !process.is_far(&position)) else { continue };
            // along the normal d is the displacement, so f is zero where that is −g
            let gone = (0..ROUNDS).fold(0.0, |gone, _| -process.mean(&(position + gone * normal)));
            mesh.set_position(vertex, position + gone * normal);
        }
        mesh
    }
}
