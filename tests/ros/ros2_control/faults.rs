//! Faults of any kind while it moves with 36 mm/s: it stands within a bound, for a true reason, and
//! stays.

use std::time::Duration;

use touchup::probing::arm::{Arm, ArmError};

use super::{Bench, Fault, STOP, bench, seven, sideways};

/// Of the order in force: reached in 10 ms, kept for 60 ms, then v/a = 36/2000 s = 18 ms; network,
/// controller and drives take 7 ms.
const ENDS_BY_ITSELF_MS: f64 = 10.0 + 60.0 + 18.0 + 7.0;
/// A silence, or a lateness, that is a fault.
const SILENT_MS: f64 = 60.0;
/// The least time for a change of velocity is 10 ms, counted anew from each state: the rest of the
/// velocity falls by e in that time, by 36 in 36 ms.
const BRAKED_MS: f64 = 18.0 + 36.0 + 7.0;

/// The fault after half a second of motion: from it until the arm stood, ms, and the reason.
fn after(fault: Fault) -> (Bench, f64, ArmError) {
    let mut bench = bench(seven());
    bench.order_for(500, &sideways(36e-3)).unwrap();
    let begun_ns = bench.world().now_ns;
    bench.world().fail_in(1, fault);
    let reason = bench.order_for(3000, &sideways(36e-3)).unwrap_err();
    bench.world().advance(500);
    let stood_ms = (bench.world().moved_ns - begun_ns) as f64 * 1e-6;
    println!("| {fault:?} | {stood_ms:.0} | {reason} |");
    (bench, stood_ms, reason)
}

/// It takes no order but a stop, and stands, until its recovery; then it moves only by a new order.
fn stays_until_recovered(mut bench: Bench, reason: &ArmError) {
    let before = bench.world().arm.ball();
    assert_eq!(bench.arm.command(&sideways(36e-3)).as_ref(), Err(reason));
    assert_eq!(bench.arm.next_state().as_ref(), Err(reason));
    assert_eq!(bench.arm.zero_sensor().as_ref(), Err(reason));
    bench.arm.command(&STOP).unwrap();
    bench.world().repair();
    bench.arm.recover().unwrap();
    for _ in 0..100 {
        bench.arm.next_state().unwrap();
    }
    assert!((bench.world().arm.ball() - before).norm() < 1e-6);
    bench.order_for(300, &sideways(36e-3)).unwrap();
    assert!((bench.world().arm.ball() - before).norm() > 5e-3);
}

#[test]
fn joints_that_fall_silent_are_named_and_the_arm_stands() {
    let (bench, stood_ms, reason) = after(Fault::JointsSilent);
    assert!(
        matches!(&reason, ArmError::TopicSilent { topic, .. } if topic == "/joint_states"),
        "{reason}"
    );
    assert!(stood_ms < ENDS_BY_ITSELF_MS + 10.0, "{stood_ms} ms");
    stays_until_recovered(bench, &reason);
}

#[test]
fn a_sensor_that_falls_silent_is_named_and_the_arm_stands() {
    let (bench, stood_ms, reason) = after(Fault::WrenchSilent);
    assert!(
        matches!(&reason, ArmError::TopicSilent { topic, .. } if topic == "/ft_sensor/wrench"),
        "{reason}"
    );
    assert!(stood_ms < SILENT_MS + BRAKED_MS, "{stood_ms} ms");
    stays_until_recovered(bench, &reason);
}

#[test]
fn states_that_come_late_are_named_and_the_arm_stands() {
    let (bench, stood_ms, reason) = after(Fault::Late(Duration::from_millis(90)));
    assert!(
        matches!(reason, ArmError::Late { .. } | ArmError::TopicSilent { .. }),
        "{reason}"
    );
    assert!(stood_ms < 90.0 + BRAKED_MS, "{stood_ms} ms");
    stays_until_recovered(bench, &reason);
}

