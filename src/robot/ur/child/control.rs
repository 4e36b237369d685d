//! The one thread that tells the arm what to do.
//!
//! It moves only while orders come: when they stay away it brakes, and then feeds the watchdog of the controller for as long as it
//! lives. A thread that hangs in a call feeds nothing, and the arm is stopped by that watchdog.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::{ChildError, Shared, failure};
use crate::clock::Clock;
use crate::robot::ur::protocol::{Begin, Link, Order, Report, What};

/// How long it waits for an order before it looks after the arm by itself.
const TURN: Duration = Duration::from_millis(5);
/// Orders that stay away for this long leave the arm to brake.
const FRESH: Duration = Duration::from_millis(60);
/// With which it brakes then, m/s².
const BRAKE: f64 = 2.0;
/// The watchdog of the controller stops the arm when nothing has come for the tenth of a second.
const WATCHDOG_HZ: f64 = 10.0;
/// At rest it is fed this often.
const FEED: Duration = Duration::from_millis(20);
/// The tip stands below this speed, m/s and rad/s; what is left a hard stop takes.
const STANDING: f64 = 1e-3;
/// From an order to the states that show what came of it, at the most.
const SETTLED: Duration = Duration::from_millis(20);
/// The hard stop of `speedStop`, m/s².
const HARD: f64 = 10.0;
/// The program of the controller starts within this time of its upload.
const UPLOAD: Duration = Duration::from_secs(5);
/// A call that was refused because the program has just ended: the state that says so comes within this time.
const EXCUSE: Duration = Duration::from_millis(40);
/// Force mode with a frame that stays as it is given.
const FIXED_FRAME: i32 = 2;
/// Two cycles of the controller: its program reads one command in each, and what comes sooner takes the place of the one before.
const CYCLES: Duration = Duration::from_millis(4);
/// A press is said again this often, should it have been lost.
const REPEAT: Duration = Duration::from_millis(100);
/// Across the axis of a press the tip may be this far from where it should be, m and rad: what the feed and the friction make.
const ASIDE: [f64; 2] = [0.05, 0.2];
/// The tool that is read back may differ by this rounding, m and rad.
const SAME_TOOL: f64 = 1e-6;

/// What the arm is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    Resting,
    Moving,
    Pressing { frame: [f64; 6], force: f64, speed: f64 },
    Braking { deceleration: f64, since: Instant },
}

/// What of ur-rtde a driver calls, from one thread alone. A call returns when the library does.
pub trait Control {
    /// Whether the library has a connection.
    fn is_connected(&self) -> bool;
    /// Whether the uploaded program runs; an old answer when the connection is lost.
    fn is_running(&self) -> bool;
    /// Goes with a velocity, m/s and rad/s in B, reached with an acceleration, m/s², until it is told otherwise.
    fn speed(&self, twist: [f64; 6], acceleration: f64) -> Result<(), ChildError>;
    /// Presses along z of a frame of B with a force, N; `limits`: speed along z, m/s, how far off across, m and rad.
    fn press(&self, frame: [f64; 6], force: f64, kind: i32, limits: [f64; 6]) -> Result<(), ChildError>;
    /// Ends pressing. A velocity that was not stopped before goes on.
    fn end_press(&self) -> Result<(), ChildError>;
    /// Stops what `speed` began, with a deceleration, m/s²; returns when the arm stands.
    fn hard_stop(&self, deceleration: f64) -> Result<(), ChildError>;
    /// Takes what the sensor reads for nothing.
    fn zero(&self) -> Result<(), ChildError>;
    /// kg, and m in the flange.
    fn set_payload(&self, mass: f64, centre: [f64; 3]) -> Result<(), ChildError>;
    /// The tip in the flange.
    fn set_tool(&self, tool: [f64; 6]) -> Result<(), ChildError>;
    /// The tip in the flange, as the controller has it.
    fn tool(&self) -> Result<[f64; 6], ChildError>;
    /// How force mode gives way.
    fn set_force_mode(&self, damping: f64, gain: f64) -> Result<(), ChildError>;
    /// Has the controller stop when it hears less often.
    fn set_watchdog(&self, least_hz: f64) -> Result<(), ChildError>;
    /// Lets the watchdog hear something.
    fn feed(&self) -> Result<(), ChildError>;
    /// Ends the program of the controller.
    fn end_program(&self) -> Result<(), ChildError>;
}

