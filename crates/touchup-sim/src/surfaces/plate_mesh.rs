//! The boundary of a [`Plate`] as triangles.

use std::f64::consts::PI;

use nalgebra::{Point2, Point3};

use super::contour::MeshDraft;
use super::plate::{Extrusion, Plate, PlateStadium};
use super::triangulate::triangulate;
use touchup_geometry::mesh::{MeshError, TriMesh};

/// Fewest corners of a circle: a square is the smallest polygon that keeps a hole open.
const MIN_CORNERS: f64 = 4.0;
/// Most corners of a circle: more would only slow the ear cutting.
const MAX_CORNERS: f64 = 512.0;

impl PlateStadium {
    /// The outline as a counter-clockwise polygon whose corners lie on it; `chord_error`: largest
    /// distance from it, m.
    pub fn polygon(&self, chord_error: f64) -> Vec<Point2<f64>> {
        let corners = PI / (1.0 - (chord_error / self.radius).clamp(0.0, 1.0)).acos();
        // an even count: both ends of a slot get the same half circle
        let half = (corners.clamp(MIN_CORNERS, MAX_CORNERS) / 2.0).ceil() as usize;
        let along = self.to - self.from;
        let start = along.y.atan2(along.x) - PI / 2.0;
        let on = |centre: Point2<f64>, k: usize| {
            let angle = start + PI * k as f64 / half as f64;
            centre + nalgebra::Vector2::new(angle.cos(), angle.sin()) * self.radius
        };
        if along.norm() == 0.0 {
            return (0..2 * half).map(|k| on(self.to, k)).collect();
        }
        (0..=half)
            .map(|k| on(self.to, k))
            .chain((half..=2 * half).map(|k| on(self.from, k)))
            .collect()
    }
}

impl MeshDraft {
    fn add(&mut self, points: impl IntoIterator<Item = Point3<f64>>) -> Vec<u32> {
        let first = self.positions.len() as u32;
        self.positions.extend(points);
        (first..self.positions.len() as u32).collect()
    }

    /// Adds the rings at both ends of an extrusion and the wall between them; returns (low, high).
    fn wall(&mut self, e: &Extrusion, chord_error: f64, outwards: bool) -> (Vec<u32>, Vec<u32>) {
        let polygon = e.outline.polygon(chord_error);
        let [low, high] =
            [e.low, e.high].map(|z| self.add(polygon.iter().map(|q| Point3::new(q.x, q.y, z))));
        for i in 0..low.len() {
            let j = (i + 1) % low.len();
            let quad = [low[i], low[j], high[j], high[i]];
            self.quad(if outwards {
                quad
            } else {
                [quad[3], quad[2], quad[1], quad[0]]
            });
        }
        (low, high)
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.faces.extend([[a, b, c], [a, c, d]]);
    }

    /// Fills a plane face; `seen` gives the two coordinates of a point as seen from outside.
    fn fill(
        &mut self,
        outline: &[u32],
        holes: &[Vec<u32>],
        seen: impl Fn(&Point3<f64>) -> Point2<f64>,
    ) {
        let points: Vec<_> = self.positions.iter().map(seen).collect();
        self.faces.extend(triangulate(&points, outline, holes));
    }
}

impl Plate {
    /// The boundary as a watertight mesh of outward triangles, every vertex exactly on the surface.
    ///
    /// - `chord_error`: largest distance of a circle's polygon from the circle, m.
    ///
    /// # Errors
    /// As [`TriMesh::new`]; none is known to happen.
    pub fn mesh(&self, chord_error: f64) -> Result<TriMesh, MeshError> {
        let mut b = MeshDraft::default();
        let (size, x, z) = (self.size, self.step_x, self.step_z);
        // the step's outline, seen along −y: counter-clockwise with x to the right and z up
        let profile = [
            (0.0, 0.0),
            (size.x, 0.0),
            (size.x, z),
            (x, z),
            (x, size.z),
            (0.0, size.z),
        ];
        let [front, back] =
            [0.0, size.y].map(|y| b.add(profile.map(|(x, z)| Point3::new(x, y, z))));
        b.fill(&front, &[], |p| Point2::new(p.x, p.z));
        let reversed = |ring: &[u32]| ring.iter().rev().copied().collect::<Vec<_>>();
        b.fill(&reversed(&back), &[], |p| Point2::new(-p.x, p.z));
        for side in [1, 2, 3, 5] {
            let next = (side + 1) % 6;
            b.quad([front[side], back[side], back[next], front[next]]);
        }
        let (through_low, through) = b.wall(&self.through, chord_error, false);
        let (blind_low, blind) = b.wall(&self.blind, chord_error, false);
        let (slot_low, slot) = b.wall(&self.slot, chord_error, false);
        let (boss, boss_high) = b.wall(&self.boss, chord_error, true);
        let top = [front[5], front[4], back[4], back[5]];
        let holes = [&through, &blind, &slot, &boss].map(|ring| reversed(ring));
        b.fill(&top, &holes, |p| p.xy());
        let bottom = [front[0], back[0], back[1], front[1]];
        b.fill(&bottom, &[through_low], |p| Point2::new(-p.x, p.y));
        for lid in [blind_low, slot_low, boss_high] {
            b.fill(&lid, &[], |p| p.xy());
        }
        TriMesh::new(b.positions, b.faces)
    }
}