#[test]
fn stamps_that_jump_are_named_by_their_direction_and_the_arm_stands() {
    let (bench, stood_ms, reason) = after(Fault::StampsJump(400));
    assert!(
        matches!(reason, ArmError::JumpedAhead { ahead_ms, .. } if (ahead_ms - 400.0).abs() < 5.0),
        "{reason}"
    );
    assert!(stood_ms < BRAKED_MS, "{stood_ms} ms");
    stays_until_recovered(bench, &reason);
    let (bench, stood_ms, reason) = after(Fault::StampsJump(-400));
    assert!(
        matches!(reason, ArmError::WentBack { back_ms } if (back_ms - 398.0).abs() < 5.0),
        "{reason}"
    );
    assert!(stood_ms < BRAKED_MS, "{stood_ms} ms");
    stays_until_recovered(bench, &reason);
}

#[test]
fn a_controller_that_says_the_same_again_is_stuck() {
    let (bench, stood_ms, reason) = after(Fault::Frozen);
    assert_eq!(reason, ArmError::Stale);
    assert!(stood_ms < BRAKED_MS, "{stood_ms} ms");
    stays_until_recovered(bench, &reason);
}

/// At 36 mm/s about half a metre from its axes the orders turn the joints by 1.1° within some 300
/// ms.
#[test]
fn a_controller_that_takes_no_orders_is_named() {
    let (_, stood_ms, reason) = after(Fault::Inactive);
    assert!(
        matches!(&reason, ArmError::Ignores { topic, .. } if topic == "/arm_controller/joint_trajectory"),
        "{reason}"
    );
    assert!(stood_ms < ENDS_BY_ITSELF_MS, "{stood_ms} ms");
}

#[test]
fn a_dead_controller_is_named() {
    let (_, _, reason) = after(Fault::Dead);
    assert!(matches!(reason, ArmError::TopicSilent { .. }), "{reason}");
}

/// Nothing from here stops it: the error says so and names the remedy.
#[test]
fn an_arm_that_goes_on_after_a_stop_is_said_so() {
    let mut bench = bench(seven());
    bench.order_for(500, &sideways(36e-3)).unwrap();
    bench.world().fail_in(1, Fault::RunsOn);
    let reason = bench.order_for(1000, &STOP).unwrap_err();
    assert!(
        matches!(&reason, ArmError::GoesOn { first, .. } if first.contains("36 mm/s")),
        "{reason}"
    );
    assert!(
        reason.to_string().contains("press its emergency stop"),
        "{reason}"
    );
    assert!(matches!(bench.arm.recover(), Err(ArmError::GoesOn { .. })));
}

/// The client process dies at any moment of the motion: its last order ends at rest.
#[test]
fn an_arm_whose_client_has_died_stands_by_itself() {
    for ms in [20, 60, 150, 333, 500] {
        let mut bench = bench(seven());
        bench.order_for(ms, &sideways(36e-3)).unwrap();
        let died_ns = bench.world().now_ns;
        let place = bench.world().arm.ball();
        let world = bench.world.clone();
        drop(bench);
        let mut world = world.lock().unwrap();
        world.advance(2000);
        let stood_ms = (world.moved_ns - died_ns) as f64 * 1e-6;
        println!(
            "died after {ms} ms: stood {stood_ms:.0} ms later, {:.1} mm on",
            (world.arm.ball() - place).norm() * 1e3
        );
        assert!(
            stood_ms <= ENDS_BY_ITSELF_MS + 36.0 / 500.0 * 1e3,
            "{stood_ms} ms"
        );
        assert_eq!(world.refused, 0);
    }
}

/// Held up for 40 ms, the caller finds 20 states: it orders nothing by them, and goes on once it
/// has caught up.
#[test]
fn a_caller_that_was_held_up_orders_nothing_by_old_states() {
    let mut bench = bench(seven());
    bench.order_for(300, &sideways(36e-3)).unwrap();
    bench.world().advance(40);
    let before = bench.world().taken;
    for _ in 0..10 {
        bench.arm.next_state().unwrap();
        bench.arm.command(&sideways(36e-3)).unwrap();
    }
    bench.world().advance(4);
    assert_eq!(bench.world().taken, before);
    bench.order_for(200, &sideways(36e-3)).unwrap();
    // one each 8 ms of 200, less those of the catch-up
    assert!(bench.world().taken > before + 20);
}
