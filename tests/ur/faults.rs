//! What goes wrong in mid-move: the arm stands, the reason is the true one, and it is recovered when somebody says so.

use crate::Onlooker;
use std::path::Path;
use std::time::Duration;

use nalgebra::Vector3;
use touchup::robot::ur::{Halt, UrArm, UrError};
use touchup::robot::{Arm, ArmError, Command, LimitError, ProbeError, Safety, TouchOutcome, TouchParams, Watched};

use crate::stand_in::{Line, StandIn, limits};
use crate::{PLACE, above, at, error_of, patiently, touched};

/// Nobody commands any more: the client brakes, and the program of the controller lives on.
#[test]
fn an_arm_that_hears_nothing_stands() {
    patiently("an_arm_that_hears_nothing_stands", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,80"]);
        let mut arm = stand_in.connect(packages);
        move_for(&mut arm, 0.3);
        stand_in.tell("mark silence of the caller");
        let stood = stand_in.stood_after("mark silence of the caller");
        println!("the caller is silent: stands after {:.0} ms", stood * 1e3);
        assert!(stood < 0.2, "{stood}");
        // and moves again when it is told to, without having to be recovered
        move_for(&mut arm, 0.2);
        assert!(arm.halt().is_none());
        Ok(())
    });
}

/// What happens when the program that owns the arm goes: its client sees the pipe end.
#[test]
fn an_arm_that_is_let_go_stands() {
    patiently("an_arm_that_is_let_go_stands", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,80"]);
        let mut arm = stand_in.connect(packages);
        move_for(&mut arm, 0.3);
        stand_in.tell("mark let go");
        drop(arm);
        let stood = stand_in.stood_after("mark let go");
        println!("let go: stands after {:.0} ms", stood * 1e3);
        assert!(stood < 0.2, "{stood}");
        let record = stand_in.record_after("program stops", 0.0);
        assert!(record[0].event.contains("client") || record[0].event.contains("dashboard"), "{}", record[0].event);
        Ok(())
    });
}

/// Goes on and on at 20 mm/s, away from the part, for some seconds of the arm.
fn move_for(arm: &mut UrArm, seconds: f64) {
    let begun = arm.next_state().unwrap();
    loop {
        arm.command(&Command::Velocity { linear: Vector3::new(0.0, 0.0, 20e-3), acceleration: 1.0 }).unwrap();
        let state = arm.next_state().unwrap();
        if (state.stamp_ns - begun.stamp_ns) as f64 * 1e-9 > seconds {
            return;
        }
    }
}

/// Whether an error says what was.
type IsTrue = fn(&ProbeError) -> bool;

/// Moves up until it is broken off, and makes something happen on the way.
fn broken_off(arm: &mut UrArm, mut happen: impl FnMut()) -> Result<ProbeError, ProbeError> {
    let [x, y] = PLACE;
    let from = arm.next_state().unwrap().pose_bt.translation.z;
    let mut has_happened = false;
    let mut seen = |state: &touchup::robot::ArmState| {
        if !has_happened && state.pose_bt.translation.z - from > 10e-3 {
            has_happened = true;
            happen();
        }
    };
    let mut onlooker = Onlooker { seen: &mut seen, is_cancelled: || false };
    let mut watched = Watched::new(arm, limits(), &mut onlooker);
    error_of(watched.line("going up", &at([x, y, 200e-3]), 50e-3, &TouchParams::default(), limits().force))
}

fn is_lost(error: &ProbeError) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Lost { .. }, .. })
}

fn is_dropped(error: &ProbeError, says: &str) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Dropped { what }, .. } if what.contains(says))
}

/// Which of them is seen first is chance.
fn is_dropped_somewhere(error: &ProbeError) -> bool {
    is_dropped(error, "")
}

fn is_client(error: &ProbeError, says: &str) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Client { reason }, .. } if reason.contains(says))
}

fn stands_for(error: &ProbeError, why: Safety) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Stopped { safety }, .. } if *safety == why)
}