/// Why a driver ends before its orders do.
#[derive(Debug)]
pub enum End {
    Lost(Link),
    NotReady(ChildError),
    BadTool(String),
}

/// Owner of the control interface.
pub struct Driver<'a, C> {
    control: &'a C,
    shared: &'a Shared,
    begin: &'a Begin,
    clock: Clock,
    doing: Doing,
    ordered: Instant,
    fed: Instant,
    pressed: Instant,
}

impl<'a, C: Control> Driver<'a, C> {
    /// - `clock`: on which all that is kept in time is kept.
    pub fn new(control: &'a C, shared: &'a Shared, begin: &'a Begin, clock: Clock) -> Self {
        let now = clock.now();
        Self { control, shared, begin, clock, doing: Doing::Resting, ordered: now, fed: now, pressed: now }
    }

    /// Until the orders end.
    pub fn run(mut self, orders: &Receiver<Order>) -> Result<(), End> {
        self.prepare()?;
        self.shared.report(&Report::Ready);
        loop {
            self.check_connection()?;
            // how often it looks is no deadline: it looks in real time also where its clock waits for it
            match orders.recv_timeout(TURN) {
                Ok(order) => self.turn(Some(newest(order, orders)))?,
                Err(RecvTimeoutError::Timeout) => self.turn(None)?,
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        self.end();
        Ok(())
    }

    fn check_connection(&self) -> Result<(), End> {
        if self.control.is_connected() { Ok(()) } else { Err(End::Lost(Link::Control)) }
    }

    /// Does what an order says, or what is to be done when none has come.
    fn turn(&mut self, order: Option<Order>) -> Result<(), End> {
        let Some(order) = order else {
            return self.look_after().or_else(|error| self.failed(&error));
        };
        self.ordered = self.clock.now();
        match self.serve(&order.what) {
            Ok(()) if order.what == What::Zero => self.shared.report(&Report::Done { number: order.number }),
            Ok(()) => {}
            Err(error) => self.failed(&error)?,
        }
        self.shared.served.store(order.number, Ordering::Release);
        Ok(())
    }

    fn serve(&mut self, what: &What) -> Result<(), ChildError> {
        match *what {
            What::Move { twist, acceleration } => {
                self.end_press()?;
                self.doing = Doing::Moving;
                self.control.speed(twist, acceleration)
            }
            What::Press { frame, force_n, speed, feed: [x, y, z], acceleration } => {
                let doing = Doing::Pressing { frame, force: force_n, speed };
                // the axis, not the place, is what makes it another press
                let is_same = matches!(self.doing, Doing::Pressing { frame: [.., a, b, c], force, speed: most }
                    if [a, b, c] == frame[3..] && force == force_n && most == speed);
                if !is_same || self.clock.since(self.pressed) > REPEAT {
                    let [far, turned] = ASIDE;
                    self.control.press(frame, force_n, FIXED_FRAME, [far, far, speed, turned, turned, turned])?;
                    (self.doing, self.pressed) = (doing, self.clock.now());
                    self.clock.sleep(CYCLES);
                }
                self.control.speed([x, y, z, 0.0, 0.0, 0.0], acceleration)
            }
            What::Stop { deceleration } => self.brake(deceleration),
            What::Zero => {
                self.rest()?;
                self.control.zero()
            }
        }
    }

    /// Everything that a newly started program does not know.
    fn prepare(&mut self) -> Result<(), End> {
        let begun = self.clock.now();
        while !self.control.is_running() && self.clock.since(begun) < UPLOAD {
            self.clock.sleep(TURN);
        }
        self.doing = Doing::Resting;
        let found = self.set_up().map_err(End::NotReady)?;
        let tool = &self.begin.tool;
        if found.iter().zip(tool).any(|(found, told)| (found - told).abs() > SAME_TOOL) {
            return Err(End::BadTool(format!("{found:?} and not {tool:?}")));
        }
        // last, for what is above takes its time
        self.control.set_watchdog(WATCHDOG_HZ).map_err(End::NotReady)?;
        self.fed = self.clock.now();
        Ok(())
    }

    /// Returns the tool as it is read back.
    fn set_up(&self) -> Result<[f64; 6], ChildError> {
        let Begin { tool, mass_kg, centre_m, damping, gain, .. } = self.begin;
        self.control.set_payload(*mass_kg, *centre_m)?;
        self.control.set_tool(*tool)?;
        let found = self.control.tool()?;
        self.control.set_force_mode(*damping, *gain)?;
        Ok(found)
    }

    /// What is to be done when no order comes.
    fn look_after(&mut self) -> Result<(), ChildError> {
        match self.doing {
            Doing::Resting if self.clock.since(self.fed) >= FEED => self.feed(),
            Doing::Resting => Ok(()),
            Doing::Braking { deceleration, .. } => self.brake(deceleration),
            Doing::Moving | Doing::Pressing { .. } if self.clock.since(self.ordered) > FRESH => self.brake(BRAKE),
            Doing::Moving | Doing::Pressing { .. } => Ok(()),
        }
    }

    fn feed(&mut self) -> Result<(), ChildError> {
        if !self.control.is_running() {
            return Ok(());
        }
        self.fed = self.clock.now();
        self.control.feed()
    }

    /// One turn of braking: the velocity goes to zero with the deceleration, and what is left by a hard stop. At rest the controller
    /// hears that there was an order.
    fn brake(&mut self, deceleration: f64) -> Result<(), ChildError> {
        self.end_press()?;
        if self.doing == Doing::Resting {
            return self.feed();
        }
        let since = if let Doing::Braking { since, .. } = self.doing { since } else { self.clock.now() };
        self.doing = Doing::Braking { deceleration, since };
        self.control.speed([0.0; 6], deceleration)?;
        let speed = |velocity: [f64; 6]| velocity.iter().map(|part| part * part).sum::<f64>().sqrt();
        let is_standing = self.shared.latest().is_some_and(|state| speed(state.velocity) < STANDING);
        // the first states may still be those of an arm that has not begun to move
        if is_standing && self.clock.since(since) > SETTLED {
            self.control.hard_stop(HARD)?;
            self.doing = Doing::Resting;
        }
        Ok(())
    }

    /// The feed is stopped first: the thread that drives it outlives the end of force mode.
    fn end_press(&mut self) -> Result<(), ChildError> {
        if matches!(self.doing, Doing::Pressing { .. }) {
            self.control.hard_stop(HARD)?;
            self.control.end_press()?;
            self.doing = Doing::Resting;
        }
        Ok(())
    }

    /// Brakes until the arm stands.
    fn rest(&mut self) -> Result<(), ChildError> {
        let begun = self.clock.now();
        while self.doing != Doing::Resting && self.clock.since(begun) < UPLOAD {
            self.brake(BRAKE)?;
            self.clock.sleep(TURN);
        }
        Ok(())
    }

    /// A call was refused. When the program has ended or the arm is not allowed to move, the states say so.
    fn failed(&mut self, error: &ChildError) -> Result<(), End> {
        self.doing = Doing::Resting;
        let begun = self.clock.now();
        while self.clock.since(begun) < EXCUSE {
            self.check_connection()?;
            if self.shared.latest().is_some_and(|state| !state.is_playing) {
                return Ok(());
            }
            self.clock.sleep(TURN);
        }
        self.shared.report(&failure(error));
        Ok(())
    }

    /// Nobody gives orders any more.
    fn end(&mut self) {
        // what fails here the watchdog does
        let _ = self.rest().and_then(|()| self.control.end_program());
    }
}

/// The last of the orders that wait, or the first of them that is to be done whatever comes after it.
fn newest(mut order: Order, orders: &Receiver<Order>) -> Order {
    while order.what != What::Zero {
        match orders.try_recv() {
            Ok(next) => order = next,
            Err(_) => break,
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};
    use std::io::{PipeReader, Read, pipe};
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicBool, AtomicU64};
    use std::sync::mpsc::channel;
    use std::thread;

    use self::Call::{EndPress, EndProgram, Feed, HardStop, Press, Set, Speed, Zero};
    use super::*;
    use crate::clock::ManualClock;
    use crate::robot::ur::protocol::State;
    use crate::robot::ur::protocol::tests::STATE;

    const MS: Duration = Duration::from_millis(1);
    const UP: What = What::Move { twist: [0.0, 0.0, 20e-3, 0.0, 0.0, 0.0], acceleration: 1.0 };
    const GOING_UP: Call = Speed(20e-3, 1.0);

    /// What the library was called with.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Call {
        /// along z, and how fast it is reached
        Speed(f64, f64),
        /// turn of the frame about x, and force
        Press(f64, f64),
        EndPress,
        HardStop(f64),
        Zero,
        Set(&'static str, f64),
        Feed,
        EndProgram,
    }

    /// A library that writes down what it is called with and when, ms; and an arm that follows.
    struct Fake {
        clock: Clock,
        begun: Instant,
        calls: RefCell<Vec<(u128, Call)>>,
        is_connected: Cell<bool>,
        is_running: Cell<bool>,
        refuses: Cell<bool>,
        /// of each call
        takes: Cell<Duration>,
        tool: Cell<[f64; 6]>,
    }

    impl Fake {
        fn call(&self, call: Call) -> Result<(), ChildError> {
            self.calls.borrow_mut().push((self.clock.since(self.begun).as_millis(), call));
            if !self.takes.get().is_zero() {
                self.clock.sleep(self.takes.get());
            }
            if self.refuses.get() {
                return Err(ChildError::Python { call: "a call", reason: "it returned false".to_owned() });
            }
            Ok(())
        }
    }

    impl Control for Fake {
        fn is_connected(&self) -> bool {
            self.is_connected.get()
        }

        fn is_running(&self) -> bool {
            self.is_running.get()
        }

        fn speed(&self, twist: [f64; 6], acceleration: f64) -> Result<(), ChildError> {
            self.call(Speed(twist[2], acceleration))
        }

        fn press(&self, frame: [f64; 6], force: f64, _kind: i32, _limits: [f64; 6]) -> Result<(), ChildError> {
            self.call(Press(frame[3], force))
        }

        fn end_press(&self) -> Result<(), ChildError> {
            self.call(EndPress)
        }

        fn hard_stop(&self, deceleration: f64) -> Result<(), ChildError> {
            self.call(HardStop(deceleration))
        }

        fn zero(&self) -> Result<(), ChildError> {
            self.call(Zero)
        }

        fn set_payload(&self, mass: f64, _centre: [f64; 3]) -> Result<(), ChildError> {
            self.call(Set("payload", mass))
        }

        fn set_tool(&self, tool: [f64; 6]) -> Result<(), ChildError> {
            self.call(Set("tool", tool[2]))
        }

        fn tool(&self) -> Result<[f64; 6], ChildError> {
            Ok(self.tool.get())
        }

        fn set_force_mode(&self, damping: f64, _gain: f64) -> Result<(), ChildError> {
            self.call(Set("damping", damping))
        }

        fn set_watchdog(&self, least_hz: f64) -> Result<(), ChildError> {
            self.call(Set("watchdog", least_hz))
        }

        fn feed(&self) -> Result<(), ChildError> {
            self.call(Feed)
        }

        fn end_program(&self) -> Result<(), ChildError> {
            self.call(EndProgram)
        }
    }

    struct Bench {
        hand: ManualClock,
        fake: Fake,
        shared: Shared,
        begin: Begin,
        reports: PipeReader,
    }

    impl Bench {
        fn new() -> Self {
            let (clock, hand) = Clock::manual();
            let tool = [0.0, 0.0, 0.15, 0.0, 0.0, 0.0];
            let fake = Fake {
                begun: clock.now(),
                clock,
                calls: RefCell::default(),
                is_connected: Cell::new(true),
                is_running: Cell::new(true),
                refuses: Cell::new(false),
                takes: Cell::default(),
                tool: Cell::new(tool),
            };
            let (reports, writer) = pipe().unwrap();
            let shared =
                Shared { reports: Mutex::new(writer), served: AtomicU64::new(0), latest: Mutex::new(Some(STATE)) };
            let begin = Begin {
                host: String::new(),
                site_packages: Default::default(),
                tool,
                mass_kg: 0.25,
                centre_m: [0.0, 0.0, 0.05],
                damping: 0.025,
                gain: 0.5,
                is_lock_step: false,
            };
            Self { hand, fake, shared, begin, reports }
        }

        fn driver(&self) -> Driver<'_, Fake> {
            Driver::new(&self.fake, &self.shared, &self.begin, self.fake.clock.clone())
        }

        /// The state says that the tip goes up, m/s.
        fn goes(&self, speed: f64, is_playing: bool) {
            let velocity = [0.0, 0.0, speed, 0.0, 0.0, 0.0];
            *self.shared.latest.lock().unwrap() = Some(State { velocity, is_playing, ..STATE });
        }

        /// Does something in which time passes as it is slept.
        fn sleeping<T>(&self, work: impl FnOnce() -> T) -> T {
            let (is_over, hand) = (AtomicBool::new(false), &self.hand);
            thread::scope(|scope| {
                scope.spawn(|| {
                    while !is_over.load(Ordering::Acquire) {
                        if hand.waiting() > 0 {
                            hand.advance(MS);
                        }
                        thread::yield_now();
                    }
                });
                let done = work();
                is_over.store(true, Ordering::Release);
                done
            })
        }

        /// Some time without orders.
        fn without_orders(&self, driver: &mut Driver<'_, Fake>, ms: u32) {
            for _ in 0..ms / 5 {
                self.hand.advance(TURN);
                self.sleeping(|| driver.turn(None)).unwrap();
            }
        }

        fn order(&self, driver: &mut Driver<'_, Fake>, number: u64, what: What) {
            self.sleeping(|| driver.turn(Some(Order { number, what }))).unwrap();
        }

        fn calls(&self) -> Vec<(u128, Call)> {
            self.fake.calls.take()
        }

        /// All that was reported.
        fn reports(self) -> Vec<Report> {
            drop(self.shared);
            let mut text = String::new();
            let mut reports = self.reports;
            reports.read_to_string(&mut text).unwrap();
            text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
        }
    }

    #[test]
    fn orders_that_stay_away_for_60_ms_leave_the_arm_to_brake_and_then_it_is_fed() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.goes(20e-3, true);
        bench.order(&mut driver, 1, UP);
        assert_eq!(bench.shared.number(), 1);
        assert_eq!(bench.calls(), [(0, GOING_UP)]);
        bench.without_orders(&mut driver, 60);
        assert_eq!(bench.calls(), [], "not a moment before");
        bench.without_orders(&mut driver, 10);
        assert_eq!(bench.calls(), [65, 70].map(|ms| (ms, Speed(0.0, 2.0))));
        bench.goes(0.0, true);
        bench.without_orders(&mut driver, 100);
        let braking = [75, 80, 85, 90].map(|ms| (ms, Speed(0.0, 2.0)));
        let resting = [(95, Feed), (115, Feed), (135, Feed), (155, Feed)];
        assert_eq!(bench.calls(), [&braking[..], &[(90, HardStop(10.0))], &resting].concat());
    }

