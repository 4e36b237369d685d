//! Scripts of faults, and the right behaviour after each.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::chain::{Library, ModelSample, STEP, ScriptedArm, ScriptedChain};
use super::session::{ProbingSession, limits};
use touchup_probing::arm::{Arm, ProbeError, TouchParams};
use touchup_sim::Plate;

/// Time in which the arm stands without a dashboard, s: watchdog of the controller plus braking.
const WATCHDOG: f64 = 0.12;
/// Travel of a program resumed before anybody could end it, m: its thread accelerates with 0.5 m/s²
/// until the client, which looks each 5 ms, brakes 14 ms later, so some 20 ms of motion.
const RESUMED_WAY: f64 = 0.15e-3;
/// Time without orders after a fault, s.
const QUIET: f64 = 2.0;
/// Tolerance of the surface found by a touch after a fault, m.
const FOUND: f64 = 0.1e-3;

/// Result of a script.
struct ScriptOutcome {
    error: Option<ProbeError>,
    /// time of the report, s
    at: f64,
    touches: usize,
    record: Vec<ModelSample>,
    /// missing states up to the report of the fault
    missing: i64,
    /// time at which the arm took commands again, s, and surface error of the next touch, m
    recovered: Option<(f64, Result<Option<f64>, String>)>,
}

impl ScriptOutcome {
    /// The last time before the recovery at which the arm moved, s.
    fn stood_at(&self) -> f64 {
        self.before()
            .rfind(|moment| moment.speed > 0.0)
            .map_or(0.0, |moment| moment.time)
    }

    /// Records before the next order.
    fn before(&self) -> impl DoubleEndedIterator<Item = &ModelSample> {
        let until = self.recovered.as_ref().map_or(f64::INFINITY, |(at, _)| *at);
        self.record
            .iter()
            .filter(move |moment| moment.time <= until)
    }

    /// Travel later than some time (s) after the report, m; and its end relative to the report, s.
    fn after_report(&self, since: f64) -> (f64, f64) {
        let later = self.before().filter(|moment| moment.time > self.at + since);
        let way = later.map(|moment| moment.speed * STEP.as_secs_f64()).sum();
        (way, self.stood_at() - self.at)
    }

    fn peak(&self) -> f64 {
        self.record
            .iter()
            .map(|moment| moment.force)
            .fold(0.0, f64::max)
    }
}

/// Touches until some time (s); after a fault waits two seconds without orders, then goes on.
fn played(script: Vec<(f64, String)>, seed: u64, seconds: f64) -> ScriptOutcome {
    let over = script.last().map_or(0.0, |(at, _)| at + 0.1);
    let plate = Plate::default();
    let world = ScriptedChain::new(&plate, script, seed);
    let library = Library(&world);
    let mut session = ProbingSession::new(&world, ScriptedArm::connect(&world, &library).unwrap());
    let error = session.probe(seconds).err();
    let (at, touches, missing) = (world.now(), session.touches, session.heard.missing);
    while world.now() < (at + QUIET).max(over) {
        session.arm.step();
    }
    let recovered = error.is_some().then(|| match session.arm.recover() {
        Ok(()) => (
            world.now(),
            session.go_on().map_err(|error| error.to_string()),
        ),
        Err(error) => (world.now(), Err(error.to_string())),
    });
    drop(session);
    ScriptOutcome {
        error,
        at,
        touches,
        record: world.record.take(),
        missing,
        recovered,
    }
}

/// A kind of fault.
pub struct FaultKind {
    pub line: &'static str,
    /// line that ends it; empty: none
    ends: &'static str,
    /// maximum time until the arm stands, for a fault that lasts as long, s; `None`: it may go on,
    /// or notice the fault at its next order
    stands: Option<f64>,
    /// words of the true reasons
    reasons: &'static [&'static str],
}

/// Reasons for the end of a program by its watchdog, as orders do not arrive.
const UNHEARD: &[&str] = &[
    "has ended",
    "has not returned",
    "are ordered",
    "refused a call",
    "has come",
    "did not arrive",
];

/// For a command that takes longer than a cycle the deadline of its call counts.
const HANGS: &[&str] = &["counted no cycle", "has not returned"];

