//! The simulated arm against the laws of its model.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use touchup::probing::arm::{Arm, Command};
use touchup::sim::{ArmErrors, ArmParams, Plate, SimArm};

/// A place with 20 mm of flat top of the plate around it, and its height, m.
const START: [f64; 3] = [40e-3, 8e-3, 12e-3];

/// An arm without noise and bias, whose ball is `height` over the top of a plate.
fn quiet(height: f64) -> (ArmParams, Isometry3<f64>) {
    let nothing = Vector3::zeros();
    let params = ArmParams {
        pose_noise: 0.0,
        force_noise: 0.0,
        torque_noise: 0.0,
        force_bias: nothing,
        torque_bias: nothing,
        ..ArmParams::default()
    };
    let place = params.pose_bo * (Point3::from(START) + Vector3::z() * (params.radius + height));
    (
        params,
        Isometry3::from_parts(place.coords.into(), UnitQuaternion::identity()),
    )
}

/// Pressing into the top and sliding along it, the tip feels μ times the normal force backwards
/// (Coulomb), and presses with the stiffness times the penetration (Hooke).
#[test]
fn a_ball_that_slides_is_held_back_by_friction_and_presses_by_stiffness() {
    for friction in [0.0, 0.15, 0.4] {
        let plate = Plate::default();
        let (params, start) = quiet(0.1e-3);
        let params = ArmParams {
            friction,
            ..params.clone()
        };
        let mut arm = SimArm::new(&plate, params.clone(), &start).unwrap();
        let mut go = |linear: Vector3<f64>, seconds: f64| {
            let mut state = arm.next_state().unwrap();
            for _ in 0..(seconds / arm.period()) as usize {
                arm.command(&Command::Velocity {
                    linear,
                    acceleration: 1.0,
                })
                .unwrap();
                state = arm.next_state().unwrap();
            }
            state
        };
        go(-Vector3::z() * 2e-3, 0.15);
        let state = go(Vector3::x() * 5e-3, 1.0);
        let (force, top) = (
            state.wrench_b.force,
            (params.pose_bo * Point3::from(START)).z,
        );
        let depth = top + params.radius - state.pose_bt.translation.z;
        assert!(
            depth > 0.1e-3 && (force.z - params.stiffness * depth).abs() < 1e-6,
            "{depth} m, {force}"
        );
        let pulled = force.xy().norm() / force.z;
        assert!(
            (pulled - friction).abs() < 1e-3 && (friction == 0.0 || force.x < 0.0),
            "{friction}: {force}"
        );
    }
}

/// An encoder of the base that is off by δ turns the arm by δ about the axis of the base; a part
/// with an offset of t and a turn of ω sees the ball at the inverse of that.
#[test]
fn an_arm_with_errors_is_where_they_put_it() {
    let plate = Plate::default();
    let (params, start) = quiet(5e-3);
    let place = params
        .pose_bo
        .inverse_transform_point(&Point3::from(start.translation.vector));
    let ball = |errors: ArmErrors| {
        SimArm::new(
            &plate,
            ArmParams {
                errors,
                ..params.clone()
            },
            &start,
        )
        .unwrap()
        .ball()
    };
    let joints = [1e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let turned =
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1e-3) * start.translation.vector;
    let expected = params
        .pose_bo
        .inverse_transform_point(&Point3::from(turned));
    assert!(
        (ball(ArmErrors {
            joints,
            ..ArmErrors::NONE
        }) - expected)
            .norm()
            < 1e-12
    );
    let (shift, turn) = (
        Vector3::new(0.1e-3, -0.2e-3, 0.3e-3),
        Vector3::new(0.0, 0.0, 2e-3),
    );
    let displaced = ArmErrors {
        shift,
        turn,
        turned_about: place,
        ..ArmErrors::NONE
    };
    // the turn about the told place of the ball leaves the shift alone, seen in the turned axes
    let seen = place - UnitQuaternion::from_scaled_axis(-turn) * shift;
    assert!(
        (ball(displaced) - seen).norm() < 1e-12,
        "{} {seen}",
        ball(displaced)
    );
}
