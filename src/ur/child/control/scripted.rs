//! The whole chain in one process and one thread: a watched arm, orders, driver, library, the model of the controller that the
//! stand-in puts on the wire, states, guard and dashboard. All go by the clock of the model, and faults happen at the moments of a script.
//!
//! What is judged is the model's own record. While the driver is in a call of its library the caller orders nothing.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::clock::ManualClock;
use crate::probing::arm::{
    Arm, ArmError, ArmState, Command, Limits, Observer, ProbeError, Safety, TouchParams, TouchTarget, Watched,
};
use crate::stylus::Payload;
use crate::ur::UrParams;
use crate::ur::arm::{PERIOD, order_of, seen};
use crate::ur::child::states::LastReport;
use crate::ur::freshness::Freshness;
use crate::ur::guard::{ClientLoss, GuardState};
use crate::ur::params::Deadlines;
use crate::ur::protocol::{ProgramState, vector_of};
use touchup::sim::{ArmParams, Plate, WEIGHTLESS};

#[path = "../../../../examples/ur_controller/model/mod.rs"]
#[expect(dead_code, reason = "what the wire alone needs")]
mod model;

use model::body::Body;
use model::controller::{Controller, Written};
use model::panel::{answer, happen};
use model::record::Record;
use model::states::States;

const STEP: Duration = Duration::from_millis(2);
/// A call waits so long for a program that is ready.
const READY: Duration = Duration::from_secs(3);
/// Top of the plate, m in O.
const TOP: f64 = 12e-3;
/// Without a dashboard the arm stands within this, s: the watchdog of the controller, and its brakes.
const WATCHDOG: f64 = 0.12;
/// Where the dashboard is mute, the most that a resumed arm goes before it is braked, m.
const MUTE_WAY: f64 = 2e-3;

/// A moment of the model.
#[derive(Clone, Copy)]
struct Moment {
    /// s
    time: f64,
    /// m/s and rad/s together
    speed: f64,
    /// of the part, N
    force: f64,
}

struct World<'a> {
    controller: RefCell<Controller<'a>>,
    hand: ManualClock,
    clock: Clock,
    shared: ChildShared,
    said: Arc<Mutex<VecDeque<ClientReport>>>,
    guard: RefCell<GuardState>,
    last_report: RefCell<LastReport>,
    /// when the guard took a line
    heard: Cell<Instant>,
    /// the newest states that the library has
    states: RefCell<States>,
    script: RefCell<VecDeque<(f64, String)>>,
    record: RefCell<Vec<Moment>>,
    is_dropped: Cell<bool>,
    has_dashboard: Cell<bool>,
    is_killed: Cell<bool>,
}

impl<'a> World<'a> {
    fn new(surface: &'a Plate, script: Vec<(f64, String)>, seed: u64) -> Self {
        let (clock, hand) = Clock::manual();
        let payload = Payload { mass: 0.25, p_sc: Vector3::new(0.0, 0.0, 0.05), ..WEIGHTLESS };
        let params = ArmParams { payload, seed, ..ArmParams::default() };
        let body = Body::new(surface, params, Point3::new(45e-3, 8e-3, 25e-3)).unwrap();
        let mut controller = Controller::new(body, [5, 15, 0], Record::new(None).unwrap());
        controller.owner = Some(0);
        controller.load("def rtde_control");
        let states = States::read(&mut controller);
        let said = Arc::new(Mutex::new(VecDeque::new()));
        let sink = said.clone();
        Self {
            controller: RefCell::new(controller),
            shared: ChildShared::new(move |report| sink.lock().unwrap().push_back(report.clone())),
            said,
            guard: RefCell::new(GuardState::new(Deadlines::default(), clock.now())),
            last_report: RefCell::new(LastReport { stamp_s: f64::INFINITY, at: clock.now() }),
            heard: Cell::new(clock.now()),
            states: RefCell::new(states),
            script: RefCell::new(script.into()),
            record: RefCell::default(),
            is_dropped: Cell::new(false),
            has_dashboard: Cell::new(true),
            is_killed: Cell::new(false),
            clock,
            hand,
        }
    }

