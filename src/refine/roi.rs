//! The region of interest around a touched face: handle, free vertices, fixed rim \[paper, Sec 4.3\].
//!
//! The handle is the touched face. Free vertices follow it by Laplacian surface editing with uniform weights
//! \[Sorkine 2004\]: the displacement of each free vertex is the mean of its neighbours' displacements, the handle's is
//! given, the rim's is zero. The solution is linear in the displacements of the three handle vertices, so it is solved
//! once for each handle, as three weights for each free vertex.

use nalgebra::Point3;

use super::guard::Neighbourhood;
use super::marks::Marks;
use crate::mesh::{FaceId, TriMesh, VertexId};

/// How far the free vertices reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RoiSize {
    /// Only the handle moves.
    Handle,
    /// All neighbours of the handle are free \[paper\].
    OneRing,
    /// Vertices within this distance (m) of the handle's barycentre are free, as far as they hang together.
    Radius(f64),
}

/// Room for more vertices is not made ahead.
const LARGEST_ROOM: f64 = 1e4;
/// Neighbours of a vertex; six in a regular mesh.
const LINKS_PER_VERTEX: usize = 8;
/// The weights are solved until the residual is below this share of the start.
const SOLVED: f64 = 1e-9;

/// One handle and what moves with it.
#[derive(Clone, Debug, Default)]
pub(super) struct Roi {
    handle: Option<FaceId>,
    /// handle vertices first, then the free ones
    pub vertices: Vec<VertexId>,
    /// for each vertex: its share in the displacement of each handle vertex
    pub weights: Vec<[f64; 3]>,
    /// what the guard looks at
    pub neighbourhood: Neighbourhood,
    /// index in `vertices` of each vertex that moves
    pub marks: Marks,
    solver: Solver,
}

impl RoiSize {
    /// How many vertices to make room for, where edges are `mean_edge` (m) long: several times what a regular mesh
    /// needs, so that a sample allocates nothing.
    pub(super) fn room(self, mean_edge: f64) -> usize {
        let rings = match self {
            Self::Handle => 0.0,
            Self::OneRing => 1.0,
            Self::Radius(radius) => radius / mean_edge,
        };
        // a mesh far finer than the tip grows its buffers when it comes to that
        (16.0 * (1.0 + rings) * (1.0 + rings)).min(LARGEST_ROOM) as usize
    }
}

impl Roi {
    /// A region with room for `vertices`.
    pub fn with_room(vertices: usize) -> Self {
        let mut roi = Self::default();
        roi.vertices.reserve(vertices);
        roi.weights.reserve(vertices);
        roi.marks.reserve(vertices);
        roi.solver.reserve(vertices);
        roi.neighbourhood.reserve(vertices);
        roi
    }

    /// Whether it was made for this handle.
    pub fn is_for(&self, handle: FaceId) -> bool {
        self.handle == Some(handle)
    }

    /// The handle it was made for.
    pub fn handle(&self) -> Option<FaceId> {
        self.handle
    }

    /// Makes the region of `handle`.
    pub fn rebuild(&mut self, mesh: &TriMesh, handle: FaceId, size: RoiSize) {
        self.handle = Some(handle);
        self.marks.clear();
        self.vertices.clear();
        for vertex in mesh.corners(handle) {
            self.add(vertex);
        }
        self.spread(mesh, mesh.barycentre(handle), size);
        self.solver.solve(mesh, &self.vertices, &self.marks, &mut self.weights);
        self.neighbourhood.rebuild(mesh, &self.vertices, &self.marks);
    }

    fn add(&mut self, vertex: VertexId) {
        self.marks.insert(vertex.0, self.vertices.len() as u32);
        self.vertices.push(vertex);
    }

    fn spread(&mut self, mesh: &TriMesh, centre: Point3<f64>, size: RoiSize) {
        let radius = match size {
            RoiSize::Handle => return,
            RoiSize::OneRing => f64::INFINITY,
            RoiSize::Radius(radius) => radius,
        };
        let mut next = 0;
        let last = if size == RoiSize::OneRing { 3 } else { usize::MAX };
        while next < self.vertices.len().min(last) {
            for i in 0..mesh.star(self.vertices[next]).len() {
                let face = mesh.star(self.vertices[next])[i];
                for vertex in mesh.corners(face) {
                    let near = (mesh.position(vertex) - centre).norm_squared() <= radius * radius;
                    if near && self.marks.of(vertex.0).is_none() {
                        self.add(vertex);
                    }
                }
            }
            next += 1;
        }
    }
}

