//! The circle through what was felt of a round wall.

use nalgebra::{Point3, Vector3};

use crate::numeric::{NormalEquations, mean};

/// Middle and radius of the circle through points of a plane, by least squares of x² + y² = 2ax + 2by + c \[Kåsa 1976\].
pub(super) fn circle(points: &[Point3<f64>]) -> Option<(Point3<f64>, f64)> {
    let mean = mean(points.iter().map(|p| p.coords));
    let row = |p: &Point3<f64>| {
        let (x, y) = (p.x - mean.x, p.y - mean.y);
        (Vector3::new(2.0 * x, 2.0 * y, 1.0), x * x + y * y)
    };
    let solved = NormalEquations::of(points.iter().map(row)).solution()?;
    let radius = (solved.z + solved.x * solved.x + solved.y * solved.y).sqrt();
    let centre = Point3::new(mean.x + solved.x, mean.y + solved.y, 0.0);
    (radius.is_finite() && points.len() >= 3).then_some((centre, radius))
}
