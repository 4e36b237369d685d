//! Round walls: the segments on one cylinder, or one cone, merged.

use nalgebra::{Point3, Vector3};

use super::facets::Facets;
use super::fit::Surface;
use super::primitive::Primitive;
use super::segment::Segmentation;
use crate::numeric::{median, tangent_basis};

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
    /// a point of the axis, m, in O: lengths along it are measured from here
    pub origin: Point3<f64>,
    /// unit vector; of a cone from the apex into it
    pub axis: Vector3<f64>,
    /// from where to where it goes along the axis, m
    pub ends: [f64; 2],
    /// share of the turn that it covers
    pub coverage: f64,
    /// share of what it is between its ends that its faces cover
    pub filled: f64,
    /// unit vector from the axis to the middle of the parts of the turn that it covers; 0 where there is none
    pub towards: Vector3<f64>,
}

/// Into so many parts a turn is divided.
const PARTS: usize = 72;
/// Axes of one wall differ by less: 6°.
const SAME_AXIS: f64 = 0.9945;
/// Radii of one wall differ by less than this share, and so do places of the axis.
const SAME_RADIUS: f64 = 0.08;
/// Pieces of a wall are no farther apart along the axis than this many radii.
const SAME_WALL: f64 = 2.0;

impl Wall {
    /// All round walls of a mesh, the largest first.
    pub fn all(facets: &Facets, segmentation: &Segmentation) -> Vec<Self> {
        let mut walls: Vec<Self> = Vec::new();
        for number in 0..segmentation.segments.len() {
            let Some(wall) = Self::of(facets, segmentation, vec![number]) else { continue };
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

    /// The wall that these segments are.
    fn of(facets: &Facets, segmentation: &Segmentation, segments: Vec<usize>) -> Option<Self> {
        let of_wall = |&number: &usize| segmentation.segments[number].faces.iter().copied();
        let faces: Vec<u32> = segments.iter().flat_map(of_wall).collect();
        Self::of_faces(facets, &segmentation.segments[segments[0]].primitive, &faces, segments)
    }

    /// The wall that these faces are; `None` for a plane.
    pub fn of_faces(facets: &Facets, primitive: &Primitive, faces: &[u32], segments: Vec<usize>) -> Option<Self> {
        let (origin, axis, radius_at_origin, half_angle, is_concave) = match primitive {
            Primitive::Plane(_) => return None,
            Primitive::Cylinder(wall) => (wall.center(), wall.axis(), wall.radius, None, wall.concave),
            Primitive::Cone(cone) => (cone.apex()?, cone.axis(), 0.0, Some(cone.half_angle), cone.concave),
        };
        let [e, g] = tangent_basis(&axis);
        let mut parts = [[f64::INFINITY, f64::NEG_INFINITY]; PARTS];
        for &face in faces {
            let corners = facets.triangle(face).map(|p| p - origin);
            let along = corners.map(|v| v.dot(&axis));
            for part in parts_between(corners.map(|v| v.dot(&g).atan2(v.dot(&e)))) {
                along.iter().for_each(|t| parts[part] = [parts[part][0].min(*t), parts[part][1].max(*t)]);
            }
        }
        let covered: Vec<_> = parts.iter().filter(|part| part[0] <= part[1]).collect();
        let coverage = covered.len() as f64 / PARTS as f64;
        // the usual end, not the farthest: walls have ears
        let ends = [0, 1].map(|end| median(&mut covered.iter().map(|part| part[end]).collect::<Vec<_>>()));
        let [Some(low), Some(high)] = ends else { return None };
        let ends = [low, high];
        let away = |part: usize| {
            let (sine, cosine) = (std::f64::consts::TAU * (part as f64 + 0.5) / PARTS as f64).sin_cos();
            e * cosine + g * sine
        };
        let is_covered = |&part: &usize| parts[part][0] <= parts[part][1];
        let towards = (0..PARTS).filter(is_covered).map(away).sum::<Vector3<f64>>();
        let towards = towards.try_normalize(f64::EPSILON * PARTS as f64).unwrap_or_default();
        let filled = 0.0;
        let mut wall =
            Self { radius_at_origin, half_angle, is_concave, segments, origin, axis, ends, coverage, filled, towards };
        let slant = wall.radius() / half_angle.unwrap_or(0.0).cos();
        let whole = std::f64::consts::TAU * slant * wall.height() * coverage;
        wall.filled = if whole > 0.0 { facets.area_of(faces) / whole } else { 0.0 };
        Some(wall)
    }

    /// Whether `other` is a piece of the same wall.
    fn goes_on_as(&self, other: &Self) -> bool {
        let is_same = match (self.half_angle, other.half_angle) {
            (None, None) => (self.radius() - other.radius()).abs() < SAME_RADIUS * self.radius(),
            (Some(a), Some(b)) => (a - b).abs() < SAME_RADIUS && (self.origin - other.origin).norm() < self.radius(),
            _ => false,
        };
        is_same
            && self.is_concave == other.is_concave
            && self.is_coaxial(other, SAME_RADIUS)
            && self.gap(other) < SAME_WALL * self.radius()
    }

    /// Whether the axes are one within a share of the radius.
    pub fn is_coaxial(&self, other: &Self, share: f64) -> bool {
        let middle = other.at(other.middle());
        let v = middle - self.origin;
        let off = (v - self.axis * v.dot(&self.axis)).norm();
        self.axis.dot(&other.axis).abs() > SAME_AXIS && off < share * self.radius().max(other.radius())
    }

    /// Distance between the walls along the axis, m; negative where they overlap.
    pub fn gap(&self, other: &Self) -> f64 {
        let along = other.ends.map(|t| (other.at(t) - self.origin).dot(&self.axis));
        let (low, high) = (along[0].min(along[1]), along[0].max(along[1]));
        (low - self.ends[1]).max(self.ends[0] - high)
    }

    /// Point of the axis, m.
    pub fn at(&self, t: f64) -> Point3<f64> {
        self.origin + self.axis * t
    }

    pub fn middle(&self) -> f64 {
        (self.ends[0] + self.ends[1]) / 2.0
    }

    pub fn height(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// m; of a cone at mid-height.
    pub fn radius(&self) -> f64 {
        self.radius_at(self.middle())
    }

    /// m
    pub fn radius_at(&self, t: f64) -> f64 {
        self.radius_at_origin + self.half_angle.map_or(0.0, |angle| t * angle.tan())
    }

    pub fn is_cone(&self) -> bool {
        self.half_angle.is_some()
    }
}

/// The parts of a turn between the corners of a face.
fn parts_between(angles: [f64; 3]) -> impl Iterator<Item = usize> {
    use std::f64::consts::{PI, TAU};
    let from = angles[0];
    let turned = angles.map(|angle| (angle - from + PI).rem_euclid(TAU) - PI);
    let low = turned.iter().copied().fold(0.0, f64::min) + from;
    let high = turned.iter().copied().fold(0.0, f64::max) + from;
    let size = TAU / PARTS as f64;
    let (first, last) = ((low / size).floor() as i64, (high / size).ceil() as i64);
    (first..last).map(|at| at.rem_euclid(PARTS as i64) as usize)
}
