//! Round walls: the merged segments on one cylinder, or one cone.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use super::fit::SurfaceModel;
use super::segmentation::facets::Facets;
use super::segmentation::primitive::Primitive;
use super::segmentation::segment::{Segment, Segmentation};
use touchup_geometry::numeric::{median, tangent_basis};

/// A round wall, perhaps interrupted.
#[derive(Clone, Debug)]
pub(super) struct Wall {
    /// m
    radius_at_origin: f64,
    /// of a cone, rad; `None`: a cylinder
    pub half_angle: Option<f64>,
    /// whether the air is on the side of the axis: a hole
    pub is_concave: bool,
    /// numbers of its segments, the largest first
    pub segments: Vec<usize>,
    /// a point of the axis, m, in O: origin of lengths along it
    pub origin: Point3<f64>,
    /// unit vector; of a cone from the apex into it
    pub axis: Vector3<f64>,
    /// range along the axis, m
    pub ends: [f64; 2],
    /// covered share of the turn, in the mesh or by contacts
    pub coverage: f64,
    /// share of the turn covered by contacts alone, 0 unless they are all around
    pub felt_turn: f64,
    /// whether the ball felt it along its edge alone: that hardly shows its axis
    pub is_edge: bool,
    /// share of its area between its ends that its faces cover
    pub filled: f64,
    /// unit vector from the axis to the middle of the covered parts of the turn; 0 if undefined
    pub towards: Vector3<f64>,
}

/// Number of parts of a turn.
const PARTS: usize = 72;
/// Minimum share of a turn of contacts all around: those on the end of a slot, or in a notch, are
/// not.
pub(super) const ALL_AROUND: f64 = 0.75;
/// Half of the turn that a contact covers, rad: 7°.
const BESIDE_CONTACT: f64 = 0.12;
/// Axes of one wall differ by less: 6°.
const SAME_AXIS: f64 = 0.9945;
/// Tolerance of radii, and of positions of the axis, of one wall, as a share.
const SAME_RADIUS: f64 = 0.08;
/// Maximum distance of the middle of a wall's edge from its axis, in radii.
const EDGE_OFF: f64 = 0.15;
/// Maximum gap between pieces of a wall along the axis, in radii.
pub(super) const SAME_WALL: f64 = 2.0;

impl Wall {
    /// All round walls of a mesh, the largest first.
    pub(crate) fn all(facets: &Facets, segmentation: &Segmentation) -> Vec<Self> {
        let mut walls: Vec<Self> = Vec::new();
        for number in 0..segmentation.segments.len() {
            let Some(wall) = Self::of(facets, segmentation, vec![number]) else {
                continue;
            };
            let same = walls.iter_mut().find(|other| other.goes_on_as(&wall));
            match same {
                Some(other) => {
                    let segments = [other.segments.clone(), wall.segments].concat();
                    if let Some(joint) = Self::of(facets, segmentation, segments) {
                        *other = joint;
                    }
                }
                None => walls.push(wall),
            }
        }
        walls
    }

    /// The wall of these segments.
    fn of(facets: &Facets, segmentation: &Segmentation, segments: Vec<usize>) -> Option<Self> {
        let of_wall = |&number: &usize| segmentation.segments[number].faces.iter().copied();
        let faces: Vec<u32> = segments.iter().flat_map(of_wall).collect();
        let felt: Vec<Point3<f64>> = segments
            .iter()
            .flat_map(|&number| &segmentation.segments[number].felt)
            .map(|felt| felt.place)
            .collect();
        let of_walls = segments
            .iter()
            .map(|&number| &segmentation.segments[number]);
        let is_edge = !felt.is_empty() && of_walls.flat_map(Segment::touches).next().is_none();
        let wall = Self::of_evidence(
            facets,
            &segmentation.segments[segments[0]].primitive,
            &faces,
            &felt,
            segments,
        )?;
        Some(Self { is_edge, ..wall })
    }

    /// The wall of these faces; `None` for a plane or a sphere.
    pub(crate) fn of_faces(
        facets: &Facets,
        primitive: &Primitive,
        faces: &[u32],
        segments: Vec<usize>,
    ) -> Option<Self> {
        Self::of_evidence(facets, primitive, faces, &[], segments)
    }

