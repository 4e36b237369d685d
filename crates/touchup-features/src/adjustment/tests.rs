//! The adjustment of made sessions: expected values are those that the sessions were made with.

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

use super::{RecordedPress, SessionAdjustment, SessionNumbers};

const RADIUS: f64 = 1.5e-3;

/// Presses on the faces of a box, 40 × 30 × 20 mm, in strokes of thirty.
///
/// - `made_with`: the session. `turned`: largest lean of the stylus, rad. `noise`: standard deviation
///   of a centre in each direction, m.
fn presses_on_box(
    seed: u64,
    made_with: SessionNumbers,
    turned: f64,
    noise: f64,
) -> Vec<RecordedPress> {
    let mut random = SmallRng::seed_from_u64(seed);
    let half = Vector3::new(20e-3, 15e-3, 10e-3);
    let mut presses = Vec::new();
    for stroke in 0..30u32 {
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
                centre: Point3::from(
                    centre - rotation * made_with.offset_t - force * made_with.compliance + error,
                ),
                rotation,
                force,
                stroke,
            });
        }
    }
    presses
}

fn numbers(compliance_mm_per_n: f64, offset_mm: [f64; 3]) -> SessionNumbers {
    SessionNumbers {
        compliance: compliance_mm_per_n * 1e-3,
        offset_t: Vector3::from(offset_mm) * 1e-3,
    }
}

fn vague() -> SessionNumbers {
    numbers(0.2, [10.0; 3])
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
