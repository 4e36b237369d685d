//! Region of interest around a touched face: handle, free vertices, fixed rim \[paper, Sec 4.3\].
//!
//! The handle is the touched face. Free vertices follow it by Laplacian surface editing with
//! uniform weights \[Sorkine 2004\]: the displacement of each free vertex is the mean of its
//! neighbours' displacements, the handle's is an input, the rim's is zero. The solution is linear
//! in the displacements of the three handle vertices, hence one solution for each handle, as three
//! weights for each free vertex.

use nalgebra::Point3;

use super::guard::Neighbourhood;
use super::ring::Ring;
use super::scratch_map::ScratchMap;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// Extent of the free vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RoiSize {
    /// Only the handle moves.
    Handle,
    /// All neighbours of the handle are free \[paper\].
    OneRing,
    /// Connected vertices within this distance (m) of the handle's barycentre are free.
    Radius(f64),
}

/// Maximum number of vertices with room made ahead.
const LARGEST_ROOM: f64 = 1e4;
/// Entries of a row of the skyline; twelve in a ring around a face, some thirty for a few hundred
/// vertices.
const ROW_ENTRIES: usize = 32;

/// One handle and its moving vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Roi {
    /// face of the region; `None` after others added, removed or moved faces
    pub handle: Option<FaceId>,
    /// handle vertices first, then the free ones
    pub vertices: Vec<VertexId>,
    /// for each vertex: its share in the displacement of each handle vertex
    pub weights: Vec<[f64; 3]>,
    /// faces under guard
    pub neighbourhood: Neighbourhood,
    /// index in `vertices` of each moving vertex; their neighbours have higher numbers
    pub numbers: ScratchMap,
    solver: Solver,
}

impl RoiSize {
    /// Number of vertices to make room for, at an edge length of `mean_edge` (m): several times the
    /// need of a regular mesh, so that a sample allocates nothing.
    pub(super) fn room(self, mean_edge: f64) -> usize {
        let rings = match self {
            Self::Handle => 0.0,
            Self::OneRing => 1.0,
            Self::Radius(radius) => radius / mean_edge,
        };
        // a mesh far finer than the tip grows its buffers on demand
        (16.0 * (1.0 + rings) * (1.0 + rings)).min(LARGEST_ROOM) as usize
    }
}

impl Roi {
    /// A region with room for `vertices`.
    pub(crate) fn with_room(vertices: usize) -> Self {
        let mut roi = Self::default();
        roi.vertices.reserve(vertices);
        roi.weights.reserve(vertices);
        roi.numbers.reserve(4 * vertices);
        roi.solver.reserve(vertices);
        roi.neighbourhood.reserve(vertices);
        roi
    }

    /// Builds the region of `handle`; finds the connectivity of its faces only for free vertices or
    /// a guard.
    pub(crate) fn rebuild(
        &mut self,
        mesh: &TriMesh,
        handle: FaceId,
        size: RoiSize,
        is_guarded: bool,
    ) {
        self.handle = Some(handle);
        self.numbers.clear();
        self.vertices.clear();
        mesh.corners(handle)
            .into_iter()
            .for_each(|vertex| self.add(vertex));
        self.spread(mesh, mesh.barycentre(handle), size);
        let ring = &mut self.neighbourhood.ring;
        ring.gather(mesh, &self.vertices);
        if is_guarded || self.vertices.len() > 3 {
            ring.link(mesh, &self.vertices, &mut self.numbers);
        }
        self.solver.solve(
            &self.neighbourhood.ring,
            self.vertices.len(),
            &mut self.weights,
        );
    }

    fn add(&mut self, vertex: VertexId) {
        self.numbers.number([vertex.0]);
        self.vertices.push(vertex);
    }

    fn spread(&mut self, mesh: &TriMesh, centre: Point3<f64>, size: RoiSize) {
        let (radius, last) = match size {
            RoiSize::Handle => return,
            RoiSize::OneRing => (f64::INFINITY, 3),
            RoiSize::Radius(radius) => (radius, usize::MAX),
        };
        let mut next = 0;
        while next < self.vertices.len().min(last) {
            for &face in mesh.star(self.vertices[next]) {
                for vertex in mesh.corners(face) {
                    let near = (mesh.position(vertex) - centre).norm_squared() <= radius * radius;
                    if near && self.numbers.of(vertex.0).is_none() {
                        self.add(vertex);
                    }
                }
            }
            next += 1;
        }
    }
}

/// Solves the Laplace equation on the free vertices by L D Lᵀ in skyline storage; reuses its
/// arrays.
///
/// Vertices come ring by ring, so that neighbours are close in the order and the skyline is low.
#[derive(Clone, Debug, Default)]
struct Solver {
    /// row i of the matrix is `rows[starts[i]..starts[i + 1]]`: from its first entry to the
    /// diagonal
    rows: Vec<f64>,
    starts: Vec<usize>,
}

impl Solver {
    fn reserve(&mut self, vertices: usize) {
        self.rows.reserve(ROW_ENTRIES * vertices);
        self.starts.reserve(vertices + 1);
    }

