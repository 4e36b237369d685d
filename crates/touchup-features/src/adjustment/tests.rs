//! The adjustment of made sessions: expected values are those that the sessions were made with.

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3, Vector6};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

use super::session_change::SessionChange;
use super::{ChangeCause, RecordedPress, SessionAdjustment, SessionNumbers};
use crate::features::fit::{Cylinder, SurfaceModel};
use touchup_method::stylus::ChangeCourse;

const RADIUS: f64 = 1.5e-3;
/// Duration of a stroke.
const STROKE_NS: i64 = 1_000_000_000;

/// Presses on the faces of a box, 40 × 30 × 20 mm, in strokes of thirty.
///
/// - `made_with`: the session. `turned`: largest lean of the stylus, rad. `noise`: standard deviation
///   of a centre in each direction, m.
pub(super) fn presses_on_box(
    seed: u64,
    made_with: SessionNumbers,
    turned: f64,
    noise: f64,
) -> Vec<RecordedPress> {
    let mut random = SmallRng::seed_from_u64(seed);
    let half = Vector3::new(20e-3, 15e-3, 10e-3);
    let mut presses = Vec::new();
    for stroke in 0..90u32 {
        let axis = stroke as usize % 5;
        // not the floor
        let side = if axis == 4 || stroke % 2 == 0 {
            1.0
        } else {
            -1.0
        };
        let axis = [0, 1, 0, 1, 2][axis];
        let normal = Vector3::ith(axis, side);
        let mut spread = || random.random_range(-1.0..1.0);
        let [from, to] = [0, 1].map(|_| Vector3::from_fn(|i, _| 0.9 * half[i] * spread()));
        let lean = Vector3::new(spread(), spread(), 0.0) * turned;
        for at in 0..30 {
            let share = f64::from(at) / 29.0;
            let mut place = from + (to - from) * share;
            place[axis] = side * half[axis];
            let centre = place + normal * RADIUS;
            let rotation = UnitQuaternion::from_scaled_axis(lean * (0.5 + share));
            let force = normal * (1.0 + 2.0 * random.random_range(0.0..1.0));
            let mut error = || random.random_range(-1.0..1.0) * 3f64.sqrt() * noise;
            let error = Vector3::new(error(), error(), error());
            presses.push(RecordedPress {
                stamp_ns: i64::from(stroke) * STROKE_NS + i64::from(at) * STROKE_NS / 30,
                centre: Point3::from(
                    centre - rotation * made_with.offset_t - force * made_with.compliance + error,
                ),
                rotation,
                force,
                course: (to - from).component_mul(&(Vector3::repeat(1.0) - normal.abs())),
                stroke,
            });
        }
    }
    presses
}

pub(super) fn numbers(compliance_mm_per_n: f64, offset_mm: [f64; 3]) -> SessionNumbers {
    SessionNumbers {
        compliance: compliance_mm_per_n * 1e-3,
        offset_t: Vector3::from(offset_mm) * 1e-3,
        change: Vector6::zeros(),
    }
}

fn vague() -> SessionNumbers {
    SessionNumbers {
        change: Vector6::new(10e-3, 10e-3, 10e-3, 0.2, 0.2, 0.2),
        ..numbers(0.2, [10.0; 3])
    }
}

pub(super) fn adjusted(presses: &[RecordedPress]) -> SessionAdjustment {
    SessionAdjustment::of(presses, RADIUS, SessionNumbers::default(), vague()).unwrap()
}

/// The presses after the part was moved by a turn about a point and a shift, from a stroke on.
fn moved(
    presses: &mut [RecordedPress],
    from: u32,
    about: Point3<f64>,
    shift: Vector3<f64>,
    turn: UnitQuaternion<f64>,
) {
    for press in presses.iter_mut().filter(|press| press.stroke >= from) {
        press.centre = about + turn * (press.centre - about) + shift;
        press.rotation = turn * press.rotation;
        press.force = turn * press.force;
    }
}

/// Whether a change begins with a stroke, within two presses.
pub(super) fn is_at(course: ChangeCourse, stroke: i64) -> bool {
    let ChangeCourse::At(at) = course else {
        return false;
    };
    (at - stroke * STROKE_NS).abs() <= 2 * STROKE_NS / 30
}

#[test]
fn a_session_without_noise_is_found_as_it_was_made() {
    let made_with = numbers(0.05, [0.3, -0.2, 1.0]);
    let presses = presses_on_box(7, made_with, 0.6, 0.0);
    let found = SessionAdjustment::of(&presses, RADIUS, SessionNumbers::default(), vague());
    let found = found.unwrap();
    assert!(found.surfaces >= 5, "{found:?}");
    // the prior pulls by (1 µm / 10 mm)² of the offset and less
    let off = (found.found.offset_t - made_with.offset_t).norm();
    assert!(off < 1e-7, "{found:?}");
    assert!(
        (found.found.compliance - made_with.compliance).abs() < 1e-9,
        "{found:?}"
    );
}

