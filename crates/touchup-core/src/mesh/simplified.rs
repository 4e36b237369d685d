//! A simplified mesh, and how its motion is carried over to the mesh that it stands for.
//!
//! The vertices are parted into cells around seeds (a Poisson-disk sampling with its Voronoi
//! cells), so that thin sheets and what lies near without being connected stays apart. Each cell
//! becomes one vertex, where the planes of its faces meet best \[Garland Heckbert 1997\]; three
//! cells that meet in a face become a face \[Valette Chassery 2004\].

use std::collections::HashSet;

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::{MeshError, TriMesh, VertexId, triangle};
use crate::numeric::direction;

/// Cell of a vertex that no face uses.
const NONE: u32 = u32::MAX;
/// Edges of the simplified mesh are longer than the distance between seeds by this, in the mean.
const EDGE_OF_SPACING: f64 = 1.2;
/// Share of the largest curvature of a quadric below which a direction is left to the mean of the
/// cell: planes 8° from a common one do not say where along it they meet.
const FLAT: f64 = 0.02;

/// A mesh with few faces in place of one with many.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// the simplified mesh, m, in O
    pub mesh: TriMesh,
    /// for each vertex slot of the original the vertex that stands for it
    cells: Vec<u32>,
}

/// What is known of a cell while it is made.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    sum: Vector3<f64>,
    count: f64,
    rim_sum: Vector3<f64>,
    rim_count: f64,
    /// Σ a n nᵀ of its faces, a: area
    planes: Matrix3<f64>,
    /// Σ a n (n · p), relative to the seed
    offsets: Vector3<f64>,
}

impl Simplified {
    /// Simplifies `mesh` to edges of about `edge` (m), wherever it has shorter ones. O(V edge² /
    /// (its own edges)² + F).
    ///
    /// # Errors
    /// None is expected: those of [`TriMesh::new`].
    pub fn new(mesh: &TriMesh, edge: f64) -> Result<Self, MeshError> {
        let spacing = edge / EDGE_OF_SPACING;
        let (cells, seeds) = cells_of(mesh, spacing);
        let mut made: Vec<Cell> = vec![Cell::default(); seeds.len()];
        for (vertex, &cell) in cells.iter().enumerate().filter(|(_, cell)| **cell != NONE) {
            let arm = mesh.positions()[vertex] - seeds[cell as usize];
            let cell = &mut made[cell as usize];
            (cell.sum, cell.count) = (cell.sum + arm, cell.count + 1.0);
            if is_at_rim(mesh, VertexId(vertex as u32)) {
                (cell.rim_sum, cell.rim_count) = (cell.rim_sum + arm, cell.rim_count + 1.0);
            }
        }
        let (mut faces, mut known) = (Vec::new(), HashSet::new());
        for (face, corners) in mesh.faces() {
            let owners = corners.map(|corner| cells[corner.0 as usize]);
            let double = mesh.double_area_normal(face);
            if let Some(normal) = direction(&double) {
                let (area, p) = (0.5 * double.norm(), mesh.barycentre(face));
                for owner in owners {
                    let cell = &mut made[owner as usize];
                    cell.planes += normal * normal.transpose() * area;
                    cell.offsets += normal * (area * normal.dot(&(p - seeds[owner as usize])));
                }
            }
            let [a, b, c] = owners;
            if a != b && b != c && c != a {
                let mut name = owners;
                name.sort_unstable();
                if known.insert(name) {
                    faces.push(owners);
                }
            }
        }
        let positions = seeds
            .iter()
            .zip(&made)
            .map(|(seed, cell)| seed + cell.place(spacing))
            .collect();
        Ok(Self {
            mesh: TriMesh::new(positions, faces)?,
            cells,
        })
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.mesh.bytes() + self.cells.capacity() * size_of::<u32>()
    }

    /// The vertex that stands for a vertex of the original; `None`: no face uses it.
    pub fn cell_of(&self, vertex: VertexId) -> Option<VertexId> {
        self.cells
            .get(vertex.0 as usize)
            .filter(|cell| **cell != NONE)
            .map(|&cell| VertexId(cell))
    }

    /// The original, moved as the simplified mesh was: a vertex keeps its place beside the face
    /// that it is nearest to, turned as the corners of that face are. What is near unmoved faces
    /// alone stays, bit by bit.
    ///
    /// - `original`: that it was made of.
    /// - `moved`: the simplified mesh, with other positions.
    pub fn carry(&self, original: &TriMesh, moved: &TriMesh) -> TriMesh {
        let mut detailed = original.clone();
        let turns: Vec<_> = (0..self.mesh.vertex_slots() as u32)
            .map(|at| self.turn(VertexId(at), moved))
            .collect();
        for (vertex, &cell) in self
            .cells
            .iter()
            .enumerate()
            .filter(|(_, cell)| **cell != NONE)
        {
            let (vertex, here) = (VertexId(vertex as u32), original.positions()[vertex]);
            let place = self.carried(&here, VertexId(cell), moved, |corner| {
                turns[corner.0 as usize]
            });
            place
                .into_iter()
                .for_each(|place| detailed.set_position(vertex, place));
        }
        detailed
    }

    /// As [`Self::carry`], for vertices of one cell: `put` takes where each of them is then.
    ///
    /// - `moved`: has the vertices of the simplified mesh, and may have other faces.
    pub fn carry_cell(
        &self,
        cell: VertexId,
        members: impl Iterator<Item = VertexId>,
        original: &TriMesh,
        moved: &TriMesh,
        mut put: impl FnMut(VertexId, Point3<f64>),
    ) {
        let mut turns: Vec<(VertexId, Option<UnitQuaternion<f64>>)> = Vec::new();
        for corner in self
            .mesh
            .star(cell)
            .iter()
            .flat_map(|&face| self.mesh.corners(face))
        {
            if !turns.iter().any(|(known, _)| *known == corner) {
                turns.push((corner, self.turn(corner, moved)));
            }
        }
        let turn = |corner| {
            turns
                .iter()
                .find(|(known, _)| *known == corner)
                .and_then(|(_, turn)| *turn)
        };
        for vertex in members {
            let here = original.position(vertex);
            put(
                vertex,
                self.carried(&here, cell, moved, turn).unwrap_or(here),
            );
        }
    }