    fn now(&self) -> f64 {
        self.controller.borrow().body.time
    }

    /// The next line of the script, where its time has come.
    fn due(&self, now: f64) -> Option<String> {
        let mut script = self.script.borrow_mut();
        let is_due = script.front().is_some_and(|(at, _)| *at <= now);
        is_due.then(|| script.pop_front()).flatten().map(|(_, line)| line)
    }

    /// One period of the controller, and what follows from it at once.
    fn step(&self) {
        self.hand.advance(STEP);
        let mut controller = self.controller.borrow_mut();
        while let Some(line) = self.due(controller.body.time) {
            happen(&mut controller, &line);
            self.is_dropped.set(self.is_dropped.get() || line == "drop" || line == "die");
            self.has_dashboard.set(self.has_dashboard.get() && line != "undash" && line != "die");
        }
        controller.tick();
        let [linear, angular] = controller.body.velocity();
        let speed = linear.norm() + angular.norm();
        self.record.borrow_mut().push(Moment {
            time: controller.body.time,
            speed,
            force: controller.body.true_force(),
        });
        let mut newest = None;
        while let Some(states) = controller.sent() {
            newest = Some(states);
        }
        drop(controller);
        if self.is_killed.get() {
            return;
        }
        if self.is_dropped.get() {
            return self.take(ClientReport::Lost { which: Link::States });
        }
        let state = newest.map(|states| {
            let state = self.state_of(&states);
            *self.states.borrow_mut() = states;
            self.shared.see(state, self.clock.now());
            state
        });
        let report = self.last_report.borrow_mut().next(state, self.shared.number(), self.clock.now());
        let said: Vec<_> = self.said.lock().unwrap().drain(..).collect();
        said.into_iter().chain(report).for_each(|report| self.take(report));
        self.look();
    }

    fn state_of(&self, states: &States) -> UrState {
        UrState {
            stamp_s: states.time,
            pose: states.pose,
            velocity: states.speed,
            wrench: states.force,
            raw_wrench: states.raw,
            joints: states.q,
            safety_bits: states.safety_bits,
            speed_fraction: states.speed_fraction,
            program: match (states.is_paused, states.is_playing) {
                (true, _) => ProgramState::Paused,
                (_, true) => ProgramState::Playing,
                _ => ProgramState::Ended,
            },
            served: self.shared.number(),
        }
    }

    /// The guard takes a line, as its thread does.
    fn take(&self, report: ClientReport) {
        self.heard.set(self.clock.now());
        let mut guard = self.guard.borrow_mut();
        let is_to_be_ended = matches!(&report, ClientReport::State(state) if guard.is_to_be_ended(state));
        let broken = guard.take(report, self.clock.now());
        drop(guard);
        if is_to_be_ended {
            self.stop();
        }
        if let Some(broken) = broken {
            self.break_off(broken);
        }
    }

    /// … and looks at its deadline and its dashboard.
    fn look(&self) {
        let late = self.clock.since(self.heard.get()) > self.guard.borrow().patience(self.clock.now());
        if late {
            let missed = self.guard.borrow().missed();
            self.break_off(missed);
        } else if !self.has_dashboard.get() {
            self.break_off(ClientLoss::Arm(ArmError::Dropped { what: "its dashboard" }));
        }
    }

    fn break_off(&self, broken: ClientLoss) {
        if !self.is_killed.replace(true) {
            self.guard.borrow_mut().broken = Some(broken);
            self.stop();
        }
    }

    fn stop(&self) {
        let mut controller = self.controller.borrow_mut();
        let faults = controller.faults;
        if !faults.is_mute && !faults.is_unplugged && !faults.is_dead {
            answer(&mut controller, "stop");
        }
    }
}

/// The library: it looks at the newest states it has, waits for a program that is ready, and writes registers.
struct Library<'a, 'b>(&'b World<'a>);

impl Library<'_, '_> {
    fn may_send(&self) -> bool {
        let states = self.0.states.borrow();
        let is_stopped = states.safety_bits & (1 << 2 | 1 << 7) != 0;
        !self.0.is_killed.get() && !self.0.is_dropped.get() && states.is_playing && !is_stopped
    }