    /// The wall of these faces and places of contacts; `None` for a plane or a sphere.
    #[expect(clippy::too_many_lines)]
    fn of_evidence(
        facets: &Facets,
        primitive: &Primitive,
        faces: &[u32],
        felt: &[Point3<f64>],
        segments: Vec<usize>,
    ) -> Option<Self> {
        let (origin, axis, radius_at_origin, half_angle, is_concave) = match primitive {
            Primitive::Plane(_) | Primitive::Sphere(_) => return None,
            Primitive::Cylinder(wall) => {
                (wall.center(), wall.axis(), wall.radius, None, wall.concave)
            }
            Primitive::Cone(cone) => (
                cone.apex()?,
                cone.axis(),
                0.0,
                Some(cone.half_angle),
                cone.concave,
            ),
        };
        let [e, g] = tangent_basis(&axis);
        let mut parts = [[f64::INFINITY, f64::NEG_INFINITY]; PARTS];
        let mut spans = Vec::with_capacity(faces.len());
        for &face in faces {
            let corners = facets.triangle(face).map(|p| p - origin);
            let along = corners.map(|v| v.dot(&axis));
            let span = span_of(corners.map(|v| v.dot(&g).atan2(v.dot(&e))));
            spans.push(span);
            for part in parts_between(span) {
                along
                    .iter()
                    .for_each(|t| parts[part] = [parts[part][0].min(*t), parts[part][1].max(*t)]);
            }
        }
        let mut felt_spans = Vec::with_capacity(felt.len());
        for v in felt.iter().map(|place| place - origin) {
            let (t, turn) = (v.dot(&axis), v.dot(&g).atan2(v.dot(&e)));
            let span = [turn - BESIDE_CONTACT, turn + BESIDE_CONTACT];
            felt_spans.push(span);
            for part in parts_between(span) {
                parts[part] = [parts[part][0].min(t), parts[part][1].max(t)];
            }
        }
        spans.extend(&felt_spans);
        let felt_turn = covered_share(felt_spans);
        let covered: Vec<_> = parts.iter().filter(|part| part[0] <= part[1]).collect();
        let coverage = covered_share(spans);
        // the usual end, not the farthest: walls have ears
        let ends =
            [0, 1].map(|end| median(&mut covered.iter().map(|part| part[end]).collect::<Vec<_>>()));
        let [Some(low), Some(high)] = ends else {
            return None;
        };
        let ends = [low, high];
        let away = |part: usize| {
            let (sine, cosine) = (TAU * (part as f64 + 0.5) / PARTS as f64).sin_cos();
            e * cosine + g * sine
        };
        let is_covered = |&part: &usize| parts[part][0] <= parts[part][1];
        let towards = (0..PARTS)
            .filter(is_covered)
            .map(away)
            .sum::<Vector3<f64>>();
        let towards = towards
            .try_normalize(f64::EPSILON * PARTS as f64)
            .unwrap_or_default();
        let filled = 0.0;
        let mut wall = Self {
            radius_at_origin,
            half_angle,
            is_concave,
            segments,
            origin,
            axis,
            ends,
            coverage,
            felt_turn: if felt_turn >= ALL_AROUND {
                felt_turn
            } else {
                0.0
            },
            is_edge: false,
            filled,
            towards,
        };
        let slant = wall.radius() / half_angle.unwrap_or(0.0).cos();
        let whole = TAU * slant * wall.height() * coverage;
        wall.filled = if whole > 0.0 {
            facets.area_of(faces) / whole
        } else {
            0.0
        };
        Some(wall)
    }

    /// Whether `other` is a piece of the same wall.
    fn goes_on_as(&self, other: &Self) -> bool {
        let is_same = match (self.half_angle, other.half_angle) {
            (None, None) => (self.radius() - other.radius()).abs() < SAME_RADIUS * self.radius(),
            (Some(a), Some(b)) => {
                (a - b).abs() < SAME_RADIUS && (self.origin - other.origin).norm() < self.radius()
            }
            _ => false,
        };
        is_same
            && self.is_concave == other.is_concave
            && match (self.is_edge, other.is_edge) {
                (_, true) => self.is_about(&other.at(other.middle()), EDGE_OFF * self.radius()),
                (true, _) => other.is_about(&self.at(self.middle()), EDGE_OFF * self.radius()),
                _ => self.is_coaxial(other, SAME_RADIUS),
            }
            && self.gap(other) < SAME_WALL * self.radius()
    }

