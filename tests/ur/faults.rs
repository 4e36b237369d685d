//! Faults in mid-move: the arm comes to rest, the reported reason is the true one, and it recovers
//! on command.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use nalgebra::Vector3;
use touchup::clock::{Clock, ManualClock};
use touchup::probing::arm::{
    Arm, ArmError, Command, LimitError, ProbeError, Safety, SupervisedArm, TouchOutcome,
    TouchParams,
};
use touchup::ur::{Halt, UrArm, UrError};

use crate::probing::cell;
use crate::stand_in::{Line, StandIn, limits};
use crate::{LATENCY, Onlooker, PLACE, above, at, touched, with_library};

/// In mid-move, m/s.
const SPEED: f64 = 50e-3;
/// The brakes of the stand-in take 50 mm/s at 8 m/s², s.
const BRAKES: f64 = 10e-3;

/// Without commands: after 20 ms the client brakes, and the program of the controller lives on.
#[test]
fn without_commands_the_arm_stops() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,80"]);
        let mut arm = stand_in.connect(packages);
        move_for(&mut arm, 0.3);
        stand_in.send("mark silence of the caller");
        let silence = stand_in.record_between("mark silence of the caller", "stop requested");
        let after = silence[silence.len() - 1].time - silence[0].time;
        println!(
            "the caller is silent: stop requested after {:.0} ms",
            after * 1e3
        );
        // to the nanosecond: a difference of two times is inexact
        let after_ns = (after * 1e9).round();
        assert!((20e6..50e6).contains(&after_ns), "{after_ns}");
        stand_in.stands_in("stop requested with 2", 20e-3 / 2.0 + LATENCY);
        // and moves again on command, without recovery
        move_for(&mut arm, 0.2);
        assert!(arm.halt().is_none());
        Ok(())
    });
}

/// The program that owns the arm ends: its client sees the pipe end.
#[test]
fn a_released_arm_stops() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,80"]);
        let mut arm = stand_in.connect(packages);
        move_for(&mut arm, 0.3);
        stand_in.send("mark let go");
        drop(arm);
        stand_in.stands_in("mark let go", 20e-3 / 2.0 + 2.0 * LATENCY);
        let record = stand_in.record_after("program stops");
        assert!(record[0].event.contains("client"), "{}", record[0].event);
        assert!(record[0].speed == 0.0, "it stood before: {:?}", record[0]);
        Ok(())
    });
}

/// Goes on and on at 20 mm/s, away from the part, for some seconds of the arm.
fn move_for(arm: &mut UrArm, seconds: f64) {
    go_for(
        arm,
        seconds,
        &Command::Velocity {
            linear: Vector3::new(0.0, 0.0, 20e-3),
            acceleration: 1.0,
        },
    );
}

/// Commands zero velocity, for some seconds of the arm.
pub fn rest_for(arm: &mut UrArm, seconds: f64) {
    go_for(arm, seconds, &Command::Stop { deceleration: 1.0 });
}

fn go_for(arm: &mut UrArm, seconds: f64, command: &Command) {
    let begun = arm.next_state().unwrap();
    loop {
        arm.command(command).unwrap();
        let state = arm.next_state().unwrap();
        if (state.stamp_ns - begun.stamp_ns) as f64 * 1e-9 > seconds {
            return;
        }
    }
}

/// Whether an error names the true cause.
type IsTrue = fn(&ProbeError) -> bool;

/// Moves up until a fault breaks the motion off, and makes something happen meanwhile.
fn broken_off(arm: &mut UrArm, mut happen: impl FnMut()) -> ProbeError {
    let [x, y] = PLACE;
    let from = arm.next_state().unwrap().pose_bt.translation.z;
    let mut has_happened = false;
    let mut seen = |state: &touchup::probing::arm::ArmState| {
        if !has_happened && state.pose_bt.translation.z - from > 10e-3 {
            has_happened = true;
            happen();
        }
    };
    let mut onlooker = Onlooker {
        seen: &mut seen,
        stop_request: || None,
    };
    let mut watched = SupervisedArm::new(arm, limits(), &mut onlooker);
    let up = at([x, y, 200e-3]);
    let went = watched.line(
        "going up",
        &up,
        SPEED,
        &TouchParams::default(),
        limits().force,
    );
    // an arm that goes on passes the end of the motion
    went.and_then(|()| watched.dwell("standing", 1.0, &mut |_| {}))
        .err()
        .unwrap()
}