/// Root mean square of errors over their stated uncertainties: near one; twenty sessions show that
/// within a fifth or so, and the largest of several estimates of one variance is a little too large.
#[test]
fn errors_are_as_large_as_stated() {
    let made_with = numbers(0.05, [0.3, -0.2, 1.0]);
    let told = numbers(0.04, [0.2, 0.0, 0.5]);
    let errors = (0..20).map(|seed| {
        let presses = presses_on_box(seed, made_with, 0.6, 0.02e-3);
        let found = SessionAdjustment::of(&presses, RADIUS, told, vague()).unwrap();
        let off = found.found.offset_t - made_with.offset_t;
        let compliance = found.found.compliance - made_with.compliance;
        let off = off.component_div(&found.sigma.offset_t);
        [
            off.norm_squared() / 3.0,
            (compliance / found.sigma.compliance).powi(2),
        ]
    });
    let errors: Vec<[f64; 2]> = errors.collect();
    for which in 0..2 {
        let squares = errors.iter().map(|error| error[which]);
        let size = (squares.sum::<f64>() / errors.len() as f64).sqrt();
        assert!((0.5..1.3).contains(&size), "{size} of number {which}");
    }
}

#[test]
fn an_offset_of_a_stylus_that_never_turns_stays_unknown() {
    let presses = presses_on_box(7, numbers(0.05, [0.0, 0.0, 1.0]), 0.0, 0.02e-3);
    let found = SessionAdjustment::of(&presses, RADIUS, SessionNumbers::default(), vague());
    let found = found.unwrap();
    // each wall takes it up
    let least = found.sigma.offset_t.min();
    assert!(least > 0.9 * vague().offset_t.x, "{found:?}");
    assert!((found.found.compliance - 0.05e-3).abs() < 4.0 * found.sigma.compliance);
}

#[test]
fn turned_poses_do_not_matter() {
    let made_with = numbers(0.05, [0.3, -0.2, 1.0]);
    let turn =
        UnitQuaternion::from_axis_angle(&Unit::new_normalize(Vector3::new(1.0, 2.0, 3.0)), 1.1);
    let found = [UnitQuaternion::identity(), turn].map(|turn| {
        let mut presses = presses_on_box(7, made_with, 0.6, 0.02e-3);
        for press in &mut presses {
            press.centre = turn * press.centre + Vector3::new(0.1, -0.2, 0.3);
            press.rotation = turn * press.rotation;
            press.force = turn * press.force;
        }
        SessionAdjustment::of(&presses, RADIUS, SessionNumbers::default(), vague()).unwrap()
    });
    let [one, other] = found;
    let off = (one.found.offset_t - other.found.offset_t).norm();
    // cells of contacts lie elsewhere
    assert!(off < 2.0 * one.sigma.offset_t.amax(), "{one:?} {other:?}");
}

#[test]
fn a_part_that_moved_is_found_with_time_and_size() {
    let sizes = [
        (0.1e-3, 0.0, ChangeCause::PartShifted),
        (0.5e-3, 0.02, ChangeCause::PartMoved),
        (3e-3, 0.05, ChangeCause::PartMoved),
    ];
    for (size, turn, cause) in sizes {
        let mut presses = presses_on_box(7, numbers(0.05, [0.0; 3]), 0.6, 0.02e-3);
        let about = Point3::new(1e-3, 2e-3, 3e-3);
        let shift = Vector3::new(1.0, -0.5, 0.7) * size;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 1.0) * turn);
        moved(&mut presses, 39, about, shift, turn);
        let found = adjusted(&presses);
        let change = found.change.unwrap().change;
        assert_eq!(change.cause, cause);
        // 0.02 mm of noise hide 0.05 mm along a normal in a press or two
        assert!(is_at(change.course, 39), "{change:?}");
        let off = change.about - about;
        // in the axes of the part before it turned
        let shift = turn.inverse() * (shift + (turn * off - off));
        let mut expected = Vector6::zeros();
        expected.fixed_rows_mut::<3>(0).copy_from(&shift);
        expected
            .fixed_rows_mut::<3>(3)
            .copy_from(&turn.scaled_axis());
        let off = (found.found.change - expected).component_div(&found.sigma.change);
        assert!(off.amax() < 4.0, "{off} {found:?}");
        let sigma = found.sigma.change;
        assert!(sigma.fixed_rows::<3>(0).amax() < 0.02e-3, "{sigma}");
        let is_turned = cause == ChangeCause::PartMoved;
        assert_eq!(
            sigma.fixed_rows::<3>(3).amax() < 0.002,
            is_turned,
            "{sigma}"
        );
    }
}