    /// Until the program has answered with a number.
    fn until(&self, answered: i32) -> bool {
        let begun = self.0.clock.now();
        while self.may_send() && self.0.clock.since(begun) < READY {
            if self.0.states.borrow().ints[0] == answered {
                return true;
            }
            self.0.step();
        }
        false
    }

    fn send(&self, id: i32, ints: &[i32], doubles: &[f64]) -> Result<(), ChildError> {
        let is_realtime = matches!(id, 6 | 10);
        let mut is_done = self.until(1);
        if is_done {
            let doubles = doubles.iter().enumerate().map(|(at, value)| Written::Double(at, *value));
            let ints = (1..).zip(ints).map(|(at, value)| Written::Int(at, *value));
            self.0.controller.borrow_mut().write(doubles.chain(ints).chain([Written::Int(0, id)]).collect());
            if !is_realtime {
                is_done = self.until(2);
                self.0.controller.borrow_mut().write(vec![Written::Int(0, 0)]);
            }
        }
        is_done.then_some(()).ok_or(ChildError::Python { call: "a call", reason: "it returned false".to_owned() })
    }
}

impl Control for Library<'_, '_> {
    fn is_connected(&self) -> bool {
        !self.0.is_dropped.get()
    }

    fn is_running(&self) -> bool {
        self.0.states.borrow().is_playing
    }

    fn speed(&self, twist: [f64; 6], acceleration: f64) -> Result<(), ChildError> {
        self.send(10, &[], &[&twist[..], &[acceleration, 2e-3]].concat())
    }

    fn press(&self, frame: [f64; 6], force: f64, kind: i32, limits: [f64; 6]) -> Result<(), ChildError> {
        let wrench = [0.0, 0.0, force, 0.0, 0.0, 0.0];
        self.send(6, &[kind, 0, 0, 1, 0, 0, 0], &[frame, wrench, limits].concat())
    }

    fn end_press(&self) -> Result<(), ChildError> {
        self.send(7, &[], &[])
    }

    fn hard_stop(&self, deceleration: f64) -> Result<(), ChildError> {
        self.send(15, &[], &[deceleration])
    }

    fn zero(&self) -> Result<(), ChildError> {
        self.send(8, &[], &[])
    }

    fn set_payload(&self, mass: f64, centre: [f64; 3]) -> Result<(), ChildError> {
        self.send(17, &[], &[&[mass][..], &centre].concat())
    }

    fn set_tool(&self, tool: [f64; 6]) -> Result<(), ChildError> {
        self.send(29, &[], &tool)
    }

    fn tool(&self) -> Result<[f64; 6], ChildError> {
        self.send(40, &[], &[])?;
        Ok(self.0.states.borrow().doubles[..6].try_into().unwrap())
    }

    fn set_force_mode(&self, damping: f64, gain: f64) -> Result<(), ChildError> {
        self.send(20, &[], &[damping])?;
        self.send(21, &[], &[gain])
    }

    fn set_watchdog(&self, least_hz: f64) -> Result<(), ChildError> {
        self.send(35, &[], &[least_hz])
    }

    fn feed(&self) -> Result<(), ChildError> {
        self.until(1);
        self.0.controller.borrow_mut().write(vec![Written::Int(0, 0)]);
        Ok(())
    }

    fn end_program(&self) -> Result<(), ChildError> {
        self.0.controller.borrow_mut().write(vec![Written::Int(0, 255)]);
        Ok(())
    }

    fn wait(&self, clock: &Clock, time: Duration) {
        let begun = clock.now();
        while clock.since(begun) < time {
            if self.0.is_killed.get() {
                self.0.hand.advance(time);
            } else {
                self.0.step();
            }
        }
    }
}

/// An arm behind driver and guard.
struct ScriptedArm<'a, 'b> {
    world: &'b World<'a>,
    driver: Driver<'b, Library<'a, 'b>>,
    params: UrParams,
    freshness: Freshness,
    last: UrState,
    waiting: Vec<Order>,
    looked: Instant,
}