fn is_lost(error: &ProbeError) -> bool {
    matches!(
        error,
        ProbeError::Arm {
            error: ArmError::Lost {
                silent_ms: 81..=100
            },
            ..
        }
    )
}

fn is_dropped(error: &ProbeError, says: &str) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Dropped { what }, .. } if what.contains(says))
}

/// Which of them the client sees first is chance.
fn is_dropped_somewhere(error: &ProbeError) -> bool {
    is_dropped(error, "")
}

fn is_client(error: &ProbeError, says: &str) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Client { reason }, .. } if reason.contains(says))
}

fn is_stopped_by(error: &ProbeError, why: Safety) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::Stopped { safety }, .. } if *safety == why)
}

fn hangs(error: &ProbeError) -> bool {
    matches!(error, ProbeError::Arm { error: ArmError::ProgramHangs { silent_ms, .. }, .. } if *silent_ms < 7.0)
}

fn has_ended(error: &ProbeError) -> bool {
    matches!(
        error,
        ProbeError::Arm {
            error: ArmError::ProgramEnded,
            ..
        }
    )
}

/// The clock that runs until the detection of a fault.
#[derive(Clone, Copy)]
enum Passes {
    /// none: detection is immediate
    Nothing,
    /// that of the controller, ms
    Controller(u32),
    /// that of the guard, line by line of the client, which come each 10 ms; and of the controller,
    /// ms
    Guard(u32),
    /// that of the guard, which gets no lines any more
    GuardAlone,
}

/// Stop of the arm, by the record.
#[derive(Clone, Copy)]
enum By {
    Dashboard,
    Watchdog,
    Controller,
    /// its program pauses, and then ends
    Pause,
    Client,
}

struct Fault {
    name: &'static str,
    /// a line for the stand-in, or a signal for the client
    happens: &'static str,
    passes: Passes,
    by: By,
    is_true: IsTrue,
}

