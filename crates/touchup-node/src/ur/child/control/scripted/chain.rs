//! The chain: a watched arm, orders, driver, library, the model of the controller, states, guard
//! and dashboard.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};

use super::super::{Control, Driver, TURN};
use crate::ur::UrParams;
use crate::ur::arm::{order_of, seen};
use crate::ur::child::error::ChildError;
use crate::ur::child::program;
use crate::ur::child::shared::ChildShared;
use crate::ur::child::states::LastReport;
use crate::ur::guard::{AGAIN, ClientLoss, GuardState};
use crate::ur::params::Deadlines;
use crate::ur::protocol::{
    Begin, ClientReport, Order, OrderAction, PERIOD, ProgramState, RtdeConnection, UrState,
    vector_of,
};
use touchup_method::stylus::Payload;
use touchup_probing::arm::{Arm, ArmError, ArmState, Command, Freshness, Safety, SpeedReduction};
use touchup_session::clock::{Clock, ManualClock};
use touchup_sim::{ArmParams, Plate, WEIGHTLESS};

#[path = "../../../../../../../examples/ur_controller/model/mod.rs"]
#[expect(dead_code, reason = "what the wire alone needs")]
mod model;

use model::body::Body;
use model::controller::{Controller, Safety as SafetyStatus, Written};
use model::panel::{answer, happen};
use model::record::Record;
use model::states::States;

/// Time between two states of the model.
pub const STEP: Duration = Duration::from_millis(2);
/// Maximum wait of a call for a ready program.
const READY: Duration = Duration::from_secs(3);
/// Record of the model at one time.
#[derive(Clone, Copy)]
pub struct ModelSample {
    /// s
    pub time: f64,
    /// linear plus angular, m/s and rad/s
    pub speed: f64,
    /// of the part on the tip, N
    pub force: f64,
}

/// Controller, client and guard, on one clock.
pub struct ScriptedChain<'a> {
    controller: RefCell<Controller<'a>>,
    hand: ManualClock,
    clock: Clock,
    shared: ChildShared,
    said: Arc<Mutex<VecDeque<ClientReport>>>,
    guard: RefCell<GuardState>,
    last_report: RefCell<LastReport>,
    /// time of the guard's last line
    heard: Cell<Instant>,
    /// newest states received by the library
    states: RefCell<States>,
    /// next events and their times, s
    pub script: RefCell<VecDeque<(f64, String)>>,
    pub record: RefCell<Vec<ModelSample>>,
    /// end of the caller's delay, s
    held_until: Cell<f64>,
    /// time of an unanswered stop request to the dashboard
    asked: Cell<Option<Instant>>,
    begin: Begin,
    is_dropped: Cell<bool>,
    has_dashboard: Cell<bool>,
    is_killed: Cell<bool>,
}

impl<'a> ScriptedChain<'a> {
    /// - `script`: events and their times, s, in order.
    pub fn new(surface: &'a Plate, script: Vec<(f64, String)>, seed: u64) -> Self {
        let (clock, hand) = Clock::manual();
        let payload = Payload {
            mass: 0.25,
            p_sc: Vector3::new(0.0, 0.0, 0.05),
            ..WEIGHTLESS
        };
        let params = ArmParams {
            payload,
            seed,
            ..ArmParams::default()
        };
        let client = UrParams::new("", "");
        let begin = Begin {
            host: String::new(),
            site_packages: Default::default(),
            tool: vector_of(&client.pose_ft),
            mass_kg: client.mass,
            centre_m: client.centre.into(),
            version: [5, 15],
            damping: client.damping,
            gain: client.gain,
            is_lock_step: false,
        };
        let body = Body::new(surface, params, Point3::new(45e-3, 8e-3, 25e-3)).unwrap();
        let mut controller = Controller::new(body, [5, 15, 0], Record::new(None).unwrap());
        let states = States::read(&mut controller);
        let said = Arc::new(Mutex::new(VecDeque::new()));
        let sink = said.clone();
        Self {
            controller: RefCell::new(controller),
            shared: ChildShared::new(move |report| sink.lock().unwrap().push_back(report.clone())),
            said,
            guard: RefCell::new(GuardState::new(Deadlines::default(), clock.now())),
            last_report: RefCell::new(LastReport {
                stamp_s: f64::INFINITY,
                at: clock.now(),
            }),
            heard: Cell::new(clock.now()),
            states: RefCell::new(states),
            script: RefCell::new(script.into()),
            record: RefCell::default(),
            held_until: Cell::new(0.0),
            asked: Cell::new(None),
            begin,
            is_dropped: Cell::new(false),
            has_dashboard: Cell::new(true),
            is_killed: Cell::new(false),
            clock,
            hand,
        }
    }

