//! Areas of loops on their surface.

use std::f64::consts::{PI, TAU};

use nalgebra::Point3;

use super::surface::{AnalyticSurface, SurfaceShape};

/// Area on the left of a loop, m², and the angle by which it turns about the axis. On a cylinder or
/// cone the area counts from the circle at the origin on.
pub fn area_and_turn(surface: &AnalyticSurface, points: &[Point3<f64>]) -> (f64, f64) {
    let is_plane = surface.shape == SurfaceShape::Plane;
    let local: Vec<_> = points.iter().map(|p| surface.placement.local(p)).collect();
    let (mut area, mut turn) = (0.0, 0.0);
    for pair in local.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let step = to.y.atan2(to.x) - from.y.atan2(from.x);
        let step = (step + PI).rem_euclid(TAU) - PI;
        turn += step;
        area += if is_plane {
            (from - local[0]).xy().perp(&(to - local[0]).xy()) / 2.0
        } else {
            let radius = (from.xy().norm() + to.xy().norm()) / 2.0;
            -step * radius * (from.z + to.z) / 2.0
        };
    }
    (area, turn)
}

/// Whether loops enclose a part of their surface, on its left: on a plane each loop by itself, on a
/// cylinder all of them. On a cone one loop may have a part on both of its sides, and any is
/// accepted.
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
    }
}