/// In mid-move at 50 mm/s. The table of docs/ur.md.
#[test]
fn after_each_fault_the_arm_stands_and_the_reason_is_the_true_one() {
    let faults: [(&str, &str, IsTrue); 14] = [
        ("connections dropped", "drop", is_dropped_somewhere),
        ("connection of the dashboard dropped", "undash", |e| is_dropped(e, "dashboard")),
        ("states silent", "silent", is_lost),
        ("half open: states come, orders do not arrive", "deaf", |e| {
            matches!(e, ProbeError::Arm { error: ArmError::ProgramEnded, .. })
        }),
        ("cable pulled: nothing both ways, no dashboard", "unplug", is_lost),
        ("controller without power", "die", is_dropped_somewhere),
        ("program of the controller hangs", "stuck", |e| is_client(e, "has not returned")),
        ("protective stop", "protective", |e| stands_for(e, Safety::ProtectiveStop)),
        ("operator's stop", "operator", |e| stands_for(e, Safety::OperatorStop)),
        ("force spike of 40 N", "spike 40", |e| matches!(e, ProbeError::Limit { error: LimitError::Force { .. }, .. })),
        ("program stopped at the panel", "halt", |e| {
            matches!(e, ProbeError::Arm { error: ArmError::ProgramEnded, .. })
        }),
        ("client killed (SIGKILL)", "KILL", |e| is_client(e, "signal: 9")),
        ("client crashed (SIGABRT)", "ABRT", |e| is_client(e, "signal: 6")),
        ("client hangs (SIGSTOP)", "STOP", |e| is_client(e, "hangs")),
    ];
    println!("| fault | told | stopped by | stands after |");
    println!("|---|---|---|---|");
    for fault in faults {
        patiently("after_each_fault_the_arm_stands_and_the_reason_is_the_true_one", |packages| {
            one_fault(packages, fault)
        });
    }
}

fn one_fault(packages: &Path, (name, fault, is_true): (&str, &str, IsTrue)) -> Result<(), ProbeError> {
    let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
    let mut params = stand_in.params(packages);
    if fault == "stuck" {
        // else the watchdog is sooner
        params.deadlines.order = Duration::from_millis(50);
    }
    let mut arm = UrArm::connect(&params).unwrap();
    let (client, is_signal) = (arm.client_id(), fault.chars().all(char::is_uppercase));
    let error = broken_off(&mut arm, || {
        if is_signal {
            stand_in.tell(&format!("mark {fault}"));
            signal(client, fault);
        } else {
            stand_in.tell(fault);
        }
    })?;
    let halt = arm.halt();
    let stood = stand_in.stood_after(fault);
    let by = match halt {
        Some(Halt::Dashboard { took }) => format!("dashboard, in {:.1} ms", took.as_secs_f64() * 1e3),
        Some(Halt::Watchdog) => "watchdog".to_owned(),
        None if matches!(error, ProbeError::Limit { .. }) => "client".to_owned(),
        None => "controller".to_owned(),
    };
    println!("| {name} | {error} | {by} | {:.0} ms |", stood * 1e3);
    assert!(is_true(&error), "{name}: {error}");
    assert!(stood < 0.2, "{name}: after {stood} s");
    Ok(())
}

/// A controller that is really killed: the record ends with it, the reason does not.
#[test]
fn a_killed_controller_is_told() {
    patiently("a_killed_controller_is_told", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let error = broken_off(&mut arm, || stand_in.kill())?;
        assert!(is_dropped_somewhere(&error), "{error}");
        assert_eq!(arm.halt(), Some(Halt::Watchdog));
        // it stays so, and recovery says why it cannot be
        assert!(matches!(arm.next_state(), Err(ArmError::Dropped { .. })));
        assert!(arm.command(&Command::Stop { deceleration: 1.0 }).is_err());
        assert!(matches!(arm.recover(), Err(ArmError::Lost { .. })));
        Ok(())
    });
}

fn signal(id: u32, name: &str) {
    let status = std::process::Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(status.unwrap().success(), "kill -{name} {id}");
}

