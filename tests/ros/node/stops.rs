//! The table of stops in docs/ros.md, line by line: during any work of the node, a stop reaches a
//! moving arm within one of its periods.
//!
//! In all of them the thread of the samples takes nothing, and its full queue refuses samples, at
//! the time of the stop.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Vector3};
use touchup::clock::Clock;
use touchup::mesh::TriMesh;
use touchup::node::{ArmKind, ArmOfNode};
use touchup::probing::arm::{Arm, ArmError, ArmState, Command};
use touchup::ros::in_process::OtherParticipants;
use touchup::ros::messages::{Feature, ProbeResponse, ProbeResult, ProbeSettings, UndoRequest};
use touchup::ros::parameters::ParameterValue;
use touchup::ros::port::{Arrival, Call, GoalEnd, Reply};
use touchup::sim::ArmParams;
use touchup::stylus::{Message, StampedPose};

use super::cell::{Cell, HUNG, Lossy, SimulatedArm};
use super::samples::bench::in_frame;

/// Number of states of a measured speed.
const SPAN: usize = 10;
/// From a command to the motion, s, and from one state to the next.
const LATENCY: f64 = 6e-3;
const PERIOD: f64 = 2e-3;
/// With which the arm brakes, m/s²: `fault_stop_mm_per_s2` of the scene.
const BRAKES: f64 = 5.0;
/// Least way of a search, m, after which the arm reaches this speed on the way back, m/s.
const DEEP: f64 = 1e-3;
const BACK: f64 = 5e-3;
/// Six times the noise of a place, m.
const NOISE: f64 = 60e-6;

/// An event from others in the graph, or a signal; returns whether its answer came at once, true
/// for one without an answer.
type Event = fn(&OtherParticipants, &AtomicBool) -> bool;

fn pause(world: &OtherParticipants, _: &AtomicBool) -> bool {
    world.stops().pause(true).success
}

fn stop(world: &OtherParticipants, _: &AtomicBool) -> bool {
    world.stops().stop().success
}

fn forbid(world: &OtherParticipants, _: &AtomicBool) -> bool {
    let (to, answer) = sync_channel(1);
    let reply = Reply::new(move |said| drop(to.send(said)));
    world.arrive(Arrival::SetParameter(
        "allow_motion".to_owned(),
        ParameterValue::Bool(false),
        reply,
    ));
    answer.try_recv() == Ok(Ok(()))
}

fn interrupt(world: &OtherParticipants, _: &AtomicBool) -> bool {
    world.arrive(Arrival::Shutdown)
}

fn cancel(_: &OtherParticipants, is_cancelled: &AtomicBool) -> bool {
    is_cancelled.store(true, Ordering::Release);
    true
}

/// States of the arm and its commands, in order.
#[derive(Clone, Copy)]
enum Note {
    /// the place of the ball in B, m
    State(Vector3<f64>),
    Told(Command),
    Event,
}

/// When something happens.
#[derive(Clone, Copy)]
enum When {
    /// the ball is on its way to the surface, off the start of the search
    Searching,
    /// it is on its way back
    Retracting,
}

type Happens = Box<dyn FnOnce() + Send>;

/// A simulated arm that notes its commands; in the midst of its motions something happens.
struct NotedArm {
    arm: SimulatedArm,
    notes: Arc<Mutex<Vec<Note>>>,
    events: Vec<(When, Happens)>,
}

impl NotedArm {
    /// Whether the moment has come.
    fn is_time(&self, when: When) -> bool {
        let notes = self.notes.lock().unwrap();
        let told = |note: &Note| {
            if let Note::Told(command) = note {
                Some(*command)
            } else {
                None
            }
        };
        let places: Vec<_> = notes.iter().rev().filter_map(place).take(SPAN).collect();
        let Some(command) = notes
            .iter()
            .rev()
            .find_map(told)
            .filter(|_| places.len() == SPAN)
        else {
            return false;
        };
        let speed = (places[0] - places[SPAN - 1]).norm() / (PERIOD * (SPAN - 1) as f64);
        match (when, command) {
            (When::Searching, Command::Velocity { linear, .. }) => {
                let is_same = |note: &&Note| told(note).is_none_or(|told| told == command);
                let begun = notes
                    .iter()
                    .rev()
                    .take_while(is_same)
                    .filter_map(place)
                    .last();
                begun.is_some_and(|begun| {
                    (places[0] - begun).norm() > DEEP && speed > 0.7 * linear.norm()
                })
            }
            (When::Retracting, Command::Line { .. }) => speed > BACK,
            _ => false,
        }
    }
}

