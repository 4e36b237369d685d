//! Areas of loops on their surface.

use std::f64::consts::{PI, TAU};

use nalgebra::Point3;

use super::surface::{AnalyticSurface, SurfaceShape};

/// Area on the left of a loop, m², and the angle by which it turns about the axis. On a cylinder or
/// cone the area counts from the circle at the origin on, on a sphere from its pole on the axis on.
pub fn area_and_turn(surface: &AnalyticSurface, points: &[Point3<f64>]) -> (f64, f64) {
    let local: Vec<_> = points.iter().map(|p| surface.placement.local(p)).collect();
    let (mut area, mut turn) = (0.0, 0.0);
    for pair in local.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let step = to.y.atan2(to.x) - from.y.atan2(from.x);
        let step = (step + PI).rem_euclid(TAU) - PI;
        turn += step;
        let height = (from.z + to.z) / 2.0;
        area += match surface.shape {
            SurfaceShape::Plane => (from - local[0]).xy().perp(&(to - local[0]).xy()) / 2.0,
            SurfaceShape::Sphere { radius } => step * radius * (radius - height),
            _ => -step * (from.xy().norm() + to.xy().norm()) / 2.0 * height,
        };
    }
    (area, turn)
}

/// Whether loops enclose a part of their surface, on its left: on a plane each loop by itself, on a
/// cylinder all of them. On a cone or sphere one loop may have a part on both of its sides, and any
/// is accepted.
///
/// - `loops`: points of each, seen from the outward side of the surface.
pub(super) fn encloses(surface: &AnalyticSurface, loops: &[Vec<Point3<f64>>]) -> bool {
    if loops.iter().any(Vec::is_empty) {
        return false;
    }
    let mut each = loops.iter().map(|points| area_and_turn(surface, points));
    match surface.shape {
        SurfaceShape::Plane => {
            each.next().is_some_and(|(outer, _)| outer > 0.0) && each.all(|(hole, _)| hole < 0.0)
        }
        SurfaceShape::Cylinder { .. } => {
            let (area, turn) = each.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
            // whole turns apart from roundings
            area > 0.0 && turn.abs() < PI
        }
        SurfaceShape::Cone { .. } => !loops.is_empty(),
        // a whole one has none
        SurfaceShape::Sphere { .. } => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// A cap of height h has 2 π r h; run backwards, the rest is on the left.
    #[test]
    fn a_circle_on_a_sphere_has_its_cap_on_the_left() {
        let (radius, height) = (0.013, 0.005);
        let shape = SurfaceShape::Sphere { radius };
        let ball = AnalyticSurface::along(Point3::origin(), Vector3::z(), shape);
        let place = |i: u32| {
            let (sin, cos) = (TAU * f64::from(i) / 64.0).sin_cos();
            ball.placement.place(0.012 * cos, 0.012 * sin, height)
        };
        let mut points: Vec<_> = (0..=64).map(place).collect();
        let cap = TAU * radius * (radius - height);
        let (area, turn) = area_and_turn(&ball, &points);
        assert!((area - cap).abs() < 1e-15 && (turn - TAU).abs() < 1e-12);
        points.reverse();
        assert!((area_and_turn(&ball, &points).0 + cap).abs() < 1e-15);
    }
}