    /// Time of the model, s.
    pub fn now(&self) -> f64 {
        self.controller.borrow().body.time
    }

    /// The next line of the script if it is due.
    fn due(&self, now: f64) -> Option<String> {
        let mut script = self.script.borrow_mut();
        let is_due = script.front().is_some_and(|(at, _)| *at <= now);
        is_due
            .then(|| script.pop_front())
            .flatten()
            .map(|(_, line)| line)
    }

    /// One period of the controller and its immediate consequences.
    fn step(&self) {
        self.hand.advance(STEP);
        let mut controller = self.controller.borrow_mut();
        while let Some(line) = self.due(controller.body.time) {
            if let Some(ms) = line.strip_prefix("hold ") {
                self.held_until
                    .set(controller.body.time + ms.parse::<f64>().unwrap() * 1e-3);
                continue;
            }
            happen(&mut controller, &line);
            self.is_dropped
                .set(self.is_dropped.get() || line == "drop" || line == "die");
            self.has_dashboard
                .set(self.has_dashboard.get() && line != "undash" && line != "die");
        }
        controller.tick();
        let [linear, angular] = controller.body.velocity();
        let speed = linear.norm() + angular.norm();
        self.record.borrow_mut().push(ModelSample {
            time: controller.body.time,
            speed,
            force: controller.body.true_force(),
        });
        let mut newest = None;
        while let Some(states) = controller.sent() {
            newest = Some(states);
        }
        drop(controller);
        if self
            .asked
            .get()
            .is_some_and(|asked| self.clock.since(asked) >= AGAIN)
        {
            self.stop();
        }
        if self.is_killed.get() {
            return;
        }
        if self.is_dropped.get() {
            return self.take(ClientReport::Lost {
                which: RtdeConnection::States,
            });
        }
        let state = newest.map(|states| {
            let state = self.state_of(&states);
            *self.states.borrow_mut() = states;
            self.shared.see(state, self.clock.now());
            state
        });
        let report =
            self.last_report
                .borrow_mut()
                .next(state, self.shared.number(), self.clock.now());
        let said: Vec<_> = self.said.lock().unwrap().drain(..).collect();
        said.into_iter()
            .chain(report)
            .for_each(|report| self.take(report));
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
            cycle: states.ints[usize::from(program::REGISTER)],
            served: self.shared.number(),
        }
    }

    /// Hands a line to the guard, as its thread does.
    fn take(&self, report: ClientReport) {
        self.heard.set(self.clock.now());
        let mut guard = self.guard.borrow_mut();
        let is_to_be_ended =
            matches!(&report, ClientReport::State(state) if guard.is_to_be_ended(state));
        let broken = guard.take(report, self.clock.now());
        drop(guard);
        if is_to_be_ended {
            self.stop();
        }
        if let Some(broken) = broken {
            self.break_off(broken);
        }
    }

    /// Checks the deadline and the dashboard of the guard.
    fn look(&self) {
        let late =
            self.clock.since(self.heard.get()) > self.guard.borrow().patience(self.clock.now());
        if late {
            let missed = self.guard.borrow().missed();
            self.break_off(missed);
        } else if !self.has_dashboard.get() {
            self.break_off(ClientLoss::Arm(ArmError::Dropped {
                what: "its dashboard",
            }));
        }
    }

    fn break_off(&self, broken: ClientLoss) {
        if !self.is_killed.replace(true) {
            self.guard.borrow_mut().broken = Some(broken);
            self.stop();
        }
    }

    /// Asks the dashboard to stop, repeatedly until it answers.
    fn stop(&self) {
        self.asked
            .set(self.dashboard("stop").is_none().then(|| self.clock.now()));
    }

    /// Answer of the dashboard, if any.
    fn dashboard(&self, line: &str) -> Option<String> {
        let mut controller = self.controller.borrow_mut();
        let faults = controller.faults;
        let is_there = !faults.is_mute && !faults.is_unplugged && !faults.is_dead;
        is_there.then(|| answer(&mut controller, line))
    }

    /// Prepares the controller for a new client: registers cleared, program uploaded.
    fn upload(&self) {
        let mut controller = self.controller.borrow_mut();
        // the registers belong to the previous client
        (controller.ints_in, controller.doubles_in) = ([0; 48], [0.0; 48]);
        controller.owner = Some(0);
        controller.load(&program::counting(program::PLACES).unwrap());
        while controller.sent().is_some() {}
        *self.states.borrow_mut() = States::read(&mut controller);
        drop(controller);
        let now = self.clock.now();
        *self.guard.borrow_mut() = GuardState::new(Deadlines::default(), now);
        *self.last_report.borrow_mut() = LastReport {
            stamp_s: f64::INFINITY,
            at: now,
        };
        self.said.lock().unwrap().clear();
        self.shared.served.store(0, Ordering::Release);
        self.shared.is_ready.store(false, Ordering::Release);
        self.shared.has_halted.store(false, Ordering::Release);
        *self.shared.latest.lock().unwrap() = None;
        self.heard.set(now);
        self.asked.set(None);
        self.is_dropped.set(false);
        self.has_dashboard.set(true);
        self.is_killed.set(false);
        (0..20).for_each(|_| self.step());
    }
}