/// In mid-move at 50 mm/s. The table of docs/ur.md.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn after_each_fault_the_arm_is_at_rest_and_the_reported_reason_is_true() {
    use By::{Client, Controller, Dashboard, Pause, Watchdog};
    let fault = |name, happens, passes, by, is_true| Fault {
        name,
        happens,
        passes,
        by,
        is_true,
    };
    let is_stopped: [IsTrue; 2] = [
        |e| is_stopped_by(e, Safety::ProtectiveStop),
        |e| is_stopped_by(e, Safety::OperatorStop),
    ];
    let faults = [
        fault(
            "connections dropped",
            "drop",
            Passes::Nothing,
            Dashboard,
            is_dropped_somewhere,
        ),
        fault(
            "connection of the dashboard dropped",
            "undash",
            Passes::Nothing,
            Dashboard,
            |e| is_dropped(e, "dashboard"),
        ),
        fault(
            "states silent",
            "silent",
            Passes::Guard(0),
            Dashboard,
            is_lost,
        ),
        fault(
            "half open: states come, orders do not arrive",
            "deaf",
            Passes::Controller(150),
            Watchdog,
            has_ended,
        ),
        fault(
            "cable pulled: nothing in either direction, no dashboard",
            "unplug",
            Passes::Guard(150),
            Watchdog,
            is_lost,
        ),
        fault(
            "controller without power",
            "die",
            Passes::Nothing,
            Controller,
            is_dropped_somewhere,
        ),
        fault(
            "program of the controller hangs",
            "stuck",
            Passes::Nothing,
            Dashboard,
            hangs,
        ),
        fault(
            "program hangs, its motion lives, and it takes every order",
            "hung",
            Passes::Nothing,
            Dashboard,
            hangs,
        ),
        fault(
            "program paused at the panel",
            "pause",
            Passes::Nothing,
            Pause,
            |e| {
                matches!(
                    e,
                    ProbeError::Arm {
                        error: ArmError::ProgramPaused,
                        ..
                    }
                )
            },
        ),
        fault(
            "safeguard: a door is opened",
            "open",
            Passes::Nothing,
            Pause,
            is_stopped[1],
        ),
        fault(
            "protective stop",
            "protective",
            Passes::Nothing,
            Controller,
            is_stopped[0],
        ),
        fault(
            "operator's stop",
            "operator",
            Passes::Nothing,
            Controller,
            is_stopped[1],
        ),
        fault(
            "force spike of 40 N",
            "spike 40",
            Passes::Nothing,
            Client,
            |e| {
                matches!(
                    e,
                    ProbeError::Limit {
                        error: LimitError::Force { .. },
                        ..
                    }
                )
            },
        ),
        fault(
            "program stopped at the panel",
            "halt",
            Passes::Nothing,
            Controller,
            has_ended,
        ),
        fault(
            "client killed (SIGKILL)",
            "KILL",
            Passes::Nothing,
            Dashboard,
            |e| is_client(e, "signal: 9"),
        ),
        fault(
            "client crashed (SIGABRT)",
            "ABRT",
            Passes::Nothing,
            Dashboard,
            |e| is_client(e, "signal: 6"),
        ),
        fault(
            "client hangs (SIGSTOP)",
            "STOP",
            Passes::GuardAlone,
            Dashboard,
            |e| is_client(e, "hangs"),
        ),
    ];
    println!("| fault | reported | stopped by | at rest after |");
    println!("|---|---|---|---|");
    for fault in faults {
        with_library(|packages| one_fault(packages, &fault));
    }
}

fn one_fault(packages: &Path, fault: &Fault) -> Result<(), ProbeError> {
    let Fault {
        name,
        happens,
        passes,
        by,
        is_true,
    } = *fault;
    let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
    let mut params = stand_in.params(packages);
    let mut hand = None;
    if matches!(passes, Passes::Guard(_) | Passes::GuardAlone) {
        let (clock, mover) = Clock::manual();
        (params.clock, hand) = (clock, Some(mover));
    }
    let mut arm = UrArm::connect(&params).unwrap();
    let (client, is_signal) = (arm.client_id(), happens.chars().all(char::is_uppercase));
    let mut passing = None;
    let error = broken_off(&mut arm, || {
        if is_signal {
            stand_in.send(&format!("mark {happens}"));
            signal(client, happens);
        } else {
            stand_in.send(happens);
        }
        if let Passes::Controller(ms) | Passes::Guard(ms) = passes {
            stand_in.run(ms);
        }
        passing = hand
            .take()
            .map(|hand| Passing::begin(hand, matches!(passes, Passes::Guard(_))));
    });
    drop(passing);
    let halt = arm.halt();
    let (event, most) = match by {
        By::Dashboard => ("program stops: dashboard", BRAKES),
        By::Watchdog => ("program stops: watchdog after 10", BRAKES),
        By::Controller => ("program stops", BRAKES),
        By::Pause => ("program pauses", BRAKES),
        By::Client => ("stop requested", SPEED / limits().acceleration + LATENCY),
    };
    let stood = stand_in.stood_after(event);
    let stopped = match halt {
        Some(Halt::Dashboard { .. }) => "dashboard",
        Some(Halt::Watchdog) => "nothing else",
        None => "nothing else, nor has to",
    };
    let by_whom = stand_in.record_after(event).swap_remove(0).event;
    println!(
        "| {name} | {error} | {by_whom}; by the guard: {stopped} | {:.0} ms |",
        stood * 1e3
    );
    assert!(is_true(&error), "{name}: {error}");
    assert!(stood < most, "{name}: after {stood} s");
    assert_eq!(
        matches!(halt, Some(Halt::Dashboard { .. })),
        matches!(by, By::Dashboard),
        "{name}: {halt:?}"
    );
    Ok(())
}

