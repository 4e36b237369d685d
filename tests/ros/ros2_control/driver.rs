//! Orders and states without faults.

use nalgebra::{Point3, Vector3};
use touchup::features::FeatureKind;
use touchup::probing::arm::{Arm, ArmError, Command, Limits, TouchParams};
use touchup::probing::execute::{Ending, Flag, ProbeParams, Prober, RobotCell, Tool};
use touchup::probing::plan::PatternParams;
use touchup::sim::{ArmParams, Plate, SimArm, WEIGHTLESS};
use touchup::stylus::Payload;

use super::{STOP, bench, bench_with, over, seven, sideways};
use crate::plate_stream::plate_scan;
use crate::static_scan::StaticScan;

const HOLE: Flag = Flag {
    id: 7,
    kind: Some(FeatureKind::Hole),
    place: Point3::new(17e-3, 35e-3, 12e-3),
    radius: 3e-3,
};

/// Error of the centre of the hole, and its diameter, m; number of touches. Truth: Ø 8 mm at (16,
/// 36).
fn probed(simulated: &ArmParams, arm: &mut dyn Arm) -> [f64; 3] {
    let ArmParams {
        geometry,
        pose_bo,
        pose_ft,
        ..
    } = simulated.clone();
    let cell = RobotCell {
        geometry,
        pose_bo,
        pose_ft,
        tool: Tool::default(),
    };
    let middle = pose_bo.translation.vector;
    let lowest = Point3::from(middle + Vector3::new(-0.1, -0.17, -0.05));
    let highest = Point3::from(middle + Vector3::new(0.2, 0.23, 0.35));
    let limits = Limits {
        lowest,
        highest,
        ..Limits::default()
    };
    let pattern = PatternParams {
        sigma: 10e-6,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    let params = ProbeParams {
        touch: TouchParams::default(),
        pattern,
        goals: Default::default(),
        slides: false,
        limits,
    };
    let probed = Prober::new(arm, &cell, &params, &mut StaticScan::new(plate_scan(1))).probe(&HOLE);
    assert_eq!(
        probed.ending,
        Ending::ToleranceReached,
        "{:?}",
        probed.touches.len()
    );
    let hole = probed.found.as_ref().unwrap().feature.as_ref().unwrap();
    let off = (hole.centre.value - Point3::new(16e-3, 36e-3, 12e-3)).norm();
    [
        off,
        hole.diameter.as_ref().unwrap().value - 8e-3,
        probed.touches.len() as f64,
    ]
}

/// The bounds are those of the same hole by the simulated arm itself
/// (`probing::execute::planning`).
#[test]
fn a_hole_is_probed_as_by_the_simulated_arm_itself() {
    for (name, simulated) in [("7 joints", seven()), ("UR5e", ArmParams::default())] {
        let plate = Plate::default();
        let mut directly = SimArm::new(
            &plate,
            simulated.clone(),
            &over(&simulated, [40e-3, 25e-3, 50e-3]),
        )
        .unwrap();
        let direct = probed(&simulated, &mut directly);
        let mut bench = bench(simulated.clone());
        let through = probed(&simulated, &mut bench.arm);
        for (way, [off, diameter, touches]) in
            [("directly", direct), ("through ros2_control", through)]
        {
            println!(
                "{name}, {way}: {:.1} um off, diameter {:+.1} um, {touches} touches",
                off * 1e6,
                diameter * 1e6
            );
            assert!(
                off < 50e-6 && diameter.abs() < 50e-6,
                "{name}, {way}: {off} {diameter}"
            );
        }
        let world = bench.world();
        println!(
            "{} orders, {} refused, peak {:.1} N",
            world.taken,
            world.refused,
            world.arm.peak_force()
        );
        assert_eq!(world.refused, 0);
    }
}

/// 36 mm/s for 400 ms from rest with 0.5 m/s²: 36 (0.4 − 0.072/2) = 13.1 mm, less the delay of the
/// arm.
#[test]
fn a_velocity_is_gone_with_and_a_stop_ends_it() {
    let mut bench = bench(seven());
    let begin = bench.world().arm.ball();
    bench.order_for(400, &sideways(36e-3)).unwrap();
    let gone = bench.world().arm.ball() - begin;
    assert!(
        (gone.y - 13.1e-3).abs() < 1.0e-3 && gone.x.abs() < 50e-6 && gone.z.abs() < 50e-6,
        "{gone}"
    );
    bench.order_for(200, &STOP).unwrap();
    let stood_ns = bench.world().moved_ns;
    // v/a = 72 ms, and the end of it is gentler
    let took_ms = (stood_ns - (bench.world().now_ns - 200_000_000)) as f64 * 1e-6;
    println!("stood {took_ms:.0} ms after the order");
    assert!(took_ms < 120.0, "{took_ms} ms");
}

/// It loses one period of 2 ms at each order, which come each 8 ms: slower, but it moves, and a
/// line ends at its target.
#[test]
fn a_controller_that_repeats_its_set_point_at_each_order_is_slower_and_still_moves() {
    let mut bench = bench(seven());
    bench.world().repeats = true;
    let from = bench.arm.next_state().unwrap().pose_bt;
    let begin = bench.world().arm.ball();
    bench.order_for(400, &sideways(36e-3)).unwrap();
    let gone = (bench.world().arm.ball() - begin).y;
    assert!(gone > 0.5 * 13.1e-3 && gone < 13.1e-3, "{gone}");
    let line = Command::Line {
        to: from,
        speed: 50e-3,
        acceleration: 0.5,
    };
    let state = bench.order_for(2500, &line).unwrap();
    assert!((state.pose_bt.translation.vector - from.translation.vector).norm() < 60e-6);
}

#[test]
fn a_line_ends_where_it_is_to_with_its_turn() {
    let mut bench = bench(seven());
    let from = bench.arm.next_state().unwrap().pose_bt;
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.2, -0.1, 0.15);
    let to = nalgebra::Isometry3::from_parts(
        (from.translation.vector + Vector3::new(0.02, -0.03, 0.01)).into(),
        turn,
    );
    let line = Command::Line {
        to,
        speed: 50e-3,
        acceleration: 0.5,
    };
    let state = bench.order_for(2500, &line).unwrap();
    let off = state.pose_bt.translation.vector - to.translation.vector;
    assert!(
        off.norm() < 60e-6 && state.pose_bt.rotation.angle_to(&to.rotation) < 1e-3,
        "{off}"
    );
    // the reported place is that of the ball, but for the noise of the encoders
    let ball = seven().pose_bo * bench.world().arm.ball();
    assert!((state.pose_bt.translation.vector - ball.coords).norm() < 60e-6);
}

