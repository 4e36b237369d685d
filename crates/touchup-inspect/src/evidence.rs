//! The touches behind a characteristic: distance of each from the ideal surface.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use touchup_features::features::InspectedQuantity;
use touchup_geometry::numeric::NormalEquations;
use touchup_io::features_file::FeatureRecord;
use touchup_io::probed_touches_file::TouchLine;
use touchup_method::stylus::ProbedPoint;

/// Most touches in a plot; a larger number is thinned evenly.
const MOST_DRAWN: usize = 300;

/// Cosine of 45°: a normal nearer to the axis belongs to a floor, any other to a wall.
const HALF_WAY: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Coordinate of touches without one on their surface.
const IN_TIME: &str = "touch, in order of time";

/// Touches on a surface.
pub(super) struct TouchEvidence {
    /// reference of the distances
    pub ideal: &'static str,
    /// coordinate that orders the touches
    pub along: &'static str,
    /// plotted touches: coordinate, and distance from the ideal surface in mm
    pub drawn: Vec<[f64; 2]>,
    pub count: usize,
    /// root mean square of all distances, mm
    pub rms_mm: f64,
    /// largest distance, mm
    pub largest_mm: f64,
    /// stated noise of a single touch, root mean square, mm
    pub stated_mm: f64,
}

/// Distances of the touches behind a quantity from their fitted surface; `None` if the file lacks
/// that surface.
pub(super) fn touch_evidence(
    quantity: InspectedQuantity,
    feature: &FeatureRecord,
    runs: &[[u32; 2]],
    touches: &[ProbedPoint],
) -> Option<TouchEvidence> {
    let centre = Point3::from(feature.center_mm?);
    let axis = Vector3::from(feature.axis?);
    let numbers = runs.iter().flat_map(|[first, last]| *first..=*last);
    let mut all: Vec<&ProbedPoint> = numbers
        .map(|number| touches.get(number as usize))
        .collect::<Option<_>>()?;
    // keeps the touches on the quantity's own surface: walls lie along the axis, floors and planes
    // across it
    let is_flat = quantity == InspectedQuantity::Depth || feature.kind == "plane";
    all.retain(|touch| (touch.normal.dot(&axis).abs() > HALF_WAY) == is_flat);
    if all.is_empty() {
        return None;
    }
    let seats: Vec<_> = all.iter().map(|touch| touch.point * 1e3 - centre).collect();
    let (ideal, along, places) = match (quantity, feature.diameter_mm, feature.width_mm) {
        (InspectedQuantity::Depth, ..) => {
            let depth = feature.depth_mm?;
            let level = if matches!(&*feature.kind, "boss" | "cylinder") {
                depth
            } else {
                -depth
            };
            let offs = off_two_planes(&seats, &axis, level);
            ("a plane at either end", IN_TIME, numbered(offs))
        }
        (_, Some(diameter), _) => {
            let places = off_cylinder(&seats, &axis, diameter);
            ("the fitted cylinder", "angle about the axis, °", places)
        }
        (_, None, Some(width)) => {
            let places = off_walls(&seats, &axis, width, feature)?;
            ("the fitted walls", "along the slot, mm", places)
        }
        _ if feature.kind == "plane" => {
            let offs = seats.iter().map(|seat| seat.dot(&axis));
            ("the fitted plane", IN_TIME, numbered(offs))
        }
        _ => return None,
    };
    let mean_square = |values: &mut dyn Iterator<Item = f64>| {
        values.map(|x| x * x).sum::<f64>() / all.len() as f64
    };
    Some(TouchEvidence {
        ideal,
        along,
        count: all.len(),
        rms_mm: mean_square(&mut places.iter().map(|[_, off]| *off)).sqrt(),
        largest_mm: places.iter().map(|[_, off]| off.abs()).fold(0.0, f64::max),
        stated_mm: mean_square(&mut all.iter().map(|touch| touch.sigma * 1e3)).sqrt(),
        drawn: places
            .iter()
            .step_by(places.len().div_ceil(MOST_DRAWN))
            .copied()
            .collect(),
    })
}