/// The library: looks at its newest states, waits for a ready program, and writes registers.
pub struct Library<'a, 'b>(pub &'b ScriptedChain<'a>);

impl Library<'_, '_> {
    fn may_send(&self) -> bool {
        let states = self.0.states.borrow();
        let is_stopped = states.safety_bits & (1 << 2 | 1 << 7) != 0;
        !self.0.is_killed.get() && !self.0.is_dropped.get() && states.is_playing && !is_stopped
    }

    /// Waits until the program has answered with a number.
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
            let doubles = doubles
                .iter()
                .enumerate()
                .map(|(at, value)| Written::Double(at, *value));
            let ints = (1..).zip(ints).map(|(at, value)| Written::Int(at, *value));
            self.0
                .controller
                .borrow_mut()
                .write(doubles.chain(ints).chain([Written::Int(0, id)]).collect());
            if !is_realtime {
                is_done = self.until(2);
                self.0
                    .controller
                    .borrow_mut()
                    .write(vec![Written::Int(0, 0)]);
            }
        }
        is_done.then_some(()).ok_or(ChildError::Python {
            call: "a call",
            reason: "it returned false".to_owned(),
        })
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

    fn press(
        &self,
        frame: [f64; 6],
        force: f64,
        kind: i32,
        limits: [f64; 6],
    ) -> Result<(), ChildError> {
        let wrench = [0.0, 0.0, force, 0.0, 0.0, 0.0];
        self.send(
            6,
            &[kind, 0, 0, 1, 0, 0, 0],
            &[frame, wrench, limits].concat(),
        )
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
        self.0
            .controller
            .borrow_mut()
            .write(vec![Written::Int(0, 0)]);
        Ok(())
    }

    fn end_program(&self) -> Result<(), ChildError> {
        self.0
            .controller
            .borrow_mut()
            .write(vec![Written::Int(0, 255)]);
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
pub struct ScriptedArm<'a, 'b> {
    world: &'b ScriptedChain<'a>,
    library: &'b Library<'a, 'b>,
    driver: Driver<'b, Library<'a, 'b>>,
    params: UrParams,
    freshness: Freshness,
    last: UrState,
    waiting: Vec<Order>,
    looked: Instant,
}

impl<'a, 'b> ScriptedArm<'a, 'b> {
    /// Connects as `UrArm::connect`.
    pub fn connect(
        world: &'b ScriptedChain<'a>,
        library: &'b Library<'a, 'b>,
    ) -> Result<Self, ArmError> {
        world.upload();
        let mut driver = Driver::new(library, &world.shared, &world.begin, world.clock.clone());
        driver.prepare().map_err(|end| ArmError::Client {
            reason: format!("{end:?}"),
        })?;
        world.shared.is_ready.store(true, Ordering::Release);
        world.shared.report(&ClientReport::Ready);
        // older states have the pose of another tool
        world.step();
        Ok(Self {
            world,
            library,
            driver,
            params: UrParams::new("", ""),
            freshness: Freshness::new(PERIOD),
            last: world.state_of(&world.states.borrow()),
            waiting: Vec::new(),
            looked: world.clock.now(),
        })
    }

    fn broken(&self) -> Result<(), ArmError> {
        let guard = self.world.guard.borrow();
        if let Some(broken) = &guard.broken {
            return Err(broken.error());
        }
        if guard.has_ended(self.world.clock.now()) {
            Err(guard.ended())
        } else {
            Ok(())
        }
    }

    fn send(&mut self, what: OrderAction) -> u64 {
        let number = self
            .world
            .guard
            .borrow_mut()
            .send(&what, self.world.clock.now());
        self.waiting.push(Order { number, what });
        number
    }

    /// One period, with the driver's actions in it.
    pub fn step(&mut self) {
        self.world.step();
        if self.world.is_killed.get() {
            return;
        }
        let zero = self
            .waiting
            .iter()
            .position(|order| order.what == OrderAction::Zero);
        let taken = zero.map_or(self.waiting.len(), |at| at + 1);
        let order = self.waiting.drain(..taken).next_back();
        let is_due = self.world.clock.since(self.looked) >= TURN;
        if order.is_some() || is_due {
            self.looked = self.world.clock.now();
            // the guard notices a lost connection
            let _ = self.driver.turn(order);
        }
    }
}

impl Arm for ScriptedArm<'_, '_> {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        while self.world.now() < self.world.held_until.get() {
            self.step();
        }
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
        let guard = self.world.guard.borrow();
        let newest = (guard.newest_s, guard.lateness.newest_s());
        drop(guard);
        if is_stop || self.freshness.may_send(self.last.stamp_s, newest)? {
            self.broken()?;
            self.send(order);
        }
        Ok(())
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        let number = self.send(OrderAction::Zero);
        while self.world.guard.borrow().done < number {
            self.broken()?;
            self.step();
        }
        self.world.guard.borrow_mut().states.clear();
        Ok(())
    }

    /// Recovers as `UrArm::recover`; a protective stop unlocks at once.
    fn recover(&mut self) -> Result<(), ArmError> {
        let lost = || ArmError::Lost { silent_ms: 500 };
        self.world
            .dashboard("unlock protective stop")
            .ok_or_else(lost)?;
        let controller = self.world.controller.borrow();
        let (safety, can_start) = (
            controller.safety,
            controller.is_remote && controller.is_powered,
        );
        drop(controller);
        if safety != SafetyStatus::Normal {
            return Err(ArmError::Stopped {
                safety: Safety::OperatorStop,
            });
        }
        if !can_start {
            return Err(ArmError::Refused {
                what: "to recover",
                reason: "no power, or local control".to_owned(),
            });
        }
        self.world.dashboard("stop").ok_or_else(lost)?;
        *self = Self::connect(self.world, self.library)?;
        Ok(())
    }

    fn period(&self) -> f64 {
        PERIOD
    }

    fn slowed(&self) -> Option<SpeedReduction> {
        self.last.slowed()
    }
}