impl ScriptedArm<'_, '_> {
    fn broken(&self) -> Result<(), ArmError> {
        let guard = self.world.guard.borrow();
        if let Some(broken) = &guard.broken {
            return Err(broken.error());
        }
        if guard.has_ended(self.world.clock.now()) { Err(guard.ended()) } else { Ok(()) }
    }

    fn send(&mut self, what: Action) -> u64 {
        let number = self.world.guard.borrow_mut().send(&what, self.world.clock.now());
        self.waiting.push(Order { number, what });
        number
    }

    /// One period, with what the driver does in it.
    fn step(&mut self) {
        self.world.step();
        if self.world.is_killed.get() {
            return;
        }
        let zero = self.waiting.iter().position(|order| order.what == Action::Zero);
        let taken = zero.map_or(self.waiting.len(), |at| at + 1);
        let order = self.waiting.drain(..taken).next_back();
        let is_due = self.world.clock.since(self.looked) >= TURN;
        if order.is_some() || is_due {
            self.looked = self.world.clock.now();
            // a lost connection is seen by the guard
            let _ = self.driver.turn(order);
        }
    }
}

impl Arm for ScriptedArm<'_, '_> {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        loop {
            self.broken()?;
            let next = self.world.guard.borrow_mut().states.pop_front();
            if let Some(state) = next {
                self.last = state;
                return Ok(seen(&state));
            }
            self.step();
        }
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        let (safety, is_stop) = (self.last.safety(), matches!(command, Command::Stop { .. }));
        if safety != Safety::Normal && !is_stop {
            return Err(ArmError::Stopped { safety });
        }
        let order = order_of(command, &self.last, &self.params)?;
        let newest_s = self.world.guard.borrow().newest_s;
        if is_stop || self.freshness.may_send(self.last.stamp_s, newest_s)? {
            self.broken()?;
            self.send(order);
        }
        Ok(())
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        let number = self.send(Action::Zero);
        while self.world.guard.borrow().done < number {
            self.broken()?;
            self.step();
        }
        self.world.guard.borrow_mut().states.clear();
        Ok(())
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        Err(ArmError::Refused { what: "to recover", reason: "a script ends with its arm".to_owned() })
    }

    fn period(&self) -> f64 {
        PERIOD
    }

    fn slowed(&self) -> Option<crate::probing::arm::Slowed> {
        self.last.slowed()
    }
}

struct Blind;

impl Observer for Blind {
    fn on_state(&mut self, _: &ArmState) {}
}

/// What came of a script.
struct Outcome {
    error: Option<ProbeError>,
    /// when it was reported, s
    at: f64,
    touches: usize,
    record: Vec<Moment>,
}

impl Outcome {
    /// The last moment at which the arm moved, s.
    fn stood_at(&self) -> f64 {
        self.record.iter().rfind(|moment| moment.speed > 0.0).map_or(0.0, |moment| moment.time)
    }

    /// How far it went later than some time (s) after the report, m; and until when after it, s.
    fn after_report(&self, since: f64) -> (f64, f64) {
        let later = self.record.iter().filter(|moment| moment.time > self.at + since);
        let way = later.map(|moment| moment.speed * STEP.as_secs_f64()).sum();
        (way, self.stood_at() - self.at)
    }

    fn peak(&self) -> f64 {
        self.record.iter().map(|moment| moment.force).fold(0.0, f64::max)
    }
}

fn limits() -> Limits {
    Limits { lowest: Point3::new(-0.6, -0.3, 0.0), highest: Point3::new(-0.2, 0.2, 0.4), ..Limits::default() }
}

