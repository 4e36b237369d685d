//! Common points of lines and circles in a plane.

use nalgebra::Vector2;

use super::placement::COINCIDENT;

/// Common points of a line, its direction of length 1, and a circle: one at a tangency.
pub(super) fn line_and_circle(
    point: &Vector2<f64>,
    direction: &Vector2<f64>,
    centre: &Vector2<f64>,
    radius: f64,
) -> Vec<Vector2<f64>> {
    let foot = point + direction * (centre - point).dot(direction);
    let off = (foot - centre).norm();
    if (off - radius).abs() <= COINCIDENT * radius {
        return vec![foot];
    }
    let half = ((radius - off) * (radius + off)).max(0.0).sqrt();
    let ends = [foot - direction * half, foot + direction * half];
    if half > 0.0 { ends.into() } else { Vec::new() }
}

/// Common points of two circles: one at a tangency, none of concentric ones.
pub(super) fn circles(
    centre: &Vector2<f64>,
    radius: f64,
    other: &Vector2<f64>,
    other_radius: f64,
) -> Vec<Vector2<f64>> {
    let apart = (other - centre).norm();
    if apart <= COINCIDENT * radius.max(other_radius) {
        return Vec::new();
    }
    // on the line of equal power, square to the line of centres
    let along = (apart + (radius - other_radius) * (radius + other_radius) / apart) / 2.0;
    let unit = (other - centre) / apart;
    let square = Vector2::new(-unit.y, unit.x);
    line_and_circle(&(centre + unit * along), &square, centre, radius)
}