pub const KINDS: &[FaultKind] = &[
    FaultKind {
        line: "pause",
        ends: "resume",
        stands: Some(0.05),
        reasons: &["was paused"],
    },
    FaultKind {
        line: "open",
        ends: "shut",
        stands: Some(0.05),
        reasons: &["by the operator", "was paused"],
    },
    FaultKind {
        line: "protective",
        ends: "",
        stands: Some(0.05),
        reasons: &["protective stop"],
    },
    FaultKind {
        line: "operator",
        ends: "release",
        stands: Some(0.05),
        reasons: &["by the operator", "has ended"],
    },
    FaultKind {
        line: "halt",
        ends: "",
        stands: Some(0.05),
        reasons: &["has ended"],
    },
    FaultKind {
        line: "off",
        ends: "on",
        stands: Some(0.05),
        reasons: &["has ended"],
    },
    FaultKind {
        line: "local",
        ends: "remote",
        stands: Some(0.05),
        reasons: &["has ended"],
    },
    FaultKind {
        line: "drop",
        ends: "",
        stands: Some(0.05),
        reasons: &["was closed"],
    },
    FaultKind {
        line: "undash",
        ends: "",
        stands: Some(0.05),
        reasons: &["was closed"],
    },
    FaultKind {
        line: "die",
        ends: "mend",
        stands: Some(0.05),
        reasons: &["was closed"],
    },
    FaultKind {
        line: "silent",
        ends: "mend",
        stands: Some(0.2),
        reasons: &["has come", "states came", "has not returned"],
    },
    FaultKind {
        line: "unplug",
        ends: "mend",
        stands: Some(0.2),
        reasons: &["has come", "states came", "has ended"],
    },
    FaultKind {
        line: "deaf",
        ends: "mend",
        stands: Some(0.2),
        reasons: UNHEARD,
    },
    FaultKind {
        line: "stuck",
        ends: "mend",
        stands: Some(0.2),
        reasons: HANGS,
    },
    FaultKind {
        line: "hung",
        ends: "mend",
        stands: Some(0.2),
        reasons: HANGS,
    },
    FaultKind {
        line: "slow 3",
        ends: "mend",
        stands: Some(0.2),
        reasons: HANGS,
    },
    FaultKind {
        line: "slow 2",
        ends: "mend",
        stands: None,
        reasons: &[],
    },
    FaultKind {
        line: "tired",
        ends: "mend",
        stands: None,
        reasons: UNHEARD,
    },
    FaultKind {
        line: "late states 40",
        ends: "mend",
        stands: None,
        reasons: &["states came", "has come", "N at (", "N over", "ms behind"],
    },
    FaultKind {
        line: "late orders 40",
        ends: "mend",
        stands: None,
        reasons: &["are ordered", "N at (", "N over"],
    },
    FaultKind {
        line: "spike 40",
        ends: "",
        stands: None,
        reasons: &["over the limit", "N at ("],
    },
    FaultKind {
        line: "raise 3",
        ends: "raise -3",
        stands: None,
        reasons: &["N at (", "over the limit", "N at rest", "protective stop"],
    },
    FaultKind {
        line: "slider 5",
        ends: "slider 100",
        stands: None,
        reasons: &["its speed slider is at 5 %"],
    },
    FaultKind {
        line: "reduced",
        ends: "full",
        stands: None,
        reasons: &["reduced mode"],
    },
    FaultKind {
        line: "noise 0.3",
        ends: "noise 0",
        stands: None,
        reasons: &["N at ("],
    },
    FaultKind {
        line: "payload 1.5",
        ends: "",
        stands: None,
        reasons: &["N at (", "N at rest", "over the limit"],
    },
    FaultKind {
        line: "rate 125",
        ends: "rate 500",
        stands: None,
        reasons: &["states came"],
    },
    FaultKind {
        line: "drift 1",
        ends: "steady",
        stands: None,
        reasons: &["N at (", "N at rest", "N over", "pulls with"],
    },
    FaultKind {
        line: "hold 300",
        ends: "",
        stands: None,
        reasons: &["states came", "ms behind"],
    },
    FaultKind {
        line: "watchdog counts",
        ends: "",
        stands: None,
        reasons: &[],
    },
    FaultKind {
        line: "mute",
        ends: "mend",
        stands: None,
        reasons: &[],
    },
];