fn place(note: &Note) -> Option<Vector3<f64>> {
    if let Note::State(place) = note {
        Some(*place)
    } else {
        None
    }
}

impl Arm for NotedArm {
    /// The event comes after the measurement of the state, and before the node has it.
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        let state = self.arm.next_state()?;
        self.notes
            .lock()
            .unwrap()
            .push(Note::State(state.pose_bt.translation.vector));
        if self
            .events
            .first()
            .is_some_and(|(when, _)| self.is_time(*when))
        {
            self.notes.lock().unwrap().push(Note::Event);
            (self.events.remove(0).1)();
        }
        Ok(state)
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        self.notes.lock().unwrap().push(Note::Told(*command));
        self.arm.command(command)
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        self.arm.zero_sensor()
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        self.arm.recover()
    }

    fn period(&self) -> f64 {
        self.arm.period()
    }
}

/// Keeps the thread of the samples busy until the sender sends or drops, and fills the queue of
/// samples.
fn block(world: &OtherParticipants, clock: &Clock) -> SyncSender<()> {
    let (release, released): (_, Receiver<()>) = sync_channel(1);
    let (enters, entered) = sync_channel(1);
    let waiting = clock.clone();
    let busy = Reply::new(move |_| {
        enters.send(()).unwrap();
        let _ = waiting.recv_timeout(&released, Duration::from_secs(1_000_000));
    });
    assert!(world.arrive_patiently(Arrival::Call(Call::Undo(UndoRequest { strokes: 1 }, busy))));
    entered.recv().unwrap();
    let pose = StampedPose {
        stamp_ns: 0,
        pose_ot: Isometry3::identity(),
    };
    let pose = in_frame(&Message::Pose(pose), "");
    while world.arrive(Arrival::Message(pose.clone(), clock.now())) {}
    release
}

/// The end of a goal with an event, and the notes of the arm.
struct Ended {
    cell: Cell,
    end: GoalEnd,
    response: ProbeResponse,
    notes: Vec<Note>,
}

/// A goal; the first event comes when the ball is on its way to the surface, the second when it is
/// on its way back.
fn probe_with(events: &[Event]) -> Ended {
    let notes = Arc::new(Mutex::new(Vec::new()));
    let is_cancelled = Arc::new(AtomicBool::new(false));
    let release = Arc::new(Mutex::new(None));
    let cell = Cell::on(true, |clock, world| {
        let happens = |(event, when): (&Event, When)| {
            let (event, world, clock) = (*event, world.clone(), clock.clone());
            let (is_cancelled, release) = (Arc::clone(&is_cancelled), Arc::clone(&release));
            let happens: Happens = Box::new(move || {
                release
                    .lock()
                    .unwrap()
                    .get_or_insert_with(|| block(&world, &clock));
                assert!(event(&world, &is_cancelled), "it is answered at once");
            });
            (when, happens)
        };
        let events = events
            .iter()
            .zip([When::Searching, When::Retracting])
            .map(happens)
            .collect();
        let arm = NotedArm {
            arm: SimulatedArm::new(clock),
            notes: Arc::clone(&notes),
            events,
        };
        let samples = Lossy {
            world: world.clone(),
            clock: clock.clone(),
        };
        ArmOfNode {
            kind: ArmKind::Real(Box::new(arm)),
            samples: Box::new(samples),
        }
    });
    let id = cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]);
    let (end, response) = cell.send_goal(&[id], is_cancelled, |_| {});
    // the thread of the samples goes on
    let blocked = release.lock().unwrap().take();
    drop(blocked.expect("something happened"));
    let notes = notes.lock().unwrap().clone();
    Ended {
        cell,
        end,
        response,
        notes,
    }
}