    /// How a vertex of the simplified mesh has turned: from its normal as scanned to that as moved;
    /// `None` where it has not moved.
    fn turn(&self, vertex: VertexId, moved: &TriMesh) -> Option<UnitQuaternion<f64>> {
        if self.mesh.position(vertex) == moved.position(vertex) {
            return None;
        }
        let [before, after] =
            [&self.mesh, moved].map(|mesh| self.star_normal(vertex, mesh.positions()));
        Some(UnitQuaternion::rotation_between(&before, &after).unwrap_or_default())
    }

    /// Sum of the normals of the faces around a vertex, each times its area, m².
    ///
    /// - `positions`: of the simplified mesh or of one that was moved, m.
    fn star_normal(&self, vertex: VertexId, positions: &[Point3<f64>]) -> Vector3<f64> {
        let doubled = self.mesh.star(vertex).iter().map(|&face| {
            let [a, b, c] = self
                .mesh
                .corners(face)
                .map(|corner| positions[corner.0 as usize]);
            (b - a).cross(&(c - a))
        });
        doubled.sum::<Vector3<f64>>() * 0.5
    }

    /// Where a vertex of the original goes; `None`: it stays.
    fn carried(
        &self,
        here: &Point3<f64>,
        cell: VertexId,
        moved: &TriMesh,
        turn: impl Fn(VertexId) -> Option<UnitQuaternion<f64>>,
    ) -> Option<Point3<f64>> {
        let star = self.mesh.star(cell);
        let is_moved = |corner: &VertexId| self.mesh.position(*corner) != moved.position(*corner);
        if !star
            .iter()
            .flat_map(|&face| self.mesh.corners(face))
            .any(|corner| is_moved(&corner))
        {
            return None;
        }
        let nearest = star.iter().map(|&face| {
            let (point, barycentric) = triangle::closest_point(here, &self.mesh.triangle(face));
            ((here - point).norm_squared(), face, barycentric)
        });
        let (_, face, barycentric) =
            nearest.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        let corners = self.mesh.corners(face);
        if !corners.iter().any(is_moved) {
            return None;
        }
        let mut place = Vector3::zeros();
        for (corner, share) in corners.into_iter().zip(barycentric) {
            let arm = here - self.mesh.position(corner);
            place +=
                (moved.position(corner).coords + turn(corner).unwrap_or_default() * arm) * share;
        }
        Some(Point3::from(place))
    }
}

impl Cell {
    /// Where its vertex is, relative to the seed, m: at the rim the mean of the rim, else where the
    /// planes of its faces meet best, and the mean where they leave that open.
    fn place(&self, spacing: f64) -> Vector3<f64> {
        if self.rim_count > 0.0 {
            return self.rim_sum / self.rim_count;
        }
        let mean = self.sum / self.count.max(1.0);
        let eigen = self.planes.symmetric_eigen();
        let (largest, missing) = (eigen.eigenvalues.max(), self.offsets - self.planes * mean);
        let mut step = Vector3::zeros();
        for (curvature, axis) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *curvature > FLAT * largest {
                step += axis * (axis.dot(&missing) / curvature);
            }
        }
        if step.norm() <= spacing {
            mean + step
        } else {
            mean
        }
    }
}

/// The cell of each vertex slot, and the seeds.
fn cells_of(mesh: &TriMesh, spacing: f64) -> (Vec<u32>, Vec<Point3<f64>>) {
    let slots = mesh.vertex_slots();
    let (mut cells, mut nearest) = (vec![NONE; slots], vec![f64::INFINITY; slots]);
    let (mut seen, mut queue, mut seeds) = (vec![NONE; slots], Vec::new(), Vec::new());
    let reach = spacing * spacing;
    for vertex in 0..slots as u32 {
        if nearest[vertex as usize] < f64::INFINITY || !mesh.has_vertex(VertexId(vertex)) {
            continue;
        }
        if mesh.star(VertexId(vertex)).is_empty() {
            continue;
        }
        // takes what is nearer to it than to any seed before, as far as it is connected within the
        // spacing
        let (seed, number) = (mesh.position(VertexId(vertex)), seeds.len() as u32);
        seeds.push(seed);
        (
            cells[vertex as usize],
            nearest[vertex as usize],
            seen[vertex as usize],
        ) = (number, 0.0, number);
        queue.push(vertex);
        while let Some(vertex) = queue.pop() {
            for other in mesh
                .star(VertexId(vertex))
                .iter()
                .flat_map(|&face| mesh.corners(face))
            {
                let at = other.0 as usize;
                if std::mem::replace(&mut seen[at], number) == number {
                    continue;
                }
                let distance = (mesh.positions()[at] - seed).norm_squared();
                if distance <= reach {
                    queue.push(other.0);
                    if distance < nearest[at] {
                        (nearest[at], cells[at]) = (distance, number);
                    }
                }
            }
        }
    }
    (cells, seeds)
}

/// Whether a vertex is at the rim: around others each neighbour is met twice.
fn is_at_rim(mesh: &TriMesh, vertex: VertexId) -> bool {
    mesh.star(vertex)
        .iter()
        .flat_map(|&face| mesh.other_corners(face, vertex))
        .fold(0, |odd, other| odd ^ other.0)
        != 0
}