#[test]
fn a_tip_that_bent_is_no_part_that_moved() {
    let bend = Vector3::new(0.3e-3, -0.2e-3, 0.5e-3);
    let mut presses = presses_on_box(7, numbers(0.05, [0.0; 3]), 0.6, 0.02e-3);
    for press in presses.iter_mut().filter(|press| press.stroke >= 60) {
        press.centre -= press.rotation * bend;
    }
    let found = adjusted(&presses);
    let likely = found.change.unwrap();
    assert_eq!(likely.change.cause, ChangeCause::TipBent);
    assert!(is_at(likely.change.course, 60), "{likely:?}");
    assert!(likely.odds > 10.0, "{likely:?}");
    let [size, sigma] =
        [found.found.change, found.sigma.change].map(|of| Vector3::from(of.fixed_rows::<3>(0)));
    assert!(
        (size - bend).component_div(&sigma).amax() < 4.0,
        "{found:?}"
    );
}

#[test]
fn a_part_that_creeps_is_found_as_it_creeps() {
    let mut presses = presses_on_box(7, numbers(0.05, [0.0; 3]), 0.6, 0.02e-3);
    let last = presses.last().unwrap().stamp_ns as f64;
    for press in &mut presses {
        press.centre.x += 0.4e-3 * press.stamp_ns as f64 / last;
    }
    let found = adjusted(&presses);
    let change = found.change.unwrap().change;
    assert_eq!(change.cause, ChangeCause::PartShifted);
    assert_eq!(change.course, ChangeCourse::Between(0, last as i64));
    let off = (found.found.change.x - 0.4e-3) / found.sigma.change.x;
    assert!(off.abs() < 4.0, "{found:?}");
}

#[test]
fn nothing_changes_in_a_session_as_it_should_be() {
    for seed in 0..20 {
        let presses = presses_on_box(seed, numbers(0.05, [0.3, 0.0, 0.0]), 0.6, 0.02e-3);
        let found = adjusted(&presses);
        let odds = found.change.map_or(0.0, |change| change.odds);
        assert!(odds < 5.0, "{found:?}");
    }
}

#[test]
fn a_stylus_that_gets_softer_is_found_with_its_time() {
    let mut presses = presses_on_box(11, numbers(0.05, [0.0; 3]), 0.6, 0.02e-3);
    let softer = 0.06e-3;
    for press in presses.iter_mut().filter(|press| press.stroke >= 50) {
        press.centre -= press.force * softer;
    }
    let found = adjusted(&presses);
    let likely = found.change.unwrap();
    assert_eq!(likely.change.cause, ChangeCause::StiffnessChanged);
    assert!(
        likely.odds > 5.0 && is_at(likely.change.course, 50),
        "{found:?}"
    );
    let off = (found.found.change[0] - softer).abs();
    assert!(off < 3.5 * found.sigma.change[0], "{found:?}");
}

/// Derivatives of the distance from a bore by all numbers, against differences.
#[test]
fn derivatives_are_those_of_the_placed_press() {
    let bore = Cylinder::new(Point3::origin(), &Vector3::new(0.1, 0.2, 1.0), 4e-3, true);
    let press = RecordedPress {
        stamp_ns: 700,
        centre: Point3::new(2e-3, 1e-3, 5e-3),
        rotation: UnitQuaternion::from_euler_angles(0.3, -0.4, 0.5),
        force: Vector3::new(-1.0, -0.7, 0.2),
        course: Vector3::zeros(),
        stroke: 0,
    };
    let causes = [
        ChangeCause::PartShifted,
        ChangeCause::PartMoved,
        ChangeCause::TipBent,
        ChangeCause::StiffnessChanged,
    ];
    for cause in causes {
        let change = SessionChange {
            cause,
            course: ChangeCourse::Between(0, 1000),
            about: Point3::new(-3e-3, 1e-3, 2e-3),
        };
        // small turns: their derivatives are those at no turn
        let at = SessionNumbers {
            change: Vector6::new(0.2e-3, -0.1e-3, 0.3e-3, 1e-6, -2e-6, 1e-6),
            ..numbers(0.05, [0.1, 0.2, -0.3])
        };
        let distance = |numbers: &SessionNumbers| {
            let placed = press.placed(numbers, Some(&change));
            bore.distance_and_normal(&placed.centre)
        };
        let placed = press.placed(&at, Some(&change));
        let by = press.by_numbers(&placed, &distance(&at).1, &at, Some(&change));
        let (by, x) = (by.as_vector(), at.as_vector());
        for which in 0..x.len() {
            let step = if which == 0 { 1e-9 } else { 1e-7 };
            let [more, less] = [1.0, -1.0].map(|sign| {
                let mut moved = x;
                moved[which] += sign * step;
                distance(&SessionNumbers::from_vector(&moved)).0
            });
            let difference = (more - less) / (2.0 * step);
            assert!(
                (by[which] - difference).abs() < 1e-5 * (1.0 + difference.abs()),
                "{cause:?} {which}: {} {difference}",
                by[which]
            );
        }
    }
}
