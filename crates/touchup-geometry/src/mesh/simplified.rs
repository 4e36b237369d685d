//! A simplified mesh, and the transfer of its motion to the original mesh.
//!
//! Seeds (a Poisson-disk sampling) part the vertices into Voronoi cells, which keep thin sheets and
//! near but unconnected parts separate. Each cell becomes one vertex at the best meeting point of
//! the planes of its faces \[Garland Heckbert 1997\]; three cells that meet in a face become a face
//! \[Valette Chassery 2004\].

use std::collections::HashSet;

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::{MeshError, TriMesh, VertexId, triangle};
use crate::numeric::direction;

/// Cell of a vertex that no face uses.
const NONE: u32 = u32::MAX;
/// Mean edge of the simplified mesh over the distance between seeds.
const EDGE_OF_SPACING: f64 = 1.2;
/// Share of the largest curvature of a quadric below which the mean of the cell decides a
/// direction: planes within 8° of a common one do not fix their meeting point along it.
const FLAT: f64 = 0.02;

/// A coarse mesh in place of a fine one.
#[derive(Clone, Debug)]
pub struct SimplifiedMesh {
    /// the simplified mesh, m, in O
    pub mesh: TriMesh,
    /// vertex of `mesh` for each vertex slot of the original
    cells: Vec<u32>,
}

/// Sums over a cell.
#[derive(Clone, Copy, Debug, Default)]
struct CellSums {
    sum: Vector3<f64>,
    count: f64,
    rim_sum: Vector3<f64>,
    rim_count: f64,
    /// Σ a n nᵀ of its faces, a: area
    planes: Matrix3<f64>,
    /// Σ a n (n · p), relative to the seed
    offsets: Vector3<f64>,
}

impl SimplifiedMesh {
    /// Simplifies `mesh` to edges of about `edge` (m) in its finer parts. O(V edge² / (its own
    /// edges)² + F).
    ///
    /// # Errors
    /// Those of [`TriMesh::new`]; none is likely.
    pub fn new(mesh: &TriMesh, edge: f64) -> Result<Self, MeshError> {
        let spacing = edge / EDGE_OF_SPACING;
        let (cells, seeds) = cells_of(mesh, spacing);
        let mut made: Vec<CellSums> = vec![CellSums::default(); seeds.len()];
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

    /// The simplified vertex of an original vertex; `None`: no face uses it.
    pub fn cell_of(&self, vertex: VertexId) -> Option<VertexId> {
        self.cells
            .get(vertex.0 as usize)
            .filter(|cell| **cell != NONE)
            .map(|&cell| VertexId(cell))
    }

    /// The original with the motion of the simplified mesh: a vertex keeps its place beside its
    /// nearest face, turned like the corners of that face. Vertices near unmoved faces alone stay,
    /// bit by bit.
    ///
    /// - `original`: source of the simplified mesh.
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

    /// [`Self::carry`] for vertices of one cell: `put` receives the new place of each.
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

    /// Rotation of a simplified vertex, from its normal before to its normal in `moved`; `None` if
    /// it has not moved.
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
    /// - `positions`: of the simplified or of a moved mesh, m.
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

    /// New place of an original vertex; `None`: it stays.
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

impl CellSums {
    /// Place of the cell's vertex relative to the seed, m: the mean of its rim, else the best
    /// meeting point of the planes of its faces, with the mean in directions left open.
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
        // takes vertices nearer to it than to any earlier seed, as far as connected within the
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

/// Whether a vertex is at the rim: inside, each neighbour appears twice.
fn is_at_rim(mesh: &TriMesh, vertex: VertexId) -> bool {
    mesh.star(vertex)
        .iter()
        .flat_map(|&face| mesh.other_corners(face, vertex))
        .fold(0, |odd, other| odd ^ other.0)
        != 0
}