/// Distances after their numbers in order of time.
fn numbered(offs: impl IntoIterator<Item = f64>) -> Vec<[f64; 2]> {
    let offs = offs.into_iter().enumerate();
    offs.map(|(at, off)| [at as f64, off]).collect()
}

/// Angle of each point about the axis, degrees, and its distance from a cylinder, mm.
fn off_cylinder(seats: &[Vector3<f64>], axis: &Vector3<f64>, diameter: f64) -> Vec<[f64; 2]> {
    let [u, v] = across(axis);
    let place = |seat: &Vector3<f64>| {
        let [x, y] = [seat.dot(&u), seat.dot(&v)];
        [y.atan2(x).to_degrees(), x.hypot(y) - diameter / 2.0]
    };
    seats.iter().map(place).collect()
}

/// Place of each point along a slot, pocket or notch, and its distance from the nearest wall, mm;
/// `None` if the file lacks length or direction.
fn off_walls(
    seats: &[Vector3<f64>],
    axis: &Vector3<f64>,
    width: f64,
    feature: &FeatureRecord,
) -> Option<Vec<[f64; 2]>> {
    let length = feature.length_mm?;
    let u = Vector3::from(feature.direction?);
    let v = axis.cross(&u);
    let place = |seat: &Vector3<f64>| {
        let [x, y] = [seat.dot(&u), seat.dot(&v)];
        if feature.kind == "slot" {
            let round = x - x.clamp(-(length - width) / 2.0, (length - width) / 2.0);
            return [x, round.hypot(y) - width / 2.0];
        }
        let (side, end) = (y.abs() - width / 2.0, x.abs() - length / 2.0);
        [x, if side.abs() < end.abs() { side } else { end }]
    };
    Some(seats.iter().map(place).collect())
}

/// Distance of each point along the axis from the least-squares plane through the points of its
/// end, mm.
///
/// - `level`: height of the other end along the axis.
fn off_two_planes(seats: &[Vector3<f64>], axis: &Vector3<f64>, level: f64) -> Vec<f64> {
    let [u, v] = across(axis);
    let is_far = |seat: &Vector3<f64>| seat.dot(axis).abs() > (seat.dot(axis) - level).abs();
    let row = |seat: &Vector3<f64>| Vector3::new(1.0, seat.dot(&u), seat.dot(&v));
    let plane = |far: bool| {
        let of_end = seats.iter().filter(|seat| is_far(seat) == far);
        let sums = NormalEquations::of(of_end.map(|seat| (row(seat), seat.dot(axis))));
        // fewer than three points, or collinear ones, have their mean height
        let mean = Vector3::new(sums.right.x / sums.information.m11.max(1.0), 0.0, 0.0);
        sums.solution().unwrap_or(mean)
    };
    let planes = [plane(false), plane(true)];
    seats
        .iter()
        .map(|seat| seat.dot(axis) - row(seat).dot(&planes[usize::from(is_far(seat))]))
        .collect()
}

/// Two directions across an axis.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let other = if axis.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = (other - axis * axis.dot(&other)).normalize();
    [u, axis.cross(&u)]
}

/// Touches of an arm whose time spans hold the recorded touches behind a characteristic.
pub(super) fn probed_behind<'a>(
    probed: &'a [TouchLine],
    runs: &[[u32; 2]],
    touches: &[ProbedPoint],
) -> Vec<&'a TouchLine> {
    let stamps: Vec<i64> = runs
        .iter()
        .flat_map(|[first, last]| *first..=*last)
        .filter_map(|number| touches.get(number as usize).map(|touch| touch.stamp_ns))
        .collect();
    let is_behind = |touch: &&TouchLine| {
        touch
            .begun_ns
            .zip(touch.ended_ns)
            .is_some_and(|(begun, ended)| {
                stamps.iter().any(|stamp| (begun..=ended).contains(stamp))
            })
    };
    probed.iter().filter(is_behind).collect()
}