/// On the top of the plate: the sensor measures the ordered force, and its noise averages out.
#[test]
fn a_press_comes_to_its_force_and_does_not_swing() {
    let simulated = seven();
    let mut bench = bench(simulated.clone());
    let to = over(&simulated, [40e-3, 25e-3, 12e-3 + 1.5e-3 + 1e-3]);
    bench
        .order_for(
            2000,
            &Command::Line {
                to,
                speed: 50e-3,
                acceleration: 0.5,
            },
        )
        .unwrap();
    bench.order_for(200, &STOP).unwrap();
    bench.arm.zero_sensor().unwrap();
    let press = Command::Press {
        axis: -Vector3::z(),
        force: 3.0,
        feed: Vector3::zeros(),
        speed: 5e-3,
    };
    bench.order_for(1500, &press).unwrap();
    let forces: Vec<f64> = (0..250)
        .map(|_| bench.order_for(2, &press).unwrap().wrench_b.force.z)
        .collect();
    let mean = forces.iter().sum::<f64>() / 250.0;
    let std = (forces
        .iter()
        .map(|force| (force - mean).powi(2))
        .sum::<f64>()
        / 250.0)
        .sqrt();
    println!(
        "mean {mean:.2} N, std {std:.2} N, peak {:.2} N",
        bench.world().arm.peak_force()
    );
    // noise of one reading is 0.15 N
    assert!((mean - 3.0).abs() < 0.1 && std < 0.3, "{mean} {std}");
    assert!(bench.world().arm.peak_force() < 4.0);
}

