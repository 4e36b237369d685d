//! Evidence seen along an axis.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::evidence::SegmentEvidence;
use crate::features::fit::SurfaceModel;
use crate::features::segmentation::primitive::Primitive;
use crate::features::walls::Wall;
use touchup_geometry::numeric::tangent_basis;

/// Maximum components of an end's axis, and of a flat end's normal, aslant to the axis: 12° and 9°.
const END_AXIS: f64 = 0.978;
const END_NORMAL: f64 = 0.15;

/// Evidence seen along an axis.
pub(super) struct AxisView<'a> {
    pub evidence: &'a SegmentEvidence<'a>,
    /// segment of each face, seams included
    pub of_face: &'a [u32],
    pub axis: Vector3<f64>,
    /// of the plane square to it
    pub basis: [Vector3<f64>; 2],
    /// numbers of the segments that may end a void
    pub closers: Vec<usize>,
}

impl<'a> AxisView<'a> {
    pub(super) fn along(
        axis: Vector3<f64>,
        evidence: &'a SegmentEvidence<'a>,
        of_face: &'a [u32],
    ) -> Self {
        let segments = &evidence.parted.segmentation.segments;
        let is_closer = |at: &usize| match &segments[*at].primitive {
            Primitive::Cylinder(end) => end.concave && end.axis().dot(&axis).abs() > END_AXIS,
            Primitive::Plane(end) => end.normal().dot(&axis).abs() <= END_NORMAL,
            Primitive::Cone(_) | Primitive::Sphere(_) => false,
        };
        Self {
            evidence,
            of_face,
            axis,
            basis: tangent_basis(&axis),
            closers: (0..segments.len()).filter(is_closer).collect(),
        }
    }

    pub(super) fn in_space(&self, v: &Vector2<f64>) -> Vector3<f64> {
        self.basis[0] * v.x + self.basis[1] * v.y
    }

    pub(super) fn flat(&self, v: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(v.dot(&self.basis[0]), v.dot(&self.basis[1]))
    }

    pub(super) fn at(&self, place: &Point2<f64>, height: f64) -> Point3<f64> {
        Point3::from(self.in_space(&place.coords) + self.axis * height)
    }

    /// Range of a round wall along the axis, m.
    pub(super) fn heights(&self, wall: &Wall) -> [f64; 2] {
        in_order(wall.ends.map(|t| wall.at(t).coords.dot(&self.axis)))
    }
}

/// The lower and the higher of two.
pub(super) fn in_order([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}