/// Faults of one script: kind, moment and length, s.
type Faults = Vec<(&'static FaultKind, f64, f64)>;

/// One or two faults of any kind, at random times from `from` to `until`, s.
pub fn random_faults(rng: &mut Pcg64, from: f64, until: f64) -> Faults {
    let count = 1 + usize::from(rng.random_range(0.0..1.0) < 0.4);
    let one = |_| {
        let kind = &KINDS[rng.random_range(0..KINDS.len())];
        (
            kind,
            rng.random_range(from..until),
            rng.random_range(0.05..1.5),
        )
    };
    (0..count).map(one).collect()
}

pub fn script_of(faults: &[(&'static FaultKind, f64, f64)]) -> Vec<(f64, String)> {
    let begin = faults
        .iter()
        .map(|(kind, at, _)| (*at, kind.line.to_owned()));
    let ends = faults.iter().filter(|(kind, ..)| !kind.ends.is_empty());
    let mut script: Vec<_> = begin
        .chain(ends.map(|(kind, at, length)| (at + length, kind.ends.to_owned())))
        .collect();
    script.sort_by(|a, b| a.0.total_cmp(&b.0));
    script
}

/// Whether the words are true of some of the faults.
fn is_true(words: &str, faults: &Faults) -> bool {
    faults
        .iter()
        .flat_map(|(kind, ..)| kind.reasons)
        .any(|reason| words.contains(reason))
}

/// Error in the end of a script.
#[expect(clippy::too_many_lines)]
fn judged(faults: &Faults, outcome: &ScriptOutcome) -> Option<String> {
    let has = |lines: &[&str]| faults.iter().any(|(kind, ..)| lines.contains(&kind.line));
    if let Some(error) = &outcome.error {
        let words = error.to_string();
        if !is_true(&words, faults) {
            return Some(format!("the reason is not true: {words}"));
        }
        let most = if has(&["mute", "unplug", "die"]) && has(&["pause", "open"]) {
            RESUMED_WAY
        } else {
            0.0
        };
        let (way, until) = outcome.after_report(0.2);
        if way > most {
            let (way, until) = (way * 1e3, until * 1e3);
            return Some(format!(
                "{way:.2} mm after the report, until {until:.0} ms after it: {words}"
            ));
        }
    }
    let has_dashboard = !has(&["mute", "unplug"]);
    for (kind, at, length) in faults {
        let late = outcome.stood_at() - at;
        let is_resumed = !has_dashboard && matches!(kind.line, "pause" | "open");
        // without a dashboard the watchdog stops the arm
        let most = kind.stands.map(|most| {
            if has_dashboard {
                most
            } else {
                most.max(WATCHDOG)
            }
        });
        // another fault may end this one early
        let mends = faults
            .iter()
            .filter(|(other, ..)| other.ends == "mend")
            .map(|(_, at, length)| at + length);
        let lasts = mends
            .filter(|end| end > at)
            .map(|end| end - at)
            .fold(*length, f64::min);
        if let Some(most) = most.filter(|most| !is_resumed && lasts > *most && late > *most) {
            return Some(format!(
                "`{}`: stands after {:.0} of {:.0} ms",
                kind.line,
                late * 1e3,
                most * 1e3
            ));
        }
    }
    match &outcome.recovered {
        Some((_, Err(why))) => {
            return Some(format!("does not go on after {:?}: {why}", outcome.error));
        }
        Some((_, Ok(None))) => return Some("finds no surface after it has recovered".to_owned()),
        Some((_, Ok(Some(off)))) if off.abs() > FOUND => {
            return Some(format!(
                "finds the surface {:.3} mm off after it has recovered",
                off * 1e3
            ));
        }
        _ => {}
    }
    // lost states, states during a delay of the caller, and bunched states, which the library
    // reduces to the newest
    let may_miss = has(&[
        "silent",
        "unplug",
        "die",
        "rate 125",
        "hold 300",
        "drop",
        "late states 40",
    ]);
    if outcome.missing != 0 && !may_miss {
        return Some(format!(
            "{} states never reached the observer",
            outcome.missing
        ));
    }
    let most = 1.5 * limits().force;
    (outcome.peak() > most).then(|| format!("{:.1} N of at most {most} N", outcome.peak()))
}

#[test]
fn without_a_fault_it_touches_and_touches() {
    let outcome = played(Vec::new(), 1, 14.0);
    assert!(outcome.error.is_none(), "{}", outcome.error.unwrap());
    assert!(
        outcome.touches >= 3 && outcome.peak() < 2.0 * TouchParams::default().force,
        "{}",
        outcome.peak()
    );
    println!(
        "{} touches, at most {:.1} N",
        outcome.touches,
        outcome.peak()
    );
}

/// A part 7 mm above the mesh that clears the links, met from above at link speed.
#[test]
fn a_part_met_at_link_speed_is_pressed_with_no_more_than_the_limit_and_left() {
    let outcome = played(vec![(0.2, "raise 7".to_owned())], 1, 6.0);
    let error = outcome.error.as_ref().unwrap().to_string();
    println!("{:.1} N at most; {error}", outcome.peak());
    assert!(
        error.contains("where the path is clear by the mesh"),
        "{error}"
    );
    assert!(
        outcome.peak() > 1.0 && outcome.peak() < limits().force,
        "{} N",
        outcome.peak()
    );
    let last = outcome.record.last().unwrap().force;
    assert!(last < 1.0, "{last} N are left");
}

/// Each fault in the fastest link, in the search for the surface, and pressed; one table row each.
#[test]
#[ignore = "a slow proof"]
fn each_fault_alone_ends_as_it_should() {
    let mut wrong = Vec::new();
    let mut table =
        "| fault | moment | speed, mm/s | stands after, ms | largest force, N | reason |\n\
         |---|---|---|---|---|---|\n"
            .to_owned();
    for (name, moment) in moments() {
        for kind in KINDS {
            let faults = vec![(kind, moment, 1.5)];
            let outcome = played(script_of(&faults), 1, 10.0);
            let reason = outcome
                .error
                .as_ref()
                .map_or("none: it goes on".to_owned(), ToString::to_string);
            let stands = (outcome.stood_at() - moment) * 1e3;
            let stands = outcome
                .error
                .as_ref()
                .map_or("-".to_owned(), |_| format!("{:.0}", stands.max(0.0)));
            let speed = outcome
                .record
                .iter()
                .find(|seen| seen.time >= moment)
                .map_or(0.0, |seen| seen.speed * 1e3);
            let (line, peak) = (kind.line, outcome.peak());
            table +=
                &format!("| {line} | {name} | {speed:.0} | {stands} | {peak:.1} | {reason} |\n");
            wrong.extend(
                judged(&faults, &outcome).map(|why| format!("{} in {name}: {why}", kind.line)),
            );
        }
    }
    println!("{table}");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The program pauses during a search at 5.3 mm/s, nobody ends it, and somebody resumes it.
#[test]
fn an_arm_that_is_resumed_while_its_dashboard_is_mute_is_braked_by_its_client() {
    let lines = [
        (1.91, "mute"),
        (1.989, "pause"),
        (2.211, "resume"),
        (2.224, "mend"),
    ];
    let outcome = played(
        lines.map(|(at, line)| (at, line.to_owned())).to_vec(),
        1,
        6.0,
    );
    let (way, until) = outcome.after_report(0.1);
    println!(
        "{:.3} mm after it was resumed, until {:.0} ms after the report",
        way * 1e3,
        until * 1e3
    );
    assert!(
        way < RESUMED_WAY && matches!(outcome.recovered, Some((_, Ok(Some(_))))),
        "{way} m"
    );
}

/// Times in a session without a fault, s: in its fastest link, in the search 50 ms before the ball
/// meets the surface, pressed, and on the way back.
fn moments() -> [(&'static str, f64); 4] {
    let free = played(Vec::new(), 1, 8.0).record;
    let later = || {
        free.iter()
            .filter(|moment| moment.time > 2.0 && moment.time < 7.0)
    };
    let first = |is_it: &dyn Fn(&&ModelSample) -> bool| later().find(is_it).unwrap().time;
    let link = later()
        .max_by(|a, b| a.speed.total_cmp(&b.speed))
        .unwrap()
        .time;
    let met = first(&|moment| moment.force > 0.0);
    let pressed = first(&|moment| moment.force > 2.0);
    let back = first(&|m| m.time > pressed && m.force == 0.0 && m.speed > 1e-3);
    [
        ("link", link),
        ("search", met - 0.05),
        ("pressed", pressed),
        ("back", back),
    ]
}

/// Detection takes two periods after the newest cycle, and one until the next state if the hang
/// falls between two states; then the brakes. Two periods for each cycle are no fault, three are.
#[test]
fn a_program_that_hangs_is_seen_in_the_state_after_two_periods_whatever_is_ordered() {
    let moments = moments();
    let hangs = moments.map(|(name, moment)| [("hung", name, moment), ("stuck", name, moment)]);
    let slow = ("slow 3", moments[1].0, moments[1].1);
    for (line, name, moment) in hangs.into_iter().flatten().chain([slow]) {
        let outcome = played(vec![(moment, line.to_owned())], 1, 8.0);
        let error = outcome.error.as_ref().map(ToString::to_string);
        let (seen, stood) = (outcome.at - moment, outcome.stood_at() - moment);
        let (seen, stood, peak) = (seen * 1e3, stood * 1e3, outcome.peak());
        println!("| {line} | {name} | {seen:.0} | {stood:.0} | {peak:.1} | {error:?} |");
        assert!(error.is_some_and(|error| error.contains("counted no cycle")));
        assert!(seen < 9.0 && stood < 20.0 && peak < 4.0, "{line}, {name}");
    }
    let slow = played(vec![(moments[0].1, "slow 2".to_owned())], 1, 8.0);
    assert!(slow.error.is_none(), "{:?}", slow.error);
}

/// A delay of 300 ms in the fastest link: 20 ms until the client brakes, and as many for polling,
/// order and braking. If the program hangs as well, only the guard notices.
#[test]
fn an_arm_whose_caller_is_held_up_stands_also_where_its_program_hangs() {
    let [(_, at), ..] = moments();
    let stands = |script: Vec<(f64, String)>| {
        let record = played(script, 1, 5.0).record;
        record
            .iter()
            .find(|moment| moment.time > at + 4e-3 && moment.speed == 0.0)
            .unwrap()
            .time
            - at
    };
    let hold = || (at, "hold 300".to_owned());
    let (held, both) = (
        stands(vec![hold()]),
        stands(vec![(at, "hung".to_owned()), hold()]),
    );
    println!(
        "held up: stands after {:.0} ms; its program hangs too: {:.0} ms",
        held * 1e3,
        both * 1e3
    );
    assert!(held < 0.07 && both < 0.02, "{held} s, {both} s");
}

/// One or two faults of any kind at any time; 10 scripts, in the slow proofs 200 of each of two
/// seeds.
#[test]
fn random_scripts_end_as_they_should() {
    let is_full = std::env::var_os("TOUCHUP_FULL").is_some();
    let (mut reported, mut touches, mut peak) = (0, 0, 0.0_f64);
    let (scripts, seeds) = if is_full { (200, 2) } else { (10, 1) };
    let mut wrong = Vec::new();
    for seed in 1..=seeds {
        let mut rng = Pcg64::seed_from_u64(seed);
        for number in 0..scripts {
            let faults = random_faults(&mut rng, 0.5, 5.0);
            let outcome = played(script_of(&faults), seed, 6.0);
            reported += usize::from(outcome.error.is_some());
            (touches, peak) = (touches + outcome.touches, outcome.peak().max(peak));
            let names: Vec<_> = faults
                .iter()
                .map(|(kind, at, length)| (kind.line, *at, *length))
                .collect();
            wrong.extend(
                judged(&faults, &outcome)
                    .map(|why| format!("seed {seed}, script {number}, {names:?}: {why}")),
            );
        }
    }
    println!(
        "| scripts | with a reported fault | touches | largest force, N | wrong |\n|---|---|---|---|---|"
    );
    println!(
        "| {} | {reported} | {touches} | {peak:.1} | {} |",
        scripts * seeds as usize,
        wrong.len()
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}