/// The thread of the motion still has its velocity when the program resumes, as by the automatic
/// reset of a safeguard. With a dashboard its program has ended by then; without one the client
/// brakes it at the resumption, and its watchdog ends it.
#[test]
#[ignore = "a slow proof"]
fn an_arm_that_was_paused_does_not_go_on_when_it_is_resumed() {
    for (pause, resume, is_mute) in [
        ("pause", "resume", false),
        ("open", "shut", false),
        ("open", "shut", true),
    ] {
        with_library(|packages| {
            let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
            let mut arm = stand_in.connect(packages);
            let error = broken_off(&mut arm, || {
                if is_mute {
                    stand_in.send("mute");
                }
                stand_in.send(pause);
            });
            stand_in.stands_in("program pauses", BRAKES);
            if !is_mute {
                stand_in.record_after("program stops: dashboard");
            }
            stand_in.send("mark resumes");
            stand_in.send(resume);
            stand_in.run(1000);
            if is_mute {
                stand_in.record_after("program stops: watchdog");
            }
            stand_in.send("mark later");
            let record = stand_in.record_between("mark resumes", "mark later");
            let way = record
                .iter()
                .map(|line| (line.place - record[0].place).norm())
                .fold(0.0, f64::max);
            let moved = record
                .iter()
                .rfind(|line| line.speed > 0.0)
                .map_or(0.0, |line| line.time - record[0].time);
            println!(
                "{pause}, then {resume}: {:.2} mm within {:.0} ms; {error}",
                way * 1e3,
                moved * 1e3
            );
            let (most_way, most_time) = if is_mute { (2e-3, 0.2) } else { (0.0, 0.0) };
            assert!(
                way <= most_way && moved <= most_time,
                "{pause}: {way} m, until {moved} s"
            );
            if !is_mute {
                arm.recover().unwrap();
                move_for(&mut arm, 0.2);
            }
            Ok(())
        });
    }
}

/// Lets the time of a guard pass until its drop.
struct Passing {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Passing {
    /// - `by_lines`: 10 ms for each line of the client, else the time of its deadline without one.
    fn begin(hand: ManualClock, by_lines: bool) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let seen = is_over.clone();
        let thread = thread::spawn(move || {
            let mut begun = hand.begun();
            while !seen.load(Ordering::Relaxed) {
                if !by_lines {
                    hand.advance(Duration::from_millis(80));
                } else if hand.begun() > begun {
                    // the guard has taken a line, and waits for the next one
                    begun = hand.begun();
                    hand.advance(Duration::from_millis(10));
                }
                thread::sleep(Duration::from_millis(1));
            }
        });
        Self {
            is_over,
            thread: Some(thread),
        }
    }
}

impl Drop for Passing {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}

/// Neither the client nor the guard does anything: the watchdog of the controller does, in its time
/// and not before.
#[test]
fn the_watchdog_stops_an_uncommanded_arm() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut params = stand_in.params(packages);
        // uncommanded: the guard waits
        let (clock, hand) = Clock::manual();
        params.clock = clock;
        let mut arm = UrArm::connect(&params).unwrap();
        move_for(&mut arm, 0.2);
        signal(arm.client_id(), "STOP");
        stand_in.send("mark stopped");
        stand_in.run(150);
        let record = stand_in.record_between("mark stopped", "program stops: watchdog after 10");
        let before = &record[..record.len() - 1];
        assert!(
            before.iter().all(|line| line.speed > 19e-3),
            "it went on until then"
        );
        stand_in.stands_in("program stops: watchdog", BRAKES);
        hand.advance(Duration::from_millis(80));
        let passing = Passing::begin(hand, false);
        while let Ok(_state) = arm.next_state() {}
        drop(passing);
        Ok(())
    });
}

