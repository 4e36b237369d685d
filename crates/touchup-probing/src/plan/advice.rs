//! Next touch for a person with a stylus, by the same reckoning as for an arm.

use nalgebra::{Point3, Vector3};

use super::design::{Candidate, Knowledge, TargetUncertainties};
use super::kinds::slot::around_stadium;
use super::search_context::toward;
use touchup_features::features::fit::{Freedom, SurfaceModel};
use touchup_features::features::{Feature, FeatureKind, Walls};
use touchup_method::stylus::ProbedPoint;

/// A place worth a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextTouch {
    /// on the surface, m in O
    pub place: Point3<f64>,
    /// out of the part, unit vector in O
    pub normal: Vector3<f64>,
}

/// Places around a round wall; along each side and around each end of a slot.
const AROUND: usize = 12;
const ALONG: usize = 5;
/// Places down a wall, as shares of its depth, and the depth of a wall of unknown depth, over its
/// radius.
const DOWN: [f64; 3] = [0.2, 0.5, 0.8];
const UNKNOWN_DEPTH: f64 = 1.0;
/// Standard deviation of one place, m, after any number of touches by hand: the error of the
/// calibration is shared.
const PLACE_SIGMA: f64 = 20e-6;
/// Standard deviation of walls from perpendicular to the surface around them, rad.
const SQUARE: f64 = 0.02;
/// Sufficient standard deviation of each number of the feature, m.
const ENOUGH: f64 = 10e-6;

/// Touch with the largest gain for the numbers of a feature; `None` if they are good enough, or
/// without a wall.
///
/// - `touches`: all touches; the feature names its own by their numbers.
pub fn advise_next_touch(feature: &Feature, touches: &[ProbedPoint]) -> Option<NextTouch> {
    let axis = feature.axis.as_ref()?.value;
    let place = TargetUncertainties::default().each(&[Freedom::X, Freedom::Y], ENOUGH);
    match feature.walls.as_ref()? {
        Walls::Round(wall) => {
            let asked = place.and(&[(Freedom::Size, 2.0)], 2.0 * ENOUGH);
            let ring = (0..AROUND).map(|at| toward(at as f64 / AROUND as f64));
            let places = ring.map(|out| (out * wall.radius, out)).collect();
            best(feature, touches, wall, &axis, places, wall.radius, &asked)
        }
        Walls::Slot(walls) => {
            let turned = place.each(&[Freedom::Turn], 2.0 * ENOUGH / walls.length);
            let asked = turned.each(&[Freedom::Second, Freedom::Size], ENOUGH);
            let (radius, half) = (
                walls.width / 2.0,
                (walls.length - walls.width).max(0.0) / 2.0,
            );
            let out = |(middle, angle): (f64, f64)| {
                let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
                (Vector3::new(middle, 0.0, 0.0) + out * radius, out)
            };
            let places = around_stadium(half, ALONG).map(out).collect();
            best(feature, touches, walls, &axis, places, radius, &asked)
        }
    }
}

