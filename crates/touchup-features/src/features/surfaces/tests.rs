//! Surfaces of touches in closed form.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::touched_surfaces;
use crate::features::fit::SurfaceModel;
use crate::features::segmentation::primitive::Primitive;
use touchup_method::stylus::ProbedPoint;

/// m
const BALL: f64 = 1.5e-3;

/// A touch of a ball; a stroke may have an error along the normal, m.
fn touch(stroke: u32, point: Point3<f64>, normal: Vector3<f64>, error: f64) -> ProbedPoint {
    ProbedPoint {
        stamp_ns: 0,
        stroke,
        centre: point + normal * (BALL + error),
        radius: BALL,
        point: point + normal * error,
        normal,
        sigma: 1e-5,
        calibration: 0.0,
        place: 0.0,
        weight: 1.0,
        is_rejected: false,
    }
}

/// Touches of the plane z = 0 outside of a circle about the origin, by parallel strokes 1 mm apart.
fn land(half: f64, hole: f64, error: impl Fn(u32) -> f64) -> Vec<ProbedPoint> {
    let rows = (2.0 * half / 1e-3) as u32;
    let mut touches = Vec::new();
    for row in 0..=rows {
        for at in 0..=4 * rows {
            let (x, y) = (f64::from(at) * 2.5e-4 - half, f64::from(row) * 1e-3 - half);
            if x.hypot(y) > hole {
                let point = Point3::new(x, y, 0.0);
                touches.push(touch(row, point, Vector3::z(), error(row)));
            }
        }
    }
    touches
}

/// Touches of a ball that rolls into a hole over its rim, and out again, at 48 places around.
fn over_rim(radius: f64, leans: std::ops::Range<f64>) -> Vec<ProbedPoint> {
    let place = |i: u32| {
        let turn = TAU * f64::from(i) / 48.0;
        let outward = Vector3::new(turn.cos(), turn.sin(), 0.0);
        let leans = (0..12).map(|k| leans.start + (leans.end - leans.start) * f64::from(k) / 11.0);
        let roll = leans.map(|lean| {
            let normal = Vector3::z() * lean.cos() - outward * lean.sin();
            touch(1000 + i, Point3::from(outward * radius), normal, 0.0)
        });
        roll.collect::<Vec<_>>()
    };
    (0..48).flat_map(place).collect()
}

#[test]
fn a_rim_that_the_ball_rolls_over_shows_the_wall_below_it() {
    let touches = [land(12e-3, 5e-3, |_| 0.0), over_rim(5e-3, 0.1..1.4)].concat();
    let found = touched_surfaces(&touches);
    let planes = found.iter().filter(|one| one.primitive.plane().is_some());
    assert_eq!(planes.count(), 1);
    let bores: Vec<_> = found
        .iter()
        .filter_map(|one| match one.primitive {
            Primitive::Cylinder(cylinder) => Some((cylinder, &one.felt)),
            _ => None,
        })
        .collect();
    let [(bore, felt)] = bores.as_slice() else {
        panic!("{} cylinders", bores.len());
    };
    assert!(bore.concave && bore.axis().z.abs() > 0.9999);
    assert!((bore.radius - 5e-3).abs() < 1e-6, "{}", bore.radius);
    let on_axis = bore.nearest_on_axis(&Point3::origin());
    assert!(on_axis.coords.norm() < 1e-6);
    for felt in *felt {
        let touch = &touches[felt.touch as usize];
        assert!(felt.at_edge.is_some() && touch.stroke >= 1000);
        assert!((felt.place.coords.norm() - 5e-3).abs() < 1e-9);
    }
}

#[test]
fn passes_that_differ_by_their_wander_are_on_one_plane() {
    // ±40 µm by turns
    let touches = land(10e-3, 0.0, |row| if row % 2 == 0 { 4e-5 } else { -4e-5 });
    let found = touched_surfaces(&touches);
    let [plane] = found.as_slice() else {
        panic!("{} surfaces", found.len());
    };
    assert!(plane.primitive.distance(&Point3::origin()).abs() < 2e-5);
    assert_eq!(plane.felt.len(), touches.len());
}

#[test]
fn each_touch_of_a_step_is_on_one_of_its_planes() {
    let upper = land(10e-3, 0.0, |_| 0.0);
    let lower = upper.iter().map(|one| ProbedPoint {
        centre: one.centre + Vector3::new(21e-3, 0.0, -2e-3),
        point: one.point + Vector3::new(21e-3, 0.0, -2e-3),
        ..*one
    });
    let touches: Vec<ProbedPoint> = upper.iter().copied().chain(lower).collect();
    let found = touched_surfaces(&touches);
    let [one, other] = found.as_slice() else {
        panic!("{} surfaces", found.len());
    };
    let mut numbers: Vec<u32> = [&one.felt, &other.felt]
        .into_iter()
        .flatten()
        .map(|felt| felt.touch)
        .collect();
    numbers.sort_unstable();
    assert_eq!(numbers, (0..touches.len() as u32).collect::<Vec<_>>());
}

#[test]
fn without_touches_there_is_no_surface() {
    assert!(touched_surfaces(&[]).is_empty());
}
