//! Hours of touching, with a fault now and then and a recovery after each.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::chain::{Library, STEP, ScriptedArm, ScriptedChain};
use super::faults::{random_faults, script_of};
use super::live_bytes::live_bytes;
use super::session::{ProbingSession, limits};
use touchup_probing::arm::Arm;
use touchup_sim::Plate;

/// Time between the last event of a script and the recovery, s.
const QUIET: f64 = 0.3;
/// Maximum growth of memory from the first to the last quarter, for queues, bytes.
const FLAT: isize = 64 << 10;

/// One hour of the arm's time.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn hours_of_faults_and_recoveries_leave_no_stuck_state_and_no_memory_behind() {
    let end = 3600.0;
    let mut rng = Pcg64::seed_from_u64(22);
    let plate = Plate::default();
    let world = ScriptedChain::new(&plate, Vec::new(), 22);
    let library = Library(&world);
    let mut session = ProbingSession::new(&world, ScriptedArm::connect(&world, &library).unwrap());
    let (mut faults, mut reported, mut recoveries, mut peak) = (0, 0, 0, 0.0_f64);
    let (mut first, mut last) = (0, 0);
    let mut recent = Vec::new();
    while world.now() < end {
        if world.script.borrow().is_empty() {
            let from = world.now() + 0.5;
            let next = random_faults(&mut rng, from, from + 15.0);
            faults += next.len();
            recent = script_of(&next);
            world.script.borrow_mut().extend(script_of(&next));
        }
        // an unnoticed payload would enter this zero, and its weight would bias the force after the
        // next recovery
        world
            .script
            .borrow_mut()
            .push_front((world.now(), "payload 0.25".to_owned()));
        let until = world.now() + rng.random_range(5.0..20.0);
        if let Err(error) = session.probe(until) {
            reported += 1;
            let at = world.now();
            while !world.script.borrow().is_empty() || world.now() < at + QUIET {
                session.arm.step();
            }
            // the arm has stood since, whatever else has happened
            let quiet_since = world.now() - 0.05;
            let moved = |moment: &&super::chain::ModelSample| {
                moment.time > quiet_since && moment.speed > 0.0
            };
            let way: f64 = world
                .record
                .borrow()
                .iter()
                .filter(moved)
                .map(|m| m.speed * STEP.as_secs_f64())
                .sum();
            assert!(
                way == 0.0,
                "at {at:.1} s it still moves, {:.3} mm, after: {error}",
                way * 1e3
            );
            session
                .arm
                .recover()
                .unwrap_or_else(|why| panic!("at {at:.1} s, after `{error}`: {why}"));
            let found = session
                .go_on()
                .unwrap_or_else(|why| panic!("{recent:?}, at {at:.1} s, `{error}`: {why}"));
            assert!(
                found.is_some_and(|off| off.abs() < 0.1e-3),
                "at {at:.1} s, after `{error}`: {found:?}"
            );
            recoveries += 1;
        }
        peak = world
            .record
            .borrow()
            .iter()
            .map(|moment| moment.force)
            .fold(peak, f64::max);
        world.record.borrow_mut().clear();
        let bytes = live_bytes();
        match world.now() / end {
            share if share < 0.25 => first = first.max(bytes),
            share if share > 0.75 => last = last.max(bytes),
            _ => {}
        }
    }
    let touches = session.touches;
    let hours = world.now() / 3600.0;
    let table = format!(
        "| hours of the arm | faults | reported | recoveries | touches | largest force, N | most bytes in the first and \
         the last quarter |\n|---|---|---|---|---|---|---|\n| {hours:.2} | {faults} | {reported} | {recoveries} | \
         {touches} | {peak:.1} | {first}, {last} |\n"
    );
    println!("{table}");
    assert!(
        reported > 5 && touches > 10 && peak <= 1.5 * limits().force,
        "{table}"
    );
    assert!(last - first < FLAT, "{table}");
}