    #[test]
    fn an_arm_that_does_not_stand_is_braked_on_and_on_and_never_fed() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.goes(20e-3, true);
        bench.order(&mut driver, 1, UP);
        bench.without_orders(&mut driver, 1000);
        let calls = bench.calls();
        assert!(calls[1..].iter().all(|(_, call)| *call == Speed(0.0, 2.0)), "{calls:?}");
        assert_eq!(calls.len(), 1 + (1000 - 60) / 5);
    }

    #[test]
    fn orders_that_come_in_time_keep_it_going() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.goes(20e-3, true);
        for number in 0..10 {
            bench.order(&mut driver, number, UP);
            bench.without_orders(&mut driver, 60);
        }
        assert_eq!(bench.calls(), std::array::from_fn::<_, 10, _>(|at| (60 * at as u128, GOING_UP)));
    }

    #[test]
    fn at_rest_it_is_fed_each_20_ms_and_with_each_order_while_the_program_runs() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.without_orders(&mut driver, 45);
        assert_eq!(bench.calls(), [(20, Feed), (40, Feed)]);
        bench.order(&mut driver, 1, What::Stop { deceleration: 1.0 });
        bench.without_orders(&mut driver, 20);
        assert_eq!(bench.calls(), [(45, Feed), (65, Feed)]);
        bench.fake.is_running.set(false);
        bench.without_orders(&mut driver, 100);
        assert_eq!(bench.calls(), []);
    }

    #[test]
    fn a_call_that_hangs_feeds_nothing_and_is_not_served() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.fake.takes.set(500 * MS);
        bench.order(&mut driver, 1, What::Zero);
        assert_eq!(bench.shared.number(), 1);
        bench.fake.takes.set(Duration::ZERO);
        bench.without_orders(&mut driver, 5);
        assert_eq!(bench.calls(), [(0, Zero), (505, Feed)]);
        assert_eq!(bench.reports(), [Report::Done { number: 1 }]);
    }

    #[test]
    fn a_stop_brakes_as_it_is_told_and_ends_hard_when_the_state_shows_rest_20_ms_later() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.order(&mut driver, 1, UP);
        // the states do not show yet that it moves
        bench.goes(0.0, true);
        bench.order(&mut driver, 2, What::Stop { deceleration: 0.5 });
        bench.without_orders(&mut driver, 30);
        let braking = [0, 5, 10, 15, 20, 25].map(|ms| (ms, Speed(0.0, 0.5)));
        assert_eq!(bench.calls(), [&[(0, GOING_UP)], &braking[..], &[(25, HardStop(10.0)), (30, Feed)]].concat());
    }

    #[test]
    fn a_press_has_two_cycles_for_itself_and_is_said_again_after_100_ms() {
        let press = |angle: f64, force_n: f64| What::Press {
            frame: [0.0, 0.0, 0.0, angle, 0.0, 0.0],
            force_n,
            speed: 5e-3,
            feed: [0.0, 0.0, 1e-3],
            acceleration: 0.5,
        };
        let feed = Speed(1e-3, 0.5);
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.order(&mut driver, 1, press(0.0, 5.0));
        assert_eq!(bench.calls(), [(0, Press(0.0, 5.0)), (4, feed)]);
        for number in [2, 3] {
            bench.hand.advance(50 * MS);
            bench.order(&mut driver, number, press(0.0, 5.0));
        }
        // since the beginning 100 ms and the two cycles
        assert_eq!(bench.calls(), [(54, feed), (104, Press(0.0, 5.0)), (108, feed)]);
        // another axis, another force, another motion
        bench.order(&mut driver, 4, press(0.1, 5.0));
        bench.order(&mut driver, 5, press(0.1, 4.0));
        bench.order(&mut driver, 6, UP);
        let turned = [(108, Press(0.1, 5.0)), (112, feed), (112, Press(0.1, 4.0)), (116, feed)];
        assert_eq!(bench.calls(), [&turned[..], &[(116, HardStop(10.0)), (116, EndPress), (116, GOING_UP)]].concat());
    }

    #[test]
    fn a_refused_call_is_reported_after_40_ms_in_which_no_state_says_that_the_program_has_ended() {
        for (is_playing, ends_at, told) in [(true, 40, 1), (false, 0, 0)] {
            let bench = Bench::new();
            let mut driver = bench.driver();
            bench.goes(0.0, is_playing);
            bench.fake.refuses.set(true);
            bench.order(&mut driver, 1, UP);
            assert_eq!(bench.fake.clock.since(bench.fake.begun), ends_at * MS);
            let reports = bench.reports();
            assert_eq!(reports.len(), told);
            assert!(reports.iter().all(|report| matches!(report, Report::Failed { .. })), "{reports:?}");
        }
    }

    #[test]
    fn a_program_has_five_seconds_to_start_and_the_watchdog_is_set_last() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.fake.is_running.set(false);
        bench.sleeping(|| driver.prepare()).unwrap();
        let set = [("payload", 0.25), ("tool", 0.15), ("damping", 0.025), ("watchdog", 10.0)];
        assert_eq!(bench.calls(), set.map(|(what, value)| (5_000, Set(what, value))));
    }

    #[test]
    fn another_tool_than_it_was_told_and_a_lost_connection_end_it() {
        let (_sender, orders) = channel();
        let bench = Bench::new();
        bench.fake.tool.set([0.0; 6]);
        assert!(matches!(bench.driver().run(&orders), Err(End::BadTool(reason)) if reason.contains("0.15")));
        assert!(!bench.calls().contains(&(0, Set("watchdog", 10.0))));
        let bench = Bench::new();
        bench.fake.is_connected.set(false);
        assert!(matches!(bench.driver().run(&orders), Err(End::Lost(Link::Control))));
        assert_eq!(bench.reports(), [Report::Ready]);
    }

    #[test]
    fn where_orders_end_it_brakes_and_ends_the_program() {
        let bench = Bench::new();
        let mut driver = bench.driver();
        bench.order(&mut driver, 1, UP);
        bench.goes(0.0, true);
        bench.sleeping(|| driver.end());
        let braking = [0, 5, 10, 15, 20, 25].map(|ms| (ms, Speed(0.0, 2.0)));
        let end = [(25, HardStop(10.0)), (30, EndProgram)];
        assert_eq!(bench.calls(), [&[(0, GOING_UP)], &braking[..], &end].concat());
    }

    #[test]
    fn of_orders_that_wait_the_newest_counts_and_no_zero_is_left_out() {
        let (sender, orders) = channel();
        for (number, what) in [(2, UP), (3, What::Zero), (4, UP), (5, What::Stop { deceleration: 1.0 })] {
            sender.send(Order { number, what }).unwrap();
        }
        assert_eq!(newest(Order { number: 1, what: UP }, &orders).number, 3);
        assert_eq!(newest(orders.recv().unwrap(), &orders).number, 5);
    }
}
