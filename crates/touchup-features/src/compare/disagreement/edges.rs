//! Edges that a scanner of limited resolution rounds, and narrow places that it closes over.

use nalgebra::{Point3, Vector3};

use crate::compare::IndexedMesh;
use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::{PointGrid, median};

/// Minimum width that the scanner sees, in edges of the scan's triangles: a facet on each wall, one
/// on the floor, and one in between.
const NARROW: f64 = 5.0;
/// Distance within which edges are round, in edges of the triangles.
const ROUNDED: f64 = 1.5;
/// Maximum height of an edge over a place's tangent plane, in edges of the triangles, for an edge
/// of the same surface.
const LEVEL: f64 = 0.2;
/// Minimum turn at an edge of the refined mesh, as a cosine: 35°.
pub(super) const SHARP: f64 = 0.82;
/// Share of its radius within which a ball of the least visible width touches only its contact
/// point.
const FITS: f64 = 0.85;

/// Median length of the edges, m.
fn median_edge(mesh: &TriMesh) -> f64 {
    let sides = |[a, b, c]: [Point3<f64>; 3]| [(a - b).norm(), (b - c).norm(), (c - a).norm()];
    let mut lengths: Vec<f64> = mesh
        .faces()
        .flat_map(|(face, _)| sides(mesh.triangle(face)))
        .collect();
    median(&mut lengths).unwrap_or(0.0)
}

/// Vertices at sharp edges between touched faces, by slot: whether one is convex there, and whether
/// one is concave.
fn sharp_vertices(mesh: &TriMesh, is_seen: &[bool]) -> Vec<[bool; 2]> {
    let mut is_sharp = vec![[false; 2]; mesh.vertex_slots()];
    for (face, corners) in mesh.faces() {
        for i in 0..3 {
            let [a, b] = [corners[i], corners[(i + 1) % 3]];
            if !(a < b && (is_seen[a.0 as usize] || is_seen[b.0 as usize])) {
                continue;
            }
            for other in mesh.faces_at_edge(a, b).filter(|&other| other != face) {
                if mesh.normal(face).dot(&mesh.normal(other)) < SHARP {
                    let side = usize::from(
                        (mesh.barycentre(other) - mesh.position(a)).dot(&mesh.normal(face)) > 0.0,
                    );
                    [a, b]
                        .into_iter()
                        .for_each(|v| is_sharp[v.0 as usize][side] = true);
                }
            }
        }
    }
    is_sharp
}

/// The edges of a refined mesh that a scanner rounds.
pub(super) struct SharpEdges {
    /// median edge of the scan's triangles, m
    pub resolution: f64,
    /// vertices at these edges, by slot: whether one is convex there, and whether one is concave
    is_sharp: Vec<[bool; 2]>,
    /// the same vertices, by place
    grid: PointGrid,
}

impl SharpEdges {
    pub(crate) fn of(scan: &TriMesh, refined: &TriMesh, is_seen: &[bool]) -> Self {
        let (resolution, is_sharp) = (median_edge(scan), sharp_vertices(refined, is_seen));
        let sharp = (0..is_sharp.len()).filter(|&at| is_sharp[at] != [false; 2]);
        let grid = PointGrid::of(refined.positions(), sharp, ROUNDED * resolution);
        Self {
            resolution,
            is_sharp,
            grid,
        }
    }

    /// Distance within which edges are round, m.
    pub(crate) fn reach(&self) -> f64 {
        ROUNDED * self.resolution
    }

    /// Width below which the scan closes over gaps, m.
    pub(crate) fn sees_from(&self) -> f64 {
        NARROW * self.resolution
    }

    /// Vertices at rounded edges near a place.
    fn near(&self, p: &Point3<f64>) -> impl Iterator<Item = usize> {
        self.grid.near(p, self.reach())
    }

    /// Whether the scanner may round an edge at a place.
    pub(crate) fn is_near(&self, p: &Point3<f64>) -> bool {
        self.near(p).next().is_some()
    }

    /// Whether a place's own surface has a convex edge nearby, so that a scan may be too low there,
    /// and a concave edge, so that it may be too high.
    pub(crate) fn may_be(
        &self,
        mesh: &TriMesh,
        p: &Point3<f64>,
        normal: &Vector3<f64>,
    ) -> [bool; 2] {
        let is_own = |&other: &usize| {
            (mesh.positions()[other] - p).dot(normal).abs() <= LEVEL * self.resolution
        };
        let sides = self
            .near(p)
            .filter(is_own)
            .map(|other| self.is_sharp[other]);
        sides.fold([false; 2], |[out, inward], [convex, concave]| {
            [out || convex, inward || concave]
        })
    }

    /// Whether a place is wide enough for a scanner of this resolution.
    pub(crate) fn is_wide(
        &self,
        shape: &IndexedMesh<'_>,
        p: &Point3<f64>,
        normal: &Vector3<f64>,
    ) -> bool {
        let radius = self.sees_from() / 2.0;
        shape
            .tree
            .closest(shape.mesh, &(p + normal * radius), FITS * radius)
            .is_none()
    }
}