impl Ended {
    /// Notes after the event of this number.
    fn since(&self, event: usize) -> &[Note] {
        let mut events = self
            .notes
            .iter()
            .enumerate()
            .filter(|(_, note)| matches!(note, Note::Event));
        let (at, _) = events.nth(event).expect("it happened");
        &self.notes[at + 1..]
    }

    /// The arm receives the stop before it gives another state, and goes no farther than braking
    /// needs.
    fn assert_it_stops(&self, event: usize) {
        let since = self.since(event);
        let first = since
            .iter()
            .find(|note| !matches!(note, Note::Event))
            .unwrap();
        assert!(
            matches!(first, Note::Told(Command::Stop { deceleration }) if *deceleration == BRAKES)
        );
        let before = &self.notes[..self.notes.len() - since.len()];
        let places: Vec<_> = before.iter().rev().filter_map(place).take(SPAN).collect();
        let went = (places[0] - places[SPAN - 1]) / (PERIOD * (SPAN - 1) as f64);
        // the noise of two places enters the speed
        let speed = went.norm() + 2.0 * NOISE / (PERIOD * SPAN as f64);
        let braking = speed * (LATENCY + 2.0 * PERIOD) + speed * speed / (2.0 * BRAKES) + NOISE;
        let along = |place: Vector3<f64>| (place - places[0]).dot(&went.normalize());
        let farthest = since
            .iter()
            .filter_map(place)
            .map(along)
            .fold(0.0, f64::max);
        assert!(
            farthest <= braking,
            "{:.3} mm on, {:.3} mm to brake",
            farthest * 1e3,
            braking * 1e3
        );
    }

    /// Nothing moves the arm any more.
    fn assert_it_stays(&self, event: usize) {
        self.assert_it_stops(event);
        let since = self.since(event);
        assert!(since.iter().all(|note| matches!(
            note,
            Note::State(..) | Note::Event | Note::Told(Command::Stop { .. })
        )));
    }

    /// The ball is in free air again.
    fn assert_it_is_out(&self) {
        let last = self.notes.iter().rev().find_map(place).unwrap();
        let height = ArmParams::default()
            .pose_bo
            .inverse_transform_point(&last.into())
            .z;
        assert!(height > 14e-3, "it is {:.1} mm high", height * 1e3);
    }

    fn assert_ended(&self, end: GoalEnd, code: u8, why: &str) {
        assert_eq!(
            (self.end, self.response.code),
            (end, code),
            "{}",
            self.response.message
        );
        assert!(
            self.response.message.contains(why),
            "{}",
            self.response.message
        );
    }
}

#[test]
fn each_event_stops_a_moving_arm_within_a_period_and_it_retracts() {
    let events: [(Event, GoalEnd, u8, &str); 4] = [
        (
            pause,
            GoalEnd::Aborted,
            ProbeResult::CANCELLED,
            "the node is paused",
        ),
        (
            forbid,
            GoalEnd::Aborted,
            ProbeResult::CANCELLED,
            "allow_motion is off",
        ),
        (
            interrupt,
            GoalEnd::Aborted,
            ProbeResult::SHUTDOWN,
            "the node ends",
        ),
        (
            cancel,
            GoalEnd::Canceled,
            ProbeResult::CANCELLED,
            "stopped and retracted",
        ),
    ];
    for (event, end, code, why) in events {
        let ended = probe_with(&[event]);
        ended.assert_it_stops(0);
        ended.assert_it_is_out();
        ended.assert_ended(end, code, why);
        ended.cell.end();
    }
}