/// 0.5 kg are 4.9 N, and with the centre 80 mm before the flange 0.39 N·m when the flange lies;
/// here it stands: no torque but by the tilt.
#[test]
fn weight_and_bias_are_off_the_force_after_zeroing_in_every_orientation() {
    let payload = Payload {
        mass: 0.5,
        p_sc: Vector3::new(0.01, 0.0, 0.08),
        ..WEIGHTLESS
    };
    let simulated = ArmParams { payload, ..seven() };
    let mut bench = bench_with(simulated, |params| params.payload = payload).unwrap();
    bench.arm.zero_sensor().unwrap();
    let from = bench.arm.next_state().unwrap().pose_bt;
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.2, 0.0);
    let to = nalgebra::Isometry3::from_parts(from.translation, turn);
    bench
        .order_for(
            3000,
            &Command::Line {
                to,
                speed: 50e-3,
                acceleration: 0.5,
            },
        )
        .unwrap();
    let states: Vec<_> = (0..250)
        .map(|_| bench.order_for(2, &STOP).unwrap().wrench_b)
        .collect();
    let mean = |of: fn(&touchup::stylus::Wrench) -> Vector3<f64>| {
        states.iter().map(of).sum::<Vector3<f64>>() / 250.0
    };
    let (force, torque) = (mean(|wrench| wrench.force), mean(|wrench| wrench.torque));
    assert!(
        force.norm() < 0.08 && torque.norm() < 0.02,
        "{force} {torque}"
    );
}

#[test]
fn zeroing_is_refused_in_motion_and_where_the_force_changes() {
    let mut bench = bench(seven());
    bench.order_for(300, &sideways(36e-3)).unwrap();
    let refused = bench.arm.zero_sensor().unwrap_err();
    assert!(
        matches!(&refused, ArmError::Refused { reason, .. } if reason.contains("moves")),
        "{refused}"
    );
    bench.order_for(300, &STOP).unwrap();
    bench.world().fail_in(64, super::Fault::Force(3.0));
    let refused = bench.arm.zero_sensor().unwrap_err();
    assert!(
        matches!(&refused, ArmError::Refused { reason, .. } if reason.contains("changes by")),
        "{refused}"
    );
    // none of it is a fault
    bench.arm.next_state().unwrap();
    bench.world().repair();
    bench.order_for(100, &STOP).unwrap();
    bench.arm.zero_sensor().unwrap();
}

#[test]
fn what_is_told_wrong_of_it_is_refused_by_name() {
    let refused = |change: fn(&mut touchup::ros2_control::Ros2ControlParams)| {
        bench_with(seven(), change)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    };
    let frame = refused(|params| params.section.wrench_frame = "tool0".to_owned());
    assert!(
        frame.contains("\"ft_sensor\"") && frame.contains("robot.ros2_control.wrench_frame"),
        "{frame}"
    );
    let joint = refused(|params| params.joint_names[2] = "elbow".into());
    assert!(joint.contains("the joint elbow is missing"), "{joint}");
    let none = refused(|params| {
        params
            .joint_names
            .iter_mut()
            .for_each(|name| *name = format!("other_{name}").into())
    });
    assert!(
        none.contains("/joint_states brings nothing new for 2000 ms"),
        "{none}"
    );
    let count = refused(|params| params.joint_names.truncate(6));
    assert!(count.contains("7 joints, and 6 are named"), "{count}");
    let latency = refused(|params| params.latency = f64::NAN);
    assert!(latency.contains("the latency is NaN s"), "{latency}");
}

#[test]
fn a_command_out_of_range_is_refused_and_nothing_is_sent() {
    let mut bench = bench(seven());
    bench.arm.next_state().unwrap();
    let before = bench.world().taken;
    let down = -Vector3::z();
    let commands = [
        sideways(0.3),
        sideways(f64::NAN),
        Command::Velocity {
            linear: down * 0.01,
            acceleration: 0.0,
        },
        Command::Press {
            axis: down,
            force: 60.0,
            feed: Vector3::zeros(),
            speed: 5e-3,
        },
        Command::Press {
            axis: Vector3::zeros(),
            force: 3.0,
            feed: Vector3::zeros(),
            speed: 5e-3,
        },
        Command::Stop { deceleration: -1.0 },
    ];
    for command in commands {
        assert!(
            matches!(bench.arm.command(&command), Err(ArmError::Refused { .. })),
            "{command:?}"
        );
    }
    bench.world().advance(20);
    assert_eq!(bench.world().taken, before);
}