#[test]
fn after_a_protective_stop_it_is_recovered() {
    patiently("after_a_protective_stop_it_is_recovered", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let error = broken_off(&mut arm, || stand_in.tell("protective"))?;
        assert!(stands_for(&error, Safety::ProtectiveStop), "{error}");
        let up = Command::Velocity { linear: Vector3::new(0.0, 0.0, 10e-3), acceleration: 1.0 };
        assert_eq!(arm.command(&up), Err(ArmError::Stopped { safety: Safety::ProtectiveStop }));
        let moved = |record: Vec<Line>| record.iter().any(|line| line.speed > 0.0);
        stand_in.stood_after("protective");
        stand_in.tell("mark recovering");
        arm.recover().unwrap();
        stand_in.tell("mark recovered");
        assert!(!moved(stand_in.record_after("mark recovering", 0.1)), "recovery moves nothing");
        // tool, payload and watchdog are set again: it touches as it did before
        let record = touched(&mut arm, &above(5e-3))?;
        assert!(matches!(record.outcome, TouchOutcome::Contact { .. }), "{:?}", record.outcome);
        Ok(())
    });
}

#[test]
fn after_a_lost_client_it_is_recovered() {
    patiently("after_a_lost_client_it_is_recovered", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        for fault in ["KILL", "drop"] {
            let client = arm.client_id();
            let error =
                broken_off(&mut arm, || if fault == "KILL" { signal(client, fault) } else { stand_in.tell(fault) })?;
            assert!(is_client(&error, "signal") || is_dropped_somewhere(&error), "{error}");
            arm.recover().unwrap();
            assert_ne!(arm.client_id(), client);
            move_for(&mut arm, 0.2);
        }
        Ok(())
    });
}

/// The client lives, the program of the controller does not: by a hand at the panel, or by the watchdog while nothing arrived.
/// The program that is started then does what the registers hold: a velocity from before the fault, if nobody clears them.
#[test]
fn after_an_ended_program_it_is_recovered() {
    patiently("after_an_ended_program_it_is_recovered", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        for fault in ["halt", "deaf"] {
            let error = broken_off(&mut arm, || stand_in.tell(fault))?;
            assert!(matches!(error, ProbeError::Arm { error: ArmError::ProgramEnded, .. }), "{error}");
            stand_in.stood_after(fault);
            let mended = format!("mend after {fault}");
            stand_in.tell(&mended);
            arm.recover().unwrap();
            let record = stand_in.record_after(&mended, 0.5);
            assert!(record.iter().all(|line| line.speed == 0.0), "recovery moves nothing");
            move_for(&mut arm, 0.2);
        }
        Ok(())
    });
}

/// Whoever comes second goes away again, and the first one's motion goes on.
#[test]
fn a_second_client_is_refused_and_disturbs_nothing() {
    patiently("a_second_client_is_refused_and_disturbs_nothing", |packages| {
        let stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let params = stand_in.params(packages);
        let second = std::thread::spawn(move || UrArm::connect(&params).err().unwrap());
        while !second.is_finished() {
            move_for(&mut arm, 0.1);
        }
        let refused = second.join().unwrap();
        assert!(matches!(refused, UrError::Client(_)), "{refused}");
        move_for(&mut arm, 0.2);
        Ok(())
    });
}

/// What the operator has stopped no call may start again.
#[test]
fn an_operators_stop_is_released_by_the_operator_alone() {
    patiently("an_operators_stop_is_released_by_the_operator_alone", |packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let error = broken_off(&mut arm, || stand_in.tell("operator"))?;
        assert!(stands_for(&error, Safety::OperatorStop), "{error}");
        assert_eq!(arm.recover(), Err(ArmError::Stopped { safety: Safety::OperatorStop }));
        let refused = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(matches!(refused, UrError::Stopped(Safety::OperatorStop)), "{refused}");
        stand_in.tell("release");
        stand_in.record_after("release", 0.0);
        arm.recover().unwrap();
        move_for(&mut arm, 0.2);
        Ok(())
    });
}