/// Solves the Laplace equation on the free vertices by conjugate gradients; its arrays are kept.
#[derive(Clone, Debug, Default)]
struct Solver {
    /// neighbours of free vertex i: `links[starts[i]..starts[i + 1]]`, by index in `vertices`; the rim is left out
    starts: Vec<u32>,
    links: Vec<u32>,
    /// neighbours of one vertex on the rim
    rim: Vec<VertexId>,
    /// number of all neighbours, the rim's too
    degrees: Vec<f64>,
    residual: Vec<[f64; 3]>,
    direction: Vec<[f64; 3]>,
    product: Vec<[f64; 3]>,
}

impl Solver {
    fn reserve(&mut self, vertices: usize) {
        self.starts.reserve(vertices);
        self.links.reserve(LINKS_PER_VERTEX * vertices);
        self.rim.reserve(4 * LINKS_PER_VERTEX);
        self.degrees.reserve(vertices);
        for list in [&mut self.residual, &mut self.direction, &mut self.product] {
            list.reserve(vertices);
        }
    }

    fn solve(&mut self, mesh: &TriMesh, vertices: &[VertexId], marks: &Marks, weights: &mut Vec<[f64; 3]>) {
        weights.clear();
        weights.extend([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        weights.resize(vertices.len(), [0.0; 3]);
        if vertices.len() > 3 {
            self.link(mesh, vertices, marks);
            self.conjugate_gradients(&mut weights[..]);
        }
    }

    fn link(&mut self, mesh: &TriMesh, vertices: &[VertexId], marks: &Marks) {
        self.starts.clear();
        self.links.clear();
        self.degrees.clear();
        for &vertex in &vertices[3..] {
            let start = self.links.len();
            self.starts.push(start as u32);
            self.rim.clear();
            for &face in mesh.star(vertex) {
                for other in mesh.corners(face) {
                    match marks.of(other.0) {
                        _ if other == vertex => {}
                        Some(index) if self.links[start..].contains(&index) => {}
                        Some(index) => self.links.push(index),
                        None if self.rim.contains(&other) => {}
                        None => self.rim.push(other),
                    }
                }
            }
            self.degrees.push((self.links.len() - start + self.rim.len()) as f64);
        }
        self.starts.push(self.links.len() as u32);
    }

    /// L w for the free vertices, with `w` of the handle first: degree · w − Σ w of the neighbours.
    fn laplacian(&self, free: usize, w: &[[f64; 3]]) -> [f64; 3] {
        let mut sum = w[free + 3].map(|x| x * self.degrees[free]);
        for &link in &self.links[self.starts[free] as usize..self.starts[free + 1] as usize] {
            for axis in 0..3 {
                sum[axis] -= w[link as usize][axis];
            }
        }
        sum
    }

    fn conjugate_gradients(&mut self, weights: &mut [[f64; 3]]) {
        let count = self.degrees.len();
        let zero = [[0.0; 3]; 3];
        self.residual.clear();
        self.direction.clear();
        self.direction.extend(zero);
        for free in 0..count {
            let residual = self.laplacian(free, weights).map(|x| -x);
            self.residual.push(residual);
            self.direction.push(residual);
        }
        self.product.resize(count, [0.0; 3]);
        let dot = |a: &[[f64; 3]], b: &[[f64; 3]]| -> [f64; 3] {
            a.iter().zip(b).fold([0.0; 3], |sum, (x, y)| std::array::from_fn(|i| sum[i] + x[i] * y[i]))
        };
        let mut size = dot(&self.residual, &self.residual);
        let enough = size.map(|x| x * SOLVED * SOLVED);
        // in exact arithmetic it ends after `count` rounds
        for _ in 0..count {
            if (0..3).all(|i| size[i] <= enough[i]) {
                break;
            }
            for free in 0..count {
                self.product[free] = self.laplacian(free, &self.direction);
            }
            let curvature = dot(&self.direction[3..], &self.product);
            let step: [f64; 3] = std::array::from_fn(|i| if curvature[i] > 0.0 { size[i] / curvature[i] } else { 0.0 });
            for free in 0..count {
                for i in 0..3 {
                    weights[free + 3][i] += step[i] * self.direction[free + 3][i];
                    self.residual[free][i] -= step[i] * self.product[free][i];
                }
            }
            let next = dot(&self.residual, &self.residual);
            for free in 0..count {
                for i in 0..3 {
                    let turn = if size[i] > 0.0 { next[i] / size[i] } else { 0.0 };
                    self.direction[free + 3][i] = self.residual[free][i] + turn * self.direction[free + 3][i];
                }
            }
            size = next;
        }
    }
}
