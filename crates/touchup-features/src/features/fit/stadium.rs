//! The slot and its counterpart, the oblong boss: two parallel walls with half-round or flat ends.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::surface::{AXIS, check_size, pose_along, side};
use super::{Distance, FREEDOMS, Fit, FitError, Freedom, SurfaceModel};
use touchup_geometry::numeric::mean;

/// Minimum share of the normal along the slot for a touch to determine an end: 30° from the wall.
const LEAST_ALONG: f64 = 0.5;
/// Minimum number of touches that determine an end; one may be an outlier.
const LEAST_TOUCHES: usize = 2;

/// Distance of (x, y) from the segment from (−half, 0) to (half, 0), m, and the unit vector away
/// from it; y on the segment itself, as both sides will do.
pub fn from_segment(x: f64, y: f64, half: f64) -> (f64, [f64; 2]) {
    let beyond = (x.abs() - half).max(0.0).copysign(x);
    let rho = beyond.hypot(y);
    (
        rho,
        if rho > 0.0 {
            [beyond / rho, y / rho]
        } else {
            [0.0, 1.0]
        },
    )
}

/// Shape of the ends of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Half circles as wide as the slot.
    Round,
    /// Walls across.
    Straight,
}

/// A prism over a stadium or a rectangle, without top and bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stadium {
    /// Frame F in O: the origin is the centre, z the direction of the walls' lines (out of the
    /// part), x along the slot.
    pub pose_of: Isometry3<f64>,
    /// From wall to wall, m.
    pub width: f64,
    /// From end to end, over all, m; not less than the width with round ends. If a fit leaves it
    /// undetermined, no end lies within it, and [`super::Fit::std`] has no figure of it.
    pub length: f64,
    /// Shape of the ends.
    pub ends: Ends,
    /// Whether the air is inside (a slot) and not the material.
    pub concave: bool,
}

impl Stadium {
    /// From its centre, axis (any length but 0), direction along the slot (not parallel to the
    /// axis) and sizes.
    pub fn new(
        center: Point3<f64>,
        axis: &Vector3<f64>,
        along: &Vector3<f64>,
        [width, length]: [f64; 2],
        ends: Ends,
        concave: bool,
    ) -> Self {
        let upright = pose_along(center, axis);
        let x = upright.inverse_transform_vector(along);
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), x.y.atan2(x.x));
        Self {
            pose_of: upright * turn,
            width,
            length,
            ends,
            concave,
        }
    }

    /// Unit vector along the slot, in O.
    pub fn direction(&self) -> Vector3<f64> {
        self.pose_of.rotation * Vector3::x()
    }

    /// Position along x of the end in direction `sign`; an untouched end goes beyond all points,
    /// for otherwise the last touches of the walls, with their noise, would decide its position.
    fn end_beyond(&self, points: &[Vector3<f64>], sign: f64) -> f64 {
        let faces_end = |q: &&Vector3<f64>| {
            q.x * sign > 0.0 && self.distance_at(q).normal.x.abs() > LEAST_ALONG
        };
        if points.iter().filter(faces_end).count() >= LEAST_TOUCHES {
            return sign * self.length / 2.0;
        }
        let farthest = points
            .iter()
            .map(|q| sign * q.x)
            .fold(self.length / 2.0, f64::max);
        sign * (farthest + self.width)
    }

    /// Distance outside the outline, its normal, and its derivatives by width and length.
    ///
    /// Round: all points half a width from a segment as long as length − width.
    fn round_outline(&self, q: &Vector3<f64>) -> (f64, [f64; 2], [f64; 2]) {
        let half_segment = (self.length - self.width).max(0.0) / 2.0;
        let (rho, normal) = from_segment(q.x, q.y, half_segment);
        let along = normal[0].abs() / 2.0;
        (rho - self.width / 2.0, normal, [along - 0.5, -along])
    }

    /// As for round ends, for the rectangle: outside, the distance rounds off its corners.
    fn straight_outline(&self, q: &Vector3<f64>) -> (f64, [f64; 2], [f64; 2]) {
        let (dx, dy) = (q.x.abs() - self.length / 2.0, q.y.abs() - self.width / 2.0);
        let (value, [x, y]) = match (dx > 0.0 && dy > 0.0, dx > dy) {
            (true, _) => (dx.hypot(dy), [dx, dy].map(|d| d / dx.hypot(dy))),
            (false, true) => (dx, [1.0, 0.0]),
            (false, false) => (dy, [0.0, 1.0]),
        };
        (
            value,
            [x.copysign(q.x), y.copysign(q.y)],
            [-y / 2.0, -x / 2.0],
        )
    }
}

impl SurfaceModel for Stadium {
    const NAMES: [Option<&'static str>; FREEDOMS] = [
        Some("centre along the slot"),
        Some("centre across the slot"),
        None,
        AXIS,
        AXIS,
        Some("direction of the slot"),
        Some("width"),
        Some("length"),
    ];
    const NEEDED: [bool; 8] = [false; 8];
    const SECOND_IS_LENGTH: bool = true;

    fn pose_of(&self) -> &Isometry3<f64> {
        &self.pose_of
    }

    fn distance_at(&self, q: &Vector3<f64>) -> Distance {
        let (value, normal, by_size) = match self.ends {
            Ends::Round => self.round_outline(q),
            Ends::Straight => self.straight_outline(q),
        };
        let s = side(self.concave);
        let normal = Vector3::new(s * normal[0], s * normal[1], 0.0);
        Distance {
            value: s * value,
            normal,
            by_size: by_size.map(|d| s * d),
        }
    }

    fn with(&self, pose_of: Isometry3<f64>, by: [f64; 2]) -> Self {
        let width = self.width + by[0];
        let shortest = if self.ends == Ends::Round { width } else { 0.0 };
        Self {
            pose_of,
            width,
            length: (self.length + by[1]).max(shortest),
            ..*self
        }
    }

    fn described_from(&self, points: &[Vector3<f64>]) -> Self {
        let q = mean(points.iter().copied());
        let [low, high] = [-1.0, 1.0].map(|sign| self.end_beyond(points, sign));
        let pose_of = self.pose_of * Translation3::new((low + high) / 2.0, 0.0, q.z);
        Self {
            pose_of,
            length: high - low,
            ..*self
        }
    }

    fn check(&self) -> Result<(), FitError> {
        check_size("width", self.width)?;
        check_size("length", self.length)
    }
}

impl Fit<Stadium> {
    /// Uncertainty of the middle, across and along the slot, m; `None`: the ends do not determine
    /// its position along.
    pub(crate) fn middle_std(&self) -> Option<f64> {
        Some(self.std(Freedom::Y)?.hypot(self.std(Freedom::X)?))
    }
}