#[test]
fn a_call_of_stop_stops_a_moving_arm_within_a_period_and_it_stays_until_it_is_recovered() {
    let ended = probe_with(&[stop]);
    ended.assert_it_stays(0);
    ended.assert_ended(
        GoalEnd::Aborted,
        ProbeResult::STOPPED_IN_PLACE,
        "~/stop was called: cancelled: the arm stopped and stays",
    );
    let Ended { cell, .. } = ended;
    let (is_ready, why) = cell.state();
    assert!(
        !is_ready && why.contains("~/stop was called; look, then call ~/recover"),
        "{why}"
    );
    let id = cell.flag(Feature::KIND_HOLE, [32.0, 34.5, 12.0]);
    let refused = cell.probe(id, ProbeSettings::default());
    assert_eq!(
        refused.code,
        ProbeResult::ARM_NOT_READY,
        "{}",
        refused.message
    );
    assert!(cell.recover().0 && cell.state().0, "{}", cell.state().1);
    cell.end();
}

#[test]
fn a_retraction_goes_on_at_a_pause_a_cancel_and_the_first_signal() {
    let events: [(Event, GoalEnd, u8); 3] = [
        (pause, GoalEnd::Canceled, ProbeResult::CANCELLED),
        (cancel, GoalEnd::Canceled, ProbeResult::CANCELLED),
        (interrupt, GoalEnd::Aborted, ProbeResult::SHUTDOWN),
    ];
    for (event, end, code) in events {
        let ended = probe_with(&[cancel, event]);
        ended.assert_it_stops(0);
        assert!(ended.since(1).len() > SPAN, "it happened on the way back");
        ended.assert_it_is_out();
        ended.assert_ended(end, code, "stopped and retracted");
        ended.cell.end();
    }
}

#[test]
fn a_retraction_stops_and_stays_at_a_stop_a_second_signal_and_where_motion_is_forbidden() {
    let events: [([Event; 2], &str); 4] = [
        ([cancel, stop], "~/stop was called"),
        (
            [cancel, forbid],
            "allow_motion was taken away while the arm retracted",
        ),
        (
            [forbid, forbid],
            "allow_motion was taken away while the arm retracted",
        ),
        (
            [interrupt, interrupt],
            "the end of the node was asked for again",
        ),
    ];
    for (events, why) in events {
        let ended = probe_with(&events);
        ended.assert_it_stops(0);
        ended.assert_it_stays(1);
        ended.assert_ended(GoalEnd::Aborted, ProbeResult::STOPPED_IN_PLACE, why);
        assert!(
            ended.response.message.contains("stays where it is"),
            "{}",
            ended.response.message
        );
        ended.cell.end();
    }
}

#[test]
fn an_arm_at_rest_that_was_stopped_begins_nothing() {
    let cell = Cell::start(true);
    let id = cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]);
    assert!(cell.world.stops().stop().success);
    assert_eq!(
        cell.probe(id, ProbeSettings::default()).code,
        ProbeResult::ARM_NOT_READY
    );
    assert!(cell.recover().0);
    let few = ProbeSettings {
        max_touches: 3,
        ..ProbeSettings::default()
    };
    assert_eq!(cell.probe(id, few).code, ProbeResult::NOTHING_FOUND);
    cell.end();
}

#[test]
fn without_an_arm_s_thread_the_answers_say_so() {
    // there is nothing to touch, so it ends at once
    let empty = TriMesh::new(Vec::new(), Vec::new()).unwrap();
    let cell = Cell::begin(true, |_, world| ArmOfNode {
        kind: ArmKind::Sim(Box::new(empty)),
        samples: Box::new(world.clone()),
    });
    let begun = Instant::now();
    while cell.world.stops().heard().is_ok() {
        assert!(begun.elapsed() < HUNG, "it runs");
        std::thread::yield_now();
    }
    let said = [
        (
            cell.world.stops().stop().success,
            cell.world.stops().stop().message,
        ),
        (
            cell.world.stops().pause(true).success,
            cell.world.stops().pause(true).message,
        ),
        cell.state(),
        cell.recover(),
    ];
    for (success, message) in said {
        assert!(
            !success
                && message.contains("the arm's thread has ended")
                && message.contains("no part to touch"),
            "{message}"
        );
    }
    let id = cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]);
    assert_eq!(
        cell.probe(id, ProbeSettings::default()).code,
        ProbeResult::ARM_NOT_READY
    );
    cell.end();
}
