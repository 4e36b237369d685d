//! Forces of made sessions, read by a sensor with a known fault: that is found.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};

use super::force_fault::without_trace;
use super::tests::{adjusted, is_at, numbers, presses_on_box};
use super::{ForceAdjustment, ForceFault, RecordedPress};

const FRICTION: f64 = 0.2;

/// Presses on a box that slide with friction, read by a sensor: `read` says the force in T from that
/// in T, and the press.
///
/// - `noise`: standard deviation of each axis, N.
fn read_by(
    seed: u64,
    noise: f64,
    read: impl Fn(&RecordedPress, Vector3<f64>) -> Vector3<f64>,
) -> Vec<RecordedPress> {
    let mut random = SmallRng::seed_from_u64(seed + 1000);
    let mut presses = presses_on_box(seed, numbers(0.0, [0.0; 3]), 0.6, 0.005e-3);
    for press in &mut presses {
        let force = press.force - press.course.normalize() * (FRICTION * press.force.norm());
        let read = read(press, press.rotation.inverse() * force);
        let error = Vector3::from_fn(|_, _| noise * 3f64.sqrt() * random.random_range(-1.0..1.0));
        press.force = press.rotation * (read + error);
    }
    presses
}

fn found(presses: &[RecordedPress]) -> ForceAdjustment {
    let found = adjusted(presses).force.unwrap();
    assert!(found.odds.iter().all(|odds| *odds > 5.0), "{found:?}");
    found
}

/// Within three and a half standard uncertainties and what rounding and tilt of the surfaces leave.
fn assert_is(found: &ForceAdjustment, from: usize, expected: Vector3<f64>) {
    let value = found.found.fixed_rows::<3>(from).into_owned();
    let sigma = found.sigma.fixed_rows::<3>(from).into_owned();
    for axis in 0..3 {
        let off = (value[axis] - expected[axis]).abs();
        assert!(
            off < 3.5 * sigma[axis] + 1e-3,
            "{value} ± {sigma}, {expected}"
        );
    }
}

#[test]
fn a_turned_sensor_is_found() {
    let turn = Vector3::new(0.2, -0.1, 0.15);
    let presses = read_by(1, 0.02, |_, force| Rotation3::new(-turn) * force);
    let found = found(&presses);
    assert_eq!(found.fault, ForceFault::Turned);
    assert_is(&found, 0, turn);
}

#[test]
fn gains_are_found_but_for_one_common_to_all() {
    let gains = Matrix3::new(1.0, 0.1, -0.07, -0.05, 1.0, 0.1, 0.08, -0.1, 1.3);
    let read = gains.try_inverse().unwrap();
    let presses = read_by(2, 0.02, |_, force| read * force);
    let found = found(&presses);
    assert_eq!(found.fault, ForceFault::Gains);
    let matrix = Matrix3::identity() + without_trace(&found.found);
    let off = matrix / matrix.trace() - gains / gains.trace();
    assert!(off.amax() < 0.01, "{matrix} {found:?}");
}

#[test]
fn a_zero_that_steps_is_found_with_its_time() {
    let change = Vector3::new(0.3, -0.2, 0.25);
    let presses = read_by(3, 0.02, |press, force| {
        force
            + if press.stroke >= 40 {
                change
            } else {
                Vector3::zeros()
            }
    });
    let found = found(&presses);
    let ForceFault::ZeroChanged(course) = found.fault else {
        panic!("{found:?}");
    };
    assert!(is_at(course, 40), "{found:?}");
    assert_is(&found, 0, Vector3::zeros());
    assert_is(&found, 3, change);
}

#[test]
fn a_weight_and_a_zero_are_told_apart() {
    let (zero, weight) = (Vector3::new(0.1, 0.0, -0.2), Vector3::new(0.0, 0.1, -0.4));
    let presses = read_by(4, 0.02, |press, force| {
        force + zero + press.rotation.inverse() * weight
    });
    let found_weight = found(&presses);
    assert_eq!(found_weight.fault, ForceFault::Weight);
    assert_is(&found_weight, 0, zero);
    assert_is(&found_weight, 3, weight);

    let presses = read_by(5, 0.02, |_, force| force + zero);
    let found_zero = found(&presses);
    assert_eq!(found_zero.fault, ForceFault::Zero);
    assert_is(&found_zero, 0, zero);
}

#[test]
fn a_sound_sensor_is_without_fault() {
    for seed in 10..20 {
        let presses = read_by(seed, 0.05, |_, force| force);
        let fault = adjusted(&presses).force;
        let odds = fault.map_or(0.0, |fault| fault.odds[0]);
        assert!(odds < 5.0, "{fault:?}");
    }
}
