//! Surfaces of revolution about one axis: lines, and the half circle of a sphere, meet in points of
//! the half-plane of radius and height, which are circles in space.

use nalgebra::{Point3, Vector2};

use super::circles::{circles, line_and_circle};
use super::curve::SpaceCurve;
use super::placement::{AxisPlacement, COINCIDENT, PARALLEL};
use super::surface::{AnalyticSurface, SurfaceShape};

/// Line of a surface in the half-plane: x the distance from the axis, y the height along it.
struct Meridian {
    point: Vector2<f64>,
    direction: Vector2<f64>,
}

impl Meridian {
    /// Of a surface of revolution about `axis`; `None` of a sphere.
    fn of(surface: &AnalyticSurface, axis: &AxisPlacement) -> Option<Self> {
        let up = surface.placement.axis.dot(&axis.axis).signum();
        let (x, direction) = match surface.shape {
            SurfaceShape::Plane => (0.0, Vector2::x()),
            SurfaceShape::Cylinder { radius } => (radius, Vector2::y()),
            SurfaceShape::Cone { radius, half_angle } => {
                let (sin, cos) = half_angle.sin_cos();
                (radius, Vector2::new(sin, up * cos))
            }
            SurfaceShape::Sphere { .. } => return None,
        };
        let height = axis.local(&surface.placement.origin).z;
        Some(Self {
            point: Vector2::new(x, height),
            direction,
        })
    }

    /// The common point; `None` of parallel lines.
    fn meeting(&self, other: &Self) -> Option<Vector2<f64>> {
        let across = self.direction.perp(&other.direction);
        let along = (other.point - self.point).perp(&other.direction) / across;
        (across.abs() > PARALLEL).then(|| self.point + self.direction * along)
    }

    /// The common points with a sphere about a point of the axis.
    fn meeting_sphere(&self, height: f64, radius: f64) -> Vec<Vector2<f64>> {
        line_and_circle(
            &self.point,
            &self.direction,
            &Vector2::new(0.0, height),
            radius,
        )
    }
}

/// The common circles, if any, of two surfaces of revolution about one axis; `None` of others.
///
/// A plane and a sphere, and two spheres, always have one.
pub(super) fn coaxial(a: &AnalyticSurface, b: &AnalyticSurface) -> Option<Vec<SpaceCurve>> {
    use SurfaceShape::{Plane, Sphere};
    let (centre, other) = (a.placement.origin, b.placement.origin);
    let axis = match (a.shape, b.shape) {
        (Plane, Plane) => return None,
        (Plane, Sphere { .. }) => AxisPlacement::along(other, a.placement.axis),
        (Sphere { .. }, Plane) => AxisPlacement::along(centre, b.placement.axis),
        // concentric ones have no common circle
        (Sphere { .. }, Sphere { .. }) if centre == other => return Some(Vec::new()),
        (Sphere { .. }, Sphere { .. }) => AxisPlacement::along(centre, other - centre),
        (Plane | Sphere { .. }, _) => b.placement,
        _ => a.placement,
    };
    let small = COINCIDENT * a.size().max(b.size());
    let turns = |surface: &AnalyticSurface| {
        let is_parallel = surface.placement.axis.cross(&axis.axis).norm() <= PARALLEL;
        let off = axis.local(&surface.placement.origin).xy().norm();
        match surface.shape {
            Plane => is_parallel,
            Sphere { .. } => off <= small,
            _ => is_parallel && off <= small,
        }
    };
    if !turns(a) || !turns(b) {
        return None;
    }
    let height = |surface: &AnalyticSurface| axis.local(&surface.placement.origin).z;
    let points = match (a.shape, b.shape) {
        (Sphere { radius: r }, Sphere { radius: s }) => {
            let on_axis = |surface| Vector2::new(0.0, height(surface));
            circles(&on_axis(a), r, &on_axis(b), s)
        }
        (_, Sphere { radius }) => Meridian::of(a, &axis)?.meeting_sphere(height(b), radius),
        (Sphere { radius }, _) => Meridian::of(b, &axis)?.meeting_sphere(height(a), radius),
        _ => {
            let point = Meridian::of(a, &axis)?.meeting(&Meridian::of(b, &axis)?);
            point.into_iter().collect()
        }
    };
    // a point on the axis is no curve; one beyond it belongs to the other nappe
    let points = points.into_iter().filter(|point| point.x > small);
    let circle = |point: Vector2<f64>| SpaceCurve::Circle {
        placement: AxisPlacement {
            origin: Point3::from(axis.origin + axis.axis * point.y),
            ..axis
        },
        radius: point.x,
    };
    Some(points.map(circle).collect())
}