/// Touches here and there on the plate with links between, for some seconds; after a fault nobody orders anything for two.
fn played(script: Vec<(f64, String)>, seed: u64, seconds: f64) -> Outcome {
    let plate = Plate::default();
    let world = World::new(&plate, script, seed);
    let library = Library(&world);
    let params = UrParams::new("", "");
    let begin = Begin {
        host: String::new(),
        site_packages: Default::default(),
        tool: vector_of(&params.pose_ft),
        mass_kg: params.mass,
        centre_m: params.centre.into(),
        damping: params.damping,
        gain: params.gain,
        is_lock_step: false,
    };
    (0..20).for_each(|_| world.step());
    let mut driver = Driver::new(&library, &world.shared, &begin, world.clock.clone());
    driver.prepare().unwrap();
    world.shared.is_ready.store(true, Ordering::Release);
    world.shared.report(&ClientReport::Ready);
    // states of before have the pose of another tool
    world.step();
    let last = world.state_of(&world.states.borrow());
    let looked = world.clock.now();
    let mut arm = ScriptedArm {
        world: &world,
        driver,
        params,
        freshness: Freshness::default(),
        last,
        waiting: Vec::new(),
        looked,
    };
    let (mut touches, touch) = (0, TouchParams::default());
    let mut probe = |arm: &mut ScriptedArm| -> Result<(), ProbeError> {
        let mut observer = Blind;
        let mut watched = Watched::new(arm, limits(), &mut observer);
        watched.zero()?;
        for place in [[45e-3, 8e-3], [8e-3, 6e-3]].iter().cycle() {
            let [x, y] = *place;
            let standoff = ArmParams::default().pose_bo * Point3::new(x, y, TOP + 5e-3);
            let standoff_bt = Isometry3::from_parts(standoff.coords.into(), UnitQuaternion::identity());
            let target = TouchTarget { standoff_bt, direction: -Vector3::z_axis(), search: 8e-3, expected: None };
            watched.touch(&target, &touch)?;
            touches += 1;
            if world.now() > seconds {
                break;
            }
        }
        Ok(())
    };
    let error = probe(&mut arm).err();
    let at = world.now();
    while world.now() < at + 2.0 {
        arm.step();
    }
    drop(arm);
    Outcome { error, at, touches, record: world.record.take() }
}

/// A kind of fault.
struct Kind {
    line: &'static str,
    /// what ends it; empty: nothing
    ends: &'static str,
    /// the arm stands within this time where it lasts as long, s; `None`: it may go on, or is seen by its next order
    stands: Option<f64>,
    /// words of the reasons that are true
    reasons: &'static [&'static str],
}

/// The end of a program by its watchdog, of orders that do not arrive.
const UNHEARD: &[&str] =
    &["has ended", "has not returned", "are ordered", "refused a call", "has come", "did not arrive"];

/// The same where the thread of the motion lives: a press goes on until its force is over the limit.
const STILL_PRESSING: &[&str] =
    &["has ended", "has not returned", "are ordered", "refused a call", "has come", "did not arrive", "over the limit"];