/// A controller that is really killed: the record ends with it, the reason does not.
#[test]
fn a_killed_controller_is_reported() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let error = broken_off(&mut arm, || stand_in.kill());
        assert!(is_dropped_somewhere(&error), "{error}");
        assert_eq!(arm.halt(), Some(Halt::Watchdog));
        // it stays so, and recovery reports the reason
        assert!(matches!(arm.next_state(), Err(ArmError::Dropped { .. })));
        assert!(arm.command(&Command::Stop { deceleration: 1.0 }).is_err());
        assert!(matches!(arm.recover(), Err(ArmError::Lost { .. })));
        Ok(())
    });
}

fn signal(id: u32, name: &str) {
    let status = std::process::Command::new("kill")
        .args([format!("-{name}"), id.to_string()])
        .status();
    assert!(status.unwrap().success(), "kill -{name} {id}");
}

#[test]
#[ignore = "a slow proof"]
fn after_a_protective_stop_it_is_recovered() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let error = broken_off(&mut arm, || stand_in.send("protective"));
        assert!(is_stopped_by(&error, Safety::ProtectiveStop), "{error}");
        let up = Command::Velocity {
            linear: Vector3::new(0.0, 0.0, 10e-3),
            acceleration: 1.0,
        };
        assert_eq!(
            arm.command(&up),
            Err(ArmError::Stopped {
                safety: Safety::ProtectiveStop
            })
        );
        let moved = |record: Vec<Line>| record.iter().any(|line| line.speed > 0.0);
        stand_in.stands_in("program stops: a safety plane", BRAKES);
        stand_in.send("mark recovering");
        arm.recover().unwrap();
        rest_for(&mut arm, 0.1);
        stand_in.send("mark recovered");
        assert!(
            !moved(stand_in.record_between("mark recovering", "mark recovered")),
            "recovery moves nothing"
        );
        // tool, payload and watchdog have their values again: it touches as before
        let record = touched(&mut arm, &above(5e-3))?;
        assert!(
            matches!(record.outcome, TouchOutcome::Contact { .. }),
            "{:?}",
            record.outcome
        );
        Ok(())
    });
}

/// `touchup recover`: the program that drove it has ended, and the controller refuses a new one
/// until somebody says that he has looked.
#[test]
fn a_stopped_arm_is_recovered_by_a_verb_and_nothing_moves() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let folder = cell(&stand_in, packages);
        let recover = || {
            let mut verb = std::process::Command::new(env!("CARGO_BIN_EXE_touchup-tested"));
            verb.env("TOUCHUP_UR_LOCK_STEP", "1")
                .args(["recover", "--json", "--scene"])
                .arg(folder.path().join("scene.yaml"));
            verb.output().unwrap()
        };
        stand_in.send("operator");
        let refused = recover();
        assert_eq!(refused.status.code(), Some(5));
        let why = String::from_utf8(refused.stderr).unwrap();
        assert!(why.contains("stopped by the operator"), "{why}");
        stand_in.send("release");
        stand_in.send("protective");
        let refused = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(
            matches!(refused, UrError::Stopped(Safety::ProtectiveStop)),
            "{refused}"
        );
        let recovered = recover();
        assert_eq!(
            recovered.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&recovered.stderr)
        );
        let state: serde_json::Value = serde_json::from_slice(&recovered.stdout).unwrap();
        // in the base of the arm
        assert!(
            (state["tip_mm"][2].as_f64().unwrap() - 90.0).abs() < 0.1,
            "{state}"
        );
        assert!(
            stand_in.record().iter().all(|line| line.speed == 0.0),
            "nothing moves"
        );
        stand_in.connect(packages);
        Ok(())
    });
}

