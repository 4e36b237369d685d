//! Surfaces of revolution about one axis: lines in the half-plane of radius and height meet in a
//! point, which is a circle in space.

use nalgebra::{Point3, Vector2};

use super::curve::SpaceCurve;
use super::placement::{AxisPlacement, COINCIDENT, PARALLEL};
use super::surface::{AnalyticSurface, SurfaceShape};

/// Line of a surface in the half-plane: x the distance from the axis, y the height along it.
struct Meridian {
    point: Vector2<f64>,
    direction: Vector2<f64>,
}

impl Meridian {
    /// Of a surface of revolution about `axis`.
    fn of(surface: &AnalyticSurface, axis: &AxisPlacement) -> Self {
        let up = surface.placement.axis.dot(&axis.axis).signum();
        let (x, direction) = match surface.shape {
            SurfaceShape::Plane => (0.0, Vector2::x()),
            SurfaceShape::Cylinder { radius } => (radius, Vector2::y()),
            SurfaceShape::Cone { radius, half_angle } => {
                let (sin, cos) = half_angle.sin_cos();
                (radius, Vector2::new(sin, up * cos))
            }
        };
        let height = axis.local(&surface.placement.origin).z;
        Self {
            point: Vector2::new(x, height),
            direction,
        }
    }

    /// The common point; `None` of parallel lines.
    fn meeting(&self, other: &Self) -> Option<Vector2<f64>> {
        let across = self.direction.perp(&other.direction);
        let along = (other.point - self.point).perp(&other.direction) / across;
        (across.abs() > PARALLEL).then(|| self.point + self.direction * along)
    }
}

/// The common circle, if any, of two surfaces of revolution about one axis; `None` of others.
pub(super) fn coaxial(a: &AnalyticSurface, b: &AnalyticSurface) -> Option<Vec<SpaceCurve>> {
    let axis = match (a.shape, b.shape) {
        (SurfaceShape::Plane, SurfaceShape::Plane) => return None,
        (SurfaceShape::Plane, _) => b.placement,
        _ => a.placement,
    };
    let small = COINCIDENT * a.size().max(b.size());
    let turns = |surface: &AnalyticSurface| {
        let is_parallel = surface.placement.axis.cross(&axis.axis).norm() <= PARALLEL;
        let off = axis.local(&surface.placement.origin).xy().norm();
        is_parallel && (surface.shape == SurfaceShape::Plane || off <= small)
    };
    if !turns(a) || !turns(b) {
        return None;
    }
    let point = Meridian::of(a, &axis).meeting(&Meridian::of(b, &axis));
    // a point on the axis is no curve; one beyond it belongs to the other nappe
    let point = point.filter(|point| point.x > small);
    let circle = |point: Vector2<f64>| SpaceCurve::Circle {
        placement: AxisPlacement {
            origin: Point3::from(axis.origin + axis.axis * point.y),
            ..axis
        },
        radius: point.x,
    };
    Some(point.map(circle).into_iter().collect())
}