const KINDS: &[Kind] = &[
    Kind { line: "pause", ends: "resume", stands: Some(0.05), reasons: &["was paused"] },
    Kind { line: "open", ends: "shut", stands: Some(0.05), reasons: &["by the operator", "was paused"] },
    Kind { line: "protective", ends: "", stands: Some(0.05), reasons: &["protective stop"] },
    Kind { line: "operator", ends: "release", stands: Some(0.05), reasons: &["by the operator", "has ended"] },
    Kind { line: "halt", ends: "", stands: Some(0.05), reasons: &["has ended"] },
    Kind { line: "off", ends: "", stands: Some(0.05), reasons: &["has ended"] },
    Kind { line: "local", ends: "", stands: Some(0.05), reasons: &["has ended"] },
    Kind { line: "drop", ends: "", stands: Some(0.05), reasons: &["was closed"] },
    Kind { line: "undash", ends: "", stands: Some(0.05), reasons: &["was closed"] },
    Kind { line: "die", ends: "", stands: Some(0.05), reasons: &["was closed"] },
    Kind { line: "silent", ends: "mend", stands: Some(0.2), reasons: &["has come", "states came", "has not returned"] },
    Kind { line: "unplug", ends: "mend", stands: Some(0.2), reasons: &["has come", "states came", "has ended"] },
    Kind { line: "deaf", ends: "mend", stands: Some(0.2), reasons: UNHEARD },
    Kind { line: "stuck", ends: "mend", stands: Some(0.2), reasons: UNHEARD },
    Kind { line: "hung", ends: "mend", stands: None, reasons: STILL_PRESSING },
    Kind { line: "tired", ends: "mend", stands: None, reasons: UNHEARD },
    Kind {
        line: "late states 40",
        ends: "mend",
        stands: None,
        reasons: &["states came", "has come", "N at (", "N over"],
    },
    Kind { line: "late orders 40", ends: "mend", stands: None, reasons: &["are ordered", "N at (", "N over"] },
    Kind { line: "spike 40", ends: "", stands: None, reasons: &["over the limit", "N at ("] },
    Kind {
        line: "raise 3",
        ends: "",
        stands: None,
        reasons: &["N at (", "over the limit", "N at rest", "protective stop"],
    },
    Kind { line: "slider 5", ends: "slider 100", stands: None, reasons: &["its speed slider is at 5 %"] },
    Kind { line: "reduced", ends: "full", stands: None, reasons: &["reduced mode"] },
    Kind { line: "noise 0.3", ends: "noise 0", stands: None, reasons: &["N at ("] },
    Kind { line: "payload 1.5", ends: "", stands: None, reasons: &["N at (", "N at rest", "over the limit"] },
    Kind { line: "mute", ends: "mend", stands: None, reasons: &[] },
];