    /// Whether the axes are one within a share of the radius.
    pub(crate) fn is_coaxial(&self, other: &Self, share: f64) -> bool {
        self.axis.dot(&other.axis).abs() > SAME_AXIS
            && self.is_about(
                &other.at(other.middle()),
                share * self.radius().max(other.radius()),
            )
    }

    /// Whether a point is within a distance, m, of the axis.
    pub(super) fn is_about(&self, p: &Point3<f64>, distance: f64) -> bool {
        let v = p - self.origin;
        (v - self.axis * v.dot(&self.axis)).norm() < distance
    }

    /// Distance between the walls along the axis, m; negative for an overlap.
    pub(crate) fn gap(&self, other: &Self) -> f64 {
        let along = other
            .ends
            .map(|t| (other.at(t) - self.origin).dot(&self.axis));
        let (low, high) = (along[0].min(along[1]), along[0].max(along[1]));
        (low - self.ends[1]).max(self.ends[0] - high)
    }

    /// Point of the axis, m.
    pub(crate) fn at(&self, t: f64) -> Point3<f64> {
        self.origin + self.axis * t
    }

    pub(crate) fn middle(&self) -> f64 {
        (self.ends[0] + self.ends[1]) / 2.0
    }

    pub(crate) fn height(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// m; of a cone at mid-height.
    pub(crate) fn radius(&self) -> f64 {
        self.radius_at(self.middle())
    }

    /// m
    pub(crate) fn radius_at(&self, t: f64) -> f64 {
        self.radius_at_origin + self.half_angle.map_or(0.0, |angle| t * angle.tan())
    }

    pub(crate) fn is_cone(&self) -> bool {
        self.half_angle.is_some()
    }
}

/// Range of angles of the corners of a face, rad.
fn span_of(angles: [f64; 3]) -> [f64; 2] {
    let from = angles[0];
    let turned = angles.map(|angle| (angle - from + PI).rem_euclid(TAU) - PI);
    [
        turned.iter().copied().fold(0.0, f64::min) + from,
        turned.iter().copied().fold(0.0, f64::max) + from,
    ]
}

/// Share of a turn that spans cover together, without gaps of less than a part: the same whatever
/// the start of the turn.
fn covered_share(spans: Vec<[f64; 2]>) -> f64 {
    let begun = spans
        .into_iter()
        .map(|[low, high]| (low.rem_euclid(TAU), high - low));
    // an excess beyond the turn begins it
    let mut spans: Vec<[f64; 2]> = begun
        .flat_map(|(low, length)| {
            let high = low + length;
            [[low, high.min(TAU)], [0.0, high - TAU]]
        })
        .filter(|[low, high]| low < high)
        .collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let gap = TAU / PARTS as f64;
    let (mut covered, mut until) = (0.0, spans.first().map_or(0.0, |span| span[0]));
    for [low, high] in spans {
        let from = if low - until < gap { until } else { low };
        covered += (high - from).max(0.0);
        until = until.max(high);
    }
    covered / TAU
}

/// The parts of a turn in a span.
fn parts_between([low, high]: [f64; 2]) -> impl Iterator<Item = usize> {
    let size = TAU / PARTS as f64;
    let (first, last) = ((low / size).floor() as i64, (high / size).ceil() as i64);
    (first..last).map(|at| at.rem_euclid(PARTS as i64) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_that_overlap_or_go_beyond_a_turn_count_once() {
        let degrees = |spans: &[[f64; 2]]| {
            covered_share(spans.iter().map(|span| span.map(f64::to_radians)).collect()) * 360.0
        };
        assert!((degrees(&[[10.0, 40.0], [30.0, 70.0], [100.0, 120.0]]) - 80.0).abs() < 1e-9);
        assert!(
            (degrees(&[[10.0, 40.0], [44.0, 70.0], [76.0, 80.0]]) - 64.0).abs() < 1e-9,
            "a gap of 4°, one of 6°"
        );
        // 350° to 20°, 10° to 15° within it, −20° to −5° half within it
        assert!((degrees(&[[350.0, 380.0], [10.0, 15.0], [-20.0, -5.0]]) - 40.0).abs() < 1e-9);
        assert!((degrees(&[[-180.0, 0.0], [0.0, 180.0]]) - 360.0).abs() < 1e-9);
    }
}