#[test]
fn after_a_lost_client_it_is_recovered() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        for fault in ["KILL", "drop"] {
            let client = arm.client_id();
            let error = broken_off(&mut arm, || {
                if fault == "KILL" {
                    signal(client, fault)
                } else {
                    stand_in.send(fault)
                }
            });
            assert!(
                is_client(&error, "signal") || is_dropped_somewhere(&error),
                "{error}"
            );
            arm.recover().unwrap();
            assert_ne!(arm.client_id(), client);
            move_for(&mut arm, 0.2);
        }
        Ok(())
    });
}

/// The client lives, the program of the controller does not: by a hand at the panel, or by the
/// watchdog after a silence. The restarted program executes the contents of the registers: a
/// velocity from before the fault, unless something clears them.
#[test]
fn after_an_ended_program_it_is_recovered() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        for fault in ["halt", "deaf"] {
            let error = broken_off(&mut arm, || {
                stand_in.send(fault);
                if fault == "deaf" {
                    stand_in.run(150);
                }
            });
            assert!(has_ended(&error), "{error}");
            stand_in.stands_in("program stops", BRAKES);
            let [mended, recovered] =
                ["mend", "mark recovered"].map(|mark| format!("{mark} after {fault}"));
            stand_in.send(&mended);
            arm.recover().unwrap();
            rest_for(&mut arm, 0.5);
            stand_in.send(&recovered);
            let record = stand_in.record_between(&mended, &recovered);
            assert!(
                record.iter().all(|line| line.speed == 0.0),
                "recovery moves nothing"
            );
            move_for(&mut arm, 0.2);
        }
        Ok(())
    });
}

/// The controller refuses a second client, and the first one's motion goes on.
#[test]
fn a_second_client_is_refused_and_disturbs_nothing() {
    with_library(|packages| {
        let stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let params = stand_in.params(packages);
        let second = thread::spawn(move || UrArm::connect(&params).err().unwrap());
        // up and down, for any duration
        for speed in [20e-3, -20e-3].into_iter().cycle() {
            let linear = Vector3::new(0.0, 0.0, speed);
            go_for(
                &mut arm,
                0.1,
                &Command::Velocity {
                    linear,
                    acceleration: 1.0,
                },
            );
            if second.is_finished() {
                break;
            }
        }
        let refused = second.join().unwrap();
        assert!(matches!(refused, UrError::Client(_)), "{refused}");
        move_for(&mut arm, 0.2);
        Ok(())
    });
}

/// No call may restart an arm stopped by the operator.
#[test]
fn an_operators_stop_is_released_by_the_operator_alone() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        let error = broken_off(&mut arm, || stand_in.send("operator"));
        assert!(is_stopped_by(&error, Safety::OperatorStop), "{error}");
        assert_eq!(
            arm.recover(),
            Err(ArmError::Stopped {
                safety: Safety::OperatorStop
            })
        );
        let refused = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(
            matches!(refused, UrError::Stopped(Safety::OperatorStop)),
            "{refused}"
        );
        stand_in.send("release");
        arm.recover().unwrap();
        move_for(&mut arm, 0.2);
        Ok(())
    });
}

/// A line of 10 mm at 50 mm/s has 2.9 s, and takes 4 s at 5 %.
#[test]
fn a_speed_slider_is_named_where_the_arm_does_not_arrive() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&["--start-mm", "45,8,40"]);
        let mut arm = stand_in.connect(packages);
        stand_in.send("slider 5");
        let mut onlooker = Onlooker {
            seen: |_: &_| {},
            stop_request: || None,
        };
        let mut watched = SupervisedArm::new(&mut arm, limits(), &mut onlooker);
        let up = at([PLACE[0], PLACE[1], 50e-3]);
        let error = watched
            .line(
                "going up",
                &up,
                SPEED,
                &TouchParams::default(),
                limits().force,
            )
            .err()
            .unwrap();
        assert!(
            error.to_string().ends_with(": its speed slider is at 5 %"),
            "{error}"
        );
        Ok(())
    });
}