/// Faults of one script: kind, moment and length, s.
type Faults = Vec<(&'static Kind, f64, f64)>;

fn script_of(faults: &Faults) -> Vec<(f64, String)> {
    let begin = faults.iter().map(|(kind, at, _)| (*at, kind.line.to_owned()));
    let ends = faults.iter().filter(|(kind, ..)| !kind.ends.is_empty());
    let mut script: Vec<_> = begin.chain(ends.map(|(kind, at, length)| (at + length, kind.ends.to_owned()))).collect();
    script.sort_by(|a, b| a.0.total_cmp(&b.0));
    script
}

/// What is wrong with how a script ended.
fn judged(faults: &Faults, outcome: &Outcome) -> Option<String> {
    let is_mute = faults.iter().any(|(kind, ..)| kind.line == "mute");
    if let Some(error) = &outcome.error {
        let words = error.to_string();
        let is_true = faults.iter().any(|(kind, ..)| kind.reasons.iter().any(|reason| words.contains(reason)));
        if !is_true {
            return Some(format!("the reason is not true: {words}"));
        }
        // a program that nobody could end is resumed: the client brakes it, or its watchdog ends it
        let (since, most) = if is_mute { (0.0, MUTE_WAY) } else { (0.2, 0.0) };
        let (way, until) = outcome.after_report(since);
        if way > most {
            let (way, until) = (way * 1e3, until * 1e3);
            return Some(format!("{way:.2} mm after the report, until {until:.0} ms after it: {words}"));
        }
    }
    let is_mute_or_unplugged = is_mute || faults.iter().any(|(kind, ..)| kind.line == "unplug");
    for (kind, at, length) in faults {
        let late = outcome.stood_at() - at;
        let is_resumed = is_mute && matches!(kind.line, "pause" | "open");
        // without a dashboard its watchdog stops it
        let most = kind.stands.map(|most| if is_mute_or_unplugged { most.max(WATCHDOG) } else { most });
        // what another one ends was there for a shorter time
        let mends = faults.iter().filter(|(other, ..)| other.ends == "mend").map(|(_, at, length)| at + length);
        let lasts = mends.filter(|end| end > at).map(|end| end - at).fold(*length, f64::min);
        if let Some(most) = most.filter(|most| !is_resumed && lasts > *most && late > *most) {
            return Some(format!("`{}`: stands after {:.0} of {:.0} ms", kind.line, late * 1e3, most * 1e3));
        }
    }
    let most = 1.5 * limits().force;
    (outcome.peak() > most).then(|| format!("{:.1} N of at most {most} N", outcome.peak()))
}

#[test]
fn without_a_fault_it_touches_and_touches() {
    let outcome = played(Vec::new(), 1, 14.0);
    assert!(outcome.error.is_none(), "{}", outcome.error.unwrap());
    assert!(outcome.touches >= 3 && outcome.peak() < 2.0 * TouchParams::default().force, "{}", outcome.peak());
    println!("{} touches, at most {:.1} N", outcome.touches, outcome.peak());
}

/// A part that is 7 mm higher than where the links are clear, met from above at the speed of links.
#[test]
fn a_part_met_at_link_speed_is_pressed_with_no_more_than_the_limit_and_left() {
    let outcome = played(vec![(0.2, "raise 7".to_owned())], 1, 6.0);
    let error = outcome.error.as_ref().unwrap().to_string();
    println!("{:.1} N at most; {error}", outcome.peak());
    assert!(error.contains("where the path is clear by the mesh"), "{error}");
    assert!(outcome.peak() > 1.0 && outcome.peak() < limits().force, "{} N", outcome.peak());
    let last = outcome.record.last().unwrap().force;
    assert!(last < 1.0, "{last} N are left");
}

#[test]
fn each_fault_alone_ends_as_it_should() {
    let mut wrong = Vec::new();
    // in the fastest link of the second or third touch
    let free = played(Vec::new(), 1, 8.0).record;
    let later = free.iter().filter(|moment| moment.time > 2.0 && moment.time < 7.0);
    let moment = later.max_by(|a, b| a.speed.total_cmp(&b.speed)).unwrap().time;
    println!("| fault at {moment:.2} s | speed, mm/s | stands after, ms | force, N | reason |\n|---|---|---|---|---|");
    for kind in KINDS {
        let faults = vec![(kind, moment, 1.5)];
        let outcome = played(script_of(&faults), 1, 10.0);
        let reason = outcome.error.as_ref().map_or("-".to_owned(), ToString::to_string);
        let stands =
            outcome.error.as_ref().map_or("-".to_owned(), |_| format!("{:.0}", (outcome.stood_at() - moment) * 1e3));
        let speed = outcome.record.iter().find(|seen| seen.time >= moment).map_or(0.0, |seen| seen.speed * 1e3);
        println!("| {} | {speed:.0} | {stands} | {:.1} | {reason} |", kind.line, outcome.peak());
        wrong.extend(judged(&faults, &outcome).map(|why| format!("{}: {why}", kind.line)));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// One or two faults of any kind at any moment; 25 scripts, with `--full` 200 of each of 20 seeds.
#[test]
fn random_scripts_end_as_they_should() {
    let is_full = std::env::var_os("TOUCHUP_FULL").is_some();
    let (mut reported, mut touches, mut peak) = (0, 0, 0.0_f64);
    let (scripts, seeds) = if is_full { (200, 20) } else { (25, 1) };
    let mut wrong = Vec::new();
    for seed in 1..=seeds {
        let mut rng = Pcg64::seed_from_u64(seed);
        for number in 0..scripts {
            let count = 1 + usize::from(rng.random_range(0.0..1.0) < 0.4);
            let faults: Faults = (0..count)
                .map(|_| {
                    let kind = &KINDS[rng.random_range(0..KINDS.len())];
                    (kind, rng.random_range(0.5..5.0), rng.random_range(0.05..1.5))
                })
                .collect();
            let outcome = played(script_of(&faults), seed, 6.0);
            reported += usize::from(outcome.error.is_some());
            (touches, peak) = (touches + outcome.touches, outcome.peak().max(peak));
            let names: Vec<_> = faults.iter().map(|(kind, at, length)| (kind.line, *at, *length)).collect();
            wrong
                .extend(judged(&faults, &outcome).map(|why| format!("seed {seed}, script {number}, {names:?}: {why}")));
        }
    }
    println!("| scripts | with a reported fault | touches | largest force, N | wrong |\n|---|---|---|---|---|");
    println!("| {} | {reported} | {touches} | {peak:.1} | {} |", scripts * seeds as usize, wrong.len());
    assert!(wrong.is_empty(), "{wrong:#?}");
}