/// - `places`: in the plane of the walls' frame, with the direction out of their middle; m.
fn best<M: SurfaceModel>(
    feature: &Feature,
    touches: &[ProbedPoint],
    surface: &M,
    axis: &Vector3<f64>,
    places: Vec<(Vector3<f64>, Vector3<f64>)>,
    radius: f64,
    asked: &TargetUncertainties,
) -> Option<NextTouch> {
    let pose_of = surface.pose_of();
    let (up, sign) = match feature.kind {
        // a boss rises from its foot, and out of its middle is out of the part
        FeatureKind::Boss => (*axis, 1.0),
        _ => (-axis, -1.0),
    };
    let depth = feature
        .depth
        .as_ref()
        .map_or(UNKNOWN_DEPTH * radius, |depth| depth.value);
    // the frame of the walls is somewhere on their axis
    let on_axis = Point3::from(pose_of.translation.vector);
    let opening = on_axis + axis * axis.dot(&(feature.centre.value - on_axis));
    let at = |share: f64, (place, out): &(Vector3<f64>, Vector3<f64>)| NextTouch {
        place: opening + pose_of.rotation * place + up * (share * depth),
        normal: pose_of.rotation * out * sign,
    };
    let all: Vec<NextTouch> = DOWN
        .iter()
        .flat_map(|share| places.iter().map(move |place| at(*share, place)))
        .collect();
    let candidate = |next: &NextTouch| Candidate {
        point: next.place,
        sigma: PLACE_SIGMA,
    };
    let mut is_touched = vec![false; all.len()];
    for number in feature.touch_numbers() {
        let Some(touch) = touches.get(number as usize) else {
            continue;
        };
        let far = |next: &NextTouch| (next.place - touch.point).norm_squared();
        let nearest = (0..all.len()).min_by(|&a, &b| far(&all[a]).total_cmp(&far(&all[b])))?;
        is_touched[nearest] = true;
    }
    let before = Knowledge::before::<M>(radius, SQUARE);
    let made = all
        .iter()
        .zip(&is_touched)
        .filter(|(_, is_touched)| **is_touched);
    let known = made.fold(before, |known, (next, _)| {
        known.with(surface, &candidate(next))
    });
    if known.worst(asked) <= 1.0 {
        return None;
    }
    let open = all
        .iter()
        .zip(&is_touched)
        .filter(|(_, is_touched)| !**is_touched)
        .map(|(next, _)| *next);
    known
        .best(surface, open, candidate, asked)
        .map(|(best, _)| best)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use touchup_features::features::MeasuredValue;
    use touchup_features::features::fit::Cylinder;

    /// A hole Ø 8 at the origin, 10 deep, out of its opening along z; and touches of its wall.
    fn hole(touched: &[(f64, f64)]) -> (Feature, Vec<ProbedPoint>) {
        let touches: Vec<_> = touched
            .iter()
            .map(|(angle, depth)| {
                let out = Vector3::new(angle.cos(), angle.sin(), 0.0);
                let point = Point3::from(out * 4e-3 - Vector3::z() * *depth);
                let (stamp_ns, stroke, centre, radius) = (0, 0, point, 0.0);
                let (sigma, calibration, place, weight, is_rejected) = (5e-6, 0.0, 0.0, 1.0, false);
                ProbedPoint {
                    stamp_ns,
                    stroke,
                    centre,
                    radius,
                    point,
                    normal: -out,
                    sigma,
                    calibration,
                    place,
                    weight,
                    is_rejected,
                }
            })
            .collect();
        let wall = Cylinder::new(Point3::new(0.0, 0.0, -3e-3), &Vector3::z(), 4e-3, true);
        let numbers = (0..touches.len() as u32).collect();
        let feature = Feature {
            kind: FeatureKind::Hole,
            axis: Some(MeasuredValue::new(Vector3::z(), None, Vec::new())),
            diameter: Some(MeasuredValue::new(2.0 * wall.radius, Some(1e-5), numbers)),
            depth: Some(MeasuredValue::new(10e-3, None, Vec::new())),
            walls: Some(Walls::Round(wall)),
            ..Feature::default()
        };
        (feature, touches)
    }

    #[test]
    fn a_hole_touched_on_one_side_is_to_be_touched_on_the_other() {
        let touched: Vec<_> = (0..7)
            .flat_map(|at| DOWN.map(|d| (f64::from(at) / 6.0 * PI - PI / 2.0, d * 10e-3)))
            .collect();
        let (feature, touches) = hole(&touched);
        let next = advise_next_touch(&feature, &touches).unwrap();
        // touches are at x above 0
        assert!(
            next.place.x < -3e-3 && (next.place.xy().coords.norm() - 4e-3).abs() < 1e-9,
            "{next:?}"
        );
        assert!(
            next.normal.x > 0.7 && next.place.z < 0.0 && next.place.z > -10e-3,
            "{next:?}"
        );
    }

    #[test]
    fn nothing_is_asked_of_a_hole_touched_all_around_and_the_first_touch_is_on_its_wall() {
        let touched: Vec<_> = (0..AROUND)
            .flat_map(|at| DOWN.map(|d| (at as f64 / AROUND as f64 * TAU, d * 10e-3)))
            .collect();
        let (feature, touches) = hole(&touched);
        assert_eq!(advise_next_touch(&feature, &touches), None);
        let (feature, touches) = hole(&[]);
        let next = advise_next_touch(&feature, &touches).unwrap();
        assert!(
            (next.place.xy().coords.norm() - 4e-3).abs() < 1e-9
                && next.normal.dot(&next.place.coords) < 0.0
        );
    }

    /// Following the advice measures the hole in few places, none of them twice.
    #[test]
    fn following_the_advice_ends() {
        let mut touched = Vec::new();
        for count in 0.. {
            let (feature, touches) = hole(&touched);
            let Some(next) = advise_next_touch(&feature, &touches) else {
                println!("{count} places");
                assert!((4..=24).contains(&count), "{count}");
                break;
            };
            let place = (next.place.y.atan2(next.place.x), -next.place.z);
            let is_new = |(angle, depth): &(f64, f64)| {
                (angle - place.0).abs() > 1e-6 || (depth - place.1).abs() > 1e-6
            };
            assert!(touched.iter().all(is_new), "{place:?} again");
            touched.push(place);
        }
    }
}
