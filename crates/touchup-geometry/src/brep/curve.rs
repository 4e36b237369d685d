//! Curves in space.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::placement::{AxisPlacement, is_finite};
use super::spline::{self, CurveNode};

/// Curve with a direction; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum SpaceCurve {
    /// endless
    Line {
        /// a point on it
        origin: Point3<f64>,
        /// unit vector
        direction: Vector3<f64>,
    },
    /// counter-clockwise about the axis of its placement
    Circle {
        /// its centre and plane
        placement: AxisPlacement,
        /// positive
        radius: f64,
    },
    /// counter-clockwise about the axis of its placement, longest along the reference
    Ellipse {
        /// its centre and plane
        placement: AxisPlacement,
        /// longer half axis
        major: f64,
        /// shorter half axis
        minor: f64,
    },
    /// general; closed if the last node is the first
    Spline(Vec<CurveNode>),
}

/// Points of a conic between its ends, for checks: 5.6° apart on a full one.
const CONIC_POINTS: usize = 64;

impl SpaceCurve {
    /// Parameter near a point: length on a line, eccentric angle on a conic, node on a spline.
    fn parameter(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Line { origin, direction } => (p - origin).dot(direction),
            Self::Circle { placement, .. } => {
                let at = placement.local(p);
                at.y.atan2(at.x)
            }
            Self::Ellipse {
                placement,
                major,
                minor,
            } => {
                let at = placement.local(p);
                (at.y / minor).atan2(at.x / major)
            }
            Self::Spline(nodes) => spline::parameter(nodes, p),
        }
    }

    fn point(&self, t: f64) -> Point3<f64> {
        match self {
            Self::Line { origin, direction } => origin + direction * t,
            Self::Circle { placement, radius } => {
                placement.place(radius * t.cos(), radius * t.sin(), 0.0)
            }
            Self::Ellipse {
                placement,
                major,
                minor,
            } => placement.place(major * t.cos(), minor * t.sin(), 0.0),
            Self::Spline(nodes) => spline::evaluate(nodes, t).0,
        }
    }

    /// Direction at the place near a point, not of unit length.
    pub fn tangent(&self, p: &Point3<f64>) -> Vector3<f64> {
        let t = self.parameter(p);
        let about = |placement: &AxisPlacement, x: f64, y: f64| {
            placement.reference * (-x * t.sin()) + placement.second() * (y * t.cos())
        };
        match self {
            Self::Line { direction, .. } => *direction,
            Self::Circle { placement, radius } => about(placement, *radius, *radius),
            Self::Ellipse {
                placement,
                major,
                minor,
            } => about(placement, *major, *minor),
            Self::Spline(nodes) => spline::evaluate(nodes, t).1,
        }
    }

    /// Where a closed one begins; any point of a line.
    pub fn begin(&self) -> Point3<f64> {
        self.point(0.0)
    }

    /// Distance of a point from the curve, m; off an ellipse an upper bound.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        (self.point(self.parameter(p)) - p).norm()
    }

    /// The curve of an edge between two points: a line turned towards the second, a spline cut off
    /// at both.
    #[must_use]
    pub fn trimmed(&self, from: &Point3<f64>, to: &Point3<f64>) -> Self {
        match self {
            Self::Line { origin, direction } if (to - from).dot(direction) < 0.0 => Self::Line {
                origin: *origin,
                direction: -direction,
            },
            Self::Spline(nodes) => Self::Spline(spline::clipped(nodes, from, to)),
            other => other.clone(),
        }
    }

    /// Points from one end of an edge to the other, both included, along the curve.
    pub fn points(&self, from: &Point3<f64>, to: &Point3<f64>) -> Vec<Point3<f64>> {
        let (begin, end, steps) = match self {
            Self::Line { .. } => (self.parameter(from), self.parameter(to), 4),
            Self::Spline(nodes) => {
                let last = nodes.len().saturating_sub(1);
                (0.0, last as f64, 4 * last)
            }
            Self::Circle { .. } | Self::Ellipse { .. } => {
                let (begin, end) = (self.parameter(from), self.parameter(to));
                let turn = if end <= begin { TAU } else { 0.0 };
                (begin, end + turn, CONIC_POINTS)
            }
        };
        let at = |step: usize| begin + (end - begin) * step as f64 / steps as f64;
        (0..=steps).map(|step| self.point(at(step))).collect()
    }

    /// Whether an edge on it may end where it begins.
    pub(super) fn may_close(&self) -> bool {
        !matches!(self, Self::Line { .. })
    }

    /// Whether its numbers are finite, unit vectors are, and sizes are positive.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Line { origin, direction } => {
                is_finite(origin) && (direction.norm() - 1.0).abs() < 1e-9
            }
            Self::Circle { placement, radius } => {
                placement.is_sound() && *radius > 0.0 && radius.is_finite()
            }
            Self::Ellipse {
                placement,
                major,
                minor,
            } => placement.is_sound() && *minor > 0.0 && minor <= major && major.is_finite(),
            Self::Spline(nodes) => spline::is_sound(nodes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_runs_counter_clockwise_from_its_first_vertex() {
        let placement = AxisPlacement {
            origin: Point3::origin(),
            axis: Vector3::z(),
            reference: Vector3::x(),
        };
        let ellipse = SpaceCurve::Ellipse {
            placement,
            major: 2.0,
            minor: 1.0,
        };
        let [right, top] = [Point3::new(2.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let length = |points: Vec<Point3<f64>>| -> f64 {
            points
                .windows(2)
                .map(|pair| (pair[1] - pair[0]).norm())
                .sum()
        };
        // circumference by Ramanujan's series
        let all = 9.688_448_220_547_68;
        for (from, to, share) in [(right, top, 0.25), (top, right, 0.75), (top, top, 1.0)] {
            let found = length(ellipse.points(&from, &to));
            assert!((found - share * all).abs() < 5e-3, "{share}: {found}");
        }
        assert!((ellipse.distance(&Point3::new(2.5, 0.0, 0.0)) - 0.5).abs() < 1e-15);
        // at the eccentric angle 0.3, by the derivative
        let (sin, cos) = 0.3f64.sin_cos();
        let tangent = ellipse.tangent(&Point3::new(2.0 * cos, sin, 0.0));
        assert!((tangent - Vector3::new(-2.0 * sin, cos, 0.0)).norm() < 1e-15);
    }
}