    fn solve(&mut self, ring: &Ring, vertices: usize, weights: &mut Vec<[f64; 3]>) {
        weights.clear();
        weights.extend([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        weights.resize(vertices, [0.0; 3]);
        let (_, free) = weights.split_at_mut(3);
        self.assemble(ring, free);
        self.factorise();
        self.substitute(free);
    }

    /// degree · w − Σ w of the neighbours = 0: the handle's neighbours go to the right side, the
    /// rim's are zero.
    fn assemble(&mut self, ring: &Ring, right: &mut [[f64; 3]]) {
        self.rows.clear();
        self.starts.clear();
        for (row, right) in right.iter_mut().enumerate() {
            let neighbours = ring.neighbours(row + 3);
            let earlier = neighbours
                .iter()
                .map(|&other| other as usize)
                .filter(|&other| other >= 3);
            let first = earlier.map(|other| other - 3).min().unwrap_or(row).min(row);
            let start = self.rows.len();
            self.starts.push(start);
            self.rows.resize(start + row - first + 1, 0.0);
            for &other in neighbours {
                match (other as usize).checked_sub(3) {
                    None => right[other as usize] += 1.0,
                    Some(column) if column < row => self.rows[start + column - first] = -1.0,
                    Some(_) => {}
                }
            }
            if let Some(diagonal) = self.rows.last_mut() {
                *diagonal = neighbours.len() as f64;
            }
        }
        self.starts.push(self.rows.len());
    }

    /// First column of a row.
    fn first(&self, row: usize) -> usize {
        row + 1 - (self.starts[row + 1] - self.starts[row])
    }

    /// Puts L below the diagonal and D on it. The matrix is positive definite: every free vertex is
    /// connected to the handle.
    fn factorise(&mut self) {
        for row in 0..self.starts.len() - 1 {
            let (first, start) = (self.first(row), self.starts[row]);
            for column in first..row {
                let (above_first, above) = (self.first(column), self.starts[column]);
                let from = first.max(above_first);
                let done = &self.rows[start + from - first..start + column - first];
                let other = &self.rows[above + from - above_first..above + column - above_first];
                let sum: f64 = done.iter().zip(other).map(|(x, y)| x * y).sum();
                self.rows[start + column - first] -= sum;
            }
            // the row holds L D at this point
            let mut diagonal = self.rows[start + row - first];
            for column in first..row {
                let scaled = self.rows[start + column - first];
                let factor = scaled / self.rows[self.starts[column + 1] - 1];
                diagonal -= scaled * factor;
                self.rows[start + column - first] = factor;
            }
            self.rows[start + row - first] = diagonal;
        }
    }

    fn substitute(&self, x: &mut [[f64; 3]]) {
        let rows = self.starts.len() - 1;
        let below = |row: usize| {
            (
                self.first(row),
                &self.rows[self.starts[row]..self.starts[row + 1] - 1],
            )
        };
        for row in 0..rows {
            let (first, factors) = below(row);
            for (column, factor) in (first..).zip(factors) {
                x[row] = less(&x[row], *factor, &x[column]);
            }
        }
        for (row, value) in x.iter_mut().enumerate() {
            let diagonal = self.rows[self.starts[row + 1] - 1];
            *value = value.map(|value| value / diagonal);
        }
        for row in (0..rows).rev() {
            let (first, factors) = below(row);
            for (column, factor) in (first..).zip(factors) {
                x[column] = less(&x[column], *factor, &x[row]);
            }
        }
    }
}

/// x − factor · y.
#[inline]
fn less(x: &[f64; 3], factor: f64, y: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| x[i] - factor * y[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan around vertex 0 with the handle 0–1–2 and a second ring; 3–8 and 12 are free.
    #[test]
    fn weights_solve_the_laplace_equation() {
        let ring = |k: u32, radius: f64| {
            let turn = std::f64::consts::TAU * f64::from(k) / 6.0;
            Point3::new(radius * turn.cos(), radius * turn.sin(), 0.0)
        };
        let mut positions = vec![Point3::origin()];
        positions.extend(
            (0..6)
                .map(|k| ring(k, 1.0))
                .chain((0..6).map(|k| ring(k, 2.0))),
        );
        let mut faces = Vec::new();
        for k in 0..6 {
            let (a, b, c, d) = (1 + k, 1 + (k + 1) % 6, 7 + k, 7 + (k + 1) % 6);
            faces.extend([[0, a, b], [a, c, b], [b, c, d]]);
        }
        let mesh = TriMesh::new(positions, faces).unwrap();
        let mut roi = Roi::with_room(16);
        roi.rebuild(&mesh, FaceId(0), RoiSize::OneRing, false);
        assert_eq!(
            roi.vertices.len(),
            10,
            "the handle, four more of the inner ring, three of the outer"
        );
        for (vertex, weights) in roi.vertices.iter().zip(&roi.weights).skip(3) {
            let mut around: Vec<_> = mesh
                .star(*vertex)
                .iter()
                .flat_map(|&face| mesh.corners(face))
                .collect();
            around.sort_unstable();
            around.dedup();
            around.retain(|other| other != vertex);
            let of = |v: &VertexId| {
                roi.vertices
                    .iter()
                    .position(|w| w == v)
                    .map_or([0.0; 3], |i| roi.weights[i])
            };
            for (i, weight) in weights.iter().enumerate() {
                let mean = around.iter().map(|v| of(v)[i]).sum::<f64>() / around.len() as f64;
                assert!((weight - mean).abs() < 1e-15);
            }
        }
    }
}