/// Widest gap between touches around a round wall, degrees.
pub(super) fn widest_gap_deg(angles_deg: &[[f64; 2]]) -> f64 {
    let mut angles: Vec<f64> = angles_deg
        .iter()
        .map(|[angle, _]| angle.to_radians())
        .collect();
    angles.sort_by(f64::total_cmp);
    let Some((first, last)) = angles.first().zip(angles.last()) else {
        return 360.0;
    };
    let wrapped = first + 2.0 * PI - last;
    angles
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(wrapped, f64::max)
        .to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch(x_mm: f64, y_mm: f64, z_mm: f64) -> ProbedPoint {
        touch_on(x_mm, y_mm, z_mm, Vector3::z())
    }

    fn touch_on(x_mm: f64, y_mm: f64, z_mm: f64, normal: Vector3<f64>) -> ProbedPoint {
        let point = Point3::new(x_mm, y_mm, z_mm) * 1e-3;
        ProbedPoint {
            stamp_ns: 0,
            stroke: 0,
            centre: point,
            radius: 0.0,
            point,
            normal,
            sigma: 10e-6,
            calibration: 0.0,
            place: 0.0,
            weight: 1.0,
            is_rejected: false,
        }
    }

    fn hole() -> FeatureRecord {
        let json = r#"{"id": 1, "kind": "hole", "center_mm": [10, 20, 0], "axis": [0, 0, 1], "diameter_mm": 8, "depth_mm": 5}"#;
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn a_touch_outside_of_the_fitted_cylinder_is_off_by_its_distance() {
        let walls = [
            touch_on(14.01, 20.0, -1.0, -Vector3::x()),
            touch_on(10.0, 23.98, -2.0, -Vector3::y()),
        ];
        let touches = [walls[0], walls[1], touch(18.0, 20.0, 0.0)];
        let found =
            touch_evidence(InspectedQuantity::Diameter, &hole(), &[[0, 2]], &touches).unwrap();
        assert_eq!(
            found.count, 2,
            "the one on the plane beside the hole is no touch of its wall"
        );
        let off: Vec<f64> = found.drawn.iter().map(|[_, off]| *off).collect();
        assert!(
            (off[0] - 0.01).abs() < 1e-9 && (off[1] + 0.02).abs() < 1e-9,
            "{off:?}"
        );
        assert!((found.rms_mm - ((0.01f64.powi(2) + 0.02f64.powi(2)) / 2.0).sqrt()).abs() < 1e-9);
        assert!((found.stated_mm - 0.01).abs() < 1e-12);
        assert!((widest_gap_deg(&found.drawn) - 270.0).abs() < 0.5);
    }

    /// Opening and floor lean off the axis: each has a plane of its own, and the point above one is
    /// off by its height.
    #[test]
    fn touches_of_a_depth_are_off_the_plane_of_their_end() {
        let corners = [(0.0, 0.0), (9.0, 0.0), (0.0, 9.0), (9.0, 9.0)];
        let opening = corners.map(|(x, y)| touch(x, y, 0.01 * x));
        let floor = corners.map(|(x, y)| touch(x, y, -5.0 + if x == y { 0.002 } else { -0.002 }));
        let touches: Vec<_> = opening.into_iter().chain(floor).collect();
        let found = touch_evidence(InspectedQuantity::Depth, &hole(), &[[0, 7]], &touches).unwrap();
        let off: Vec<f64> = found
            .drawn
            .iter()
            .map(|[_, off]| (off * 1e6).round() / 1e6 + 0.0)
            .collect();
        assert_eq!(off, [0.0, 0.0, 0.0, 0.0, 0.002, -0.002, -0.002, 0.002]);
    }

    #[test]
    fn touches_that_are_not_in_the_file_give_no_plot() {
        assert!(
            touch_evidence(
                InspectedQuantity::Diameter,
                &hole(),
                &[[0, 5]],
                &[touch(14.0, 20.0, 0.0)]
            )
            .is_none()
        );
    }
}
