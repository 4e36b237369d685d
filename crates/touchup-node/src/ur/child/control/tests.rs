//! The driver on a clock that the tests move, with a library that records its calls.

use std::cell::{Cell, RefCell};
use std::io::{PipeReader, Read, pipe};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;
use std::thread;

use self::LibraryCall::{EndPress, EndProgram, Feed, HardStop, Press, Set, Speed, Zero};
use super::*;
use crate::ur::child::shared::lines_to;
use crate::ur::protocol::ProgramState::{self, Ended, Paused, Playing};
use crate::ur::protocol::tests::STATE;
use touchup_session::clock::ManualClock;

const MS: Duration = Duration::from_millis(1);
const UP: OrderAction = OrderAction::Move {
    twist: [0.0, 0.0, 20e-3, 0.0, 0.0, 0.0],
    acceleration: 1.0,
};
const GOING_UP: LibraryCall = Speed(20e-3, 1.0);

fn press(angle: f64, force_n: f64) -> OrderAction {
    let frame = [0.0, 0.0, 0.0, angle, 0.0, 0.0];
    OrderAction::Press {
        frame,
        force_n,
        speed: 5e-3,
        feed: [0.0, 0.0, 1e-3],
        acceleration: 0.5,
    }
}

/// A call of the library.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LibraryCall {
    /// velocity along z, and acceleration
    Speed(f64, f64),
    /// rotation of the frame about x, and force
    Press(f64, f64),
    EndPress,
    HardStop(f64),
    Zero,
    Set(&'static str, f64),
    Feed,
    EndProgram,
}

/// A library that records its calls with their time, ms; and an arm that follows.
struct Fake {
    clock: Clock,
    begun: Instant,
    calls: RefCell<Vec<(u128, LibraryCall)>>,
    is_connected: Cell<bool>,
    is_running: Cell<bool>,
    refuses: Cell<bool>,
    /// duration of each call
    takes: Cell<Duration>,
    tool: Cell<[f64; 6]>,
}

impl Fake {
    fn call(&self, call: LibraryCall) -> Result<(), ChildError> {
        self.calls
            .borrow_mut()
            .push((self.clock.since(self.begun).as_millis(), call));
        if !self.takes.get().is_zero() {
            self.clock.sleep(self.takes.get());
        }
        if self.refuses.get() {
            return Err(ChildError::Python {
                call: "a call",
                reason: "it returned false".to_owned(),
            });
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

    fn press(
        &self,
        frame: [f64; 6],
        force: f64,
        _kind: i32,
        _limits: [f64; 6],
    ) -> Result<(), ChildError> {
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

fn see_again(shared: &ChildShared, clock: &Clock) {
    let state = shared.latest().unwrap().state;
    shared.see(state, clock.now());
}

struct ControlBench {
    hand: ManualClock,
    fake: Fake,
    shared: ChildShared,
    begin: Begin,
    reports: PipeReader,
}

impl ControlBench {
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
        let shared = ChildShared::new(lines_to(writer));
        shared.see(STATE, fake.begun);
        let begin = Begin {
            host: String::new(),
            site_packages: Default::default(),
            tool,
            mass_kg: 0.25,
            centre_m: [0.0, 0.0, 0.05],
            version: [5, 15],
            damping: 0.025,
            gain: 0.5,
            is_lock_step: false,
        };
        Self {
            hand,
            fake,
            shared,
            begin,
            reports,
        }
    }

    fn driver(&self) -> Driver<'_, Fake> {
        Driver::new(
            &self.fake,
            &self.shared,
            &self.begin,
            self.fake.clock.clone(),
        )
    }

    /// Sets the tip velocity of later states along z, m/s.
    fn goes(&self, speed: f64, program: ProgramState) {
        let velocity = [0.0, 0.0, speed, 0.0, 0.0, 0.0];
        self.shared.see(
            UrState {
                velocity,
                program,
                ..STATE
            },
            self.fake.clock.now(),
        );
    }

    /// Repeats the state unchanged.
    fn see_again(&self) {
        see_again(&self.shared, &self.fake.clock);
    }

    /// Runs work whose sleeps advance the clock.
    fn sleeping<T>(&self, work: impl FnOnce() -> T) -> T {
        let (is_over, hand) = (AtomicBool::new(false), &self.hand);
        let (shared, clock) = (&self.shared, &self.fake.clock);
        thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Acquire) {
                    if hand.waiting() > 0 {
                        hand.advance(MS);
                        see_again(shared, clock);
                    }
                    thread::yield_now();
                }
            });
            let done = work();
            is_over.store(true, Ordering::Release);
            done
        })
    }

    /// Lets time pass without orders.
    fn without_orders(&self, driver: &mut Driver<'_, Fake>, ms: u32) {
        for _ in 0..ms / 5 {
            self.hand.advance(TURN);
            self.see_again();
            self.sleeping(|| driver.turn(None)).unwrap();
        }
    }

    fn order(&self, driver: &mut Driver<'_, Fake>, number: u64, what: OrderAction) {
        self.see_again();
        self.sleeping(|| driver.turn(Some(Order { number, what })))
            .unwrap();
    }

    fn calls(&self) -> Vec<(u128, LibraryCall)> {
        self.fake.calls.take()
    }

    /// All reports.
    fn reports(self) -> Vec<ClientReport> {
        drop(self.shared);
        let mut text = String::new();
        let mut reports = self.reports;
        reports.read_to_string(&mut text).unwrap();
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }
}

#[test]
fn orders_that_stay_away_for_20_ms_leave_the_arm_to_brake_and_then_it_is_fed() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.goes(20e-3, Playing);
    bench.order(&mut driver, 1, UP);
    assert_eq!(bench.shared.number(), 1);
    assert_eq!(bench.calls(), [(0, GOING_UP)]);
    bench.without_orders(&mut driver, 20);
    assert_eq!(bench.calls(), [], "not a moment before");
    bench.without_orders(&mut driver, 10);
    assert_eq!(bench.calls(), [25, 30].map(|ms| (ms, Speed(0.0, 2.0))));
    bench.goes(0.0, Playing);
    bench.without_orders(&mut driver, 100);
    let braking = [35, 40, 45, 50].map(|ms| (ms, Speed(0.0, 2.0)));
    let resting = [(55, Feed), (75, Feed), (95, Feed), (115, Feed)];
    assert_eq!(
        bench.calls(),
        [&braking[..], &[(50, HardStop(10.0))], &resting].concat()
    );
}

#[test]
fn an_arm_that_does_not_stand_is_braked_on_and_on_and_never_fed() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.goes(20e-3, Playing);
    bench.order(&mut driver, 1, UP);
    bench.without_orders(&mut driver, 1000);
    let calls = bench.calls();
    assert!(
        calls[1..].iter().all(|(_, call)| *call == Speed(0.0, 2.0)),
        "{calls:?}"
    );
    assert_eq!(calls.len(), 1 + (1000 - 20) / 5);
}

#[test]
fn orders_that_come_in_time_keep_it_going() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.goes(20e-3, Playing);
    for number in 0..10 {
        bench.order(&mut driver, number, UP);
        bench.without_orders(&mut driver, 20);
    }
    assert_eq!(
        bench.calls(),
        std::array::from_fn::<_, 10, _>(|at| (20 * at as u128, GOING_UP))
    );
}

#[test]
fn at_rest_it_is_fed_each_20_ms_and_with_each_order_while_the_program_runs() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.without_orders(&mut driver, 45);
    assert_eq!(bench.calls(), [(20, Feed), (40, Feed)]);
    bench.order(&mut driver, 1, OrderAction::Stop { deceleration: 1.0 });
    bench.without_orders(&mut driver, 20);
    assert_eq!(bench.calls(), [(45, Feed), (65, Feed)]);
    bench.fake.is_running.set(false);
    bench.without_orders(&mut driver, 100);
    assert_eq!(bench.calls(), []);
}

#[test]
fn a_call_that_hangs_feeds_nothing_and_is_not_served() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.fake.takes.set(500 * MS);
    bench.order(&mut driver, 1, OrderAction::Zero);
    assert_eq!(bench.shared.number(), 1);
    bench.fake.takes.set(Duration::ZERO);
    bench.without_orders(&mut driver, 5);
    assert_eq!(bench.calls(), [(0, Zero), (505, Feed)]);
    assert_eq!(bench.reports(), [ClientReport::Done { number: 1 }]);
}

#[test]
fn a_stop_brakes_as_commanded_and_ends_hard_when_the_state_shows_rest_20_ms_later() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.order(&mut driver, 1, UP);
    // the states do not show the motion yet
    bench.goes(0.0, Playing);
    bench.order(&mut driver, 2, OrderAction::Stop { deceleration: 0.5 });
    bench.without_orders(&mut driver, 30);
    let braking = [0, 5, 10, 15, 20, 25].map(|ms| (ms, Speed(0.0, 0.5)));
    assert_eq!(
        bench.calls(),
        [
            &[(0, GOING_UP)],
            &braking[..],
            &[(25, HardStop(10.0)), (30, Feed)]
        ]
        .concat()
    );
}

#[test]
fn a_press_has_two_cycles_for_itself_and_is_repeated_after_100_ms() {
    let feed = Speed(1e-3, 0.5);
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.order(&mut driver, 1, press(0.0, 5.0));
    assert_eq!(bench.calls(), [(0, Press(0.0, 5.0)), (4, feed)]);
    for number in [2, 3] {
        bench.hand.advance(50 * MS);
        bench.order(&mut driver, number, press(0.0, 5.0));
    }
    // 100 ms since the beginning, plus two cycles
    assert_eq!(
        bench.calls(),
        [(54, feed), (104, Press(0.0, 5.0)), (108, feed)]
    );
    // another axis, another force, another motion
    bench.order(&mut driver, 4, press(0.1, 5.0));
    bench.order(&mut driver, 5, press(0.1, 4.0));
    bench.order(&mut driver, 6, UP);
    let turned = [
        (108, Press(0.1, 5.0)),
        (112, feed),
        (112, Press(0.1, 4.0)),
        (116, feed),
    ];
    assert_eq!(
        bench.calls(),
        [
            &turned[..],
            &[(116, HardStop(10.0)), (116, EndPress), (116, GOING_UP)]
        ]
        .concat()
    );
}

#[test]
fn a_refused_call_is_reported_after_40_ms_without_a_state_of_an_ended_program() {
    for (program, ends_at, expected) in [(Playing, 40, 1), (Paused, 0, 0), (Ended, 0, 0)] {
        let bench = ControlBench::new();
        let mut driver = bench.driver();
        bench.goes(0.0, program);
        bench.fake.refuses.set(true);
        bench.order(&mut driver, 1, UP);
        assert_eq!(bench.fake.clock.since(bench.fake.begun), ends_at * MS);
        let reports = bench.reports();
        assert_eq!(reports.len(), expected);
        assert!(
            reports
                .iter()
                .all(|report| matches!(report, ClientReport::Failed { .. })),
            "{reports:?}"
        );
    }
}

#[test]
fn a_program_has_five_seconds_to_start_and_the_watchdog_is_set_last() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.fake.is_running.set(false);
    bench.sleeping(|| driver.prepare()).unwrap();
    let set = [
        ("payload", 0.25),
        ("tool", 0.15),
        ("damping", 0.025),
        ("watchdog", 10.0),
    ];
    assert_eq!(
        bench.calls(),
        set.map(|(what, value)| (5_000, Set(what, value)))
    );
}

#[test]
fn another_tool_than_the_set_one_and_a_lost_connection_end_it() {
    let (_sender, orders) = channel();
    let bench = ControlBench::new();
    bench.fake.tool.set([0.0; 6]);
    assert!(
        matches!(bench.driver().run(&orders), Err(DriverEnd::BadTool(reason)) if reason.contains("0.15"))
    );
    assert!(!bench.calls().contains(&(0, Set("watchdog", 10.0))));
    let bench = ControlBench::new();
    bench.fake.is_connected.set(false);
    assert!(matches!(
        bench.driver().run(&orders),
        Err(DriverEnd::Lost(RtdeConnection::Control))
    ));
    assert_eq!(bench.reports(), [ClientReport::Ready]);
}

#[test]
fn where_orders_end_it_brakes_and_ends_the_program() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.order(&mut driver, 1, UP);
    bench.goes(0.0, Playing);
    bench.sleeping(|| driver.end());
    let braking = [0, 5, 10, 15, 20, 25].map(|ms| (ms, Speed(0.0, 2.0)));
    let end = [(25, HardStop(10.0)), (30, EndProgram)];
    assert_eq!(
        bench.calls(),
        [&[(0, GOING_UP)], &braking[..], &end].concat()
    );
}

#[test]
fn of_orders_that_wait_the_newest_counts_and_no_zero_is_left_out() {
    let (sender, orders) = channel();
    for (number, what) in [
        (2, UP),
        (3, OrderAction::Zero),
        (4, UP),
        (5, OrderAction::Stop { deceleration: 1.0 }),
    ] {
        sender.send(Order { number, what }).unwrap();
    }
    assert_eq!(
        newest(
            Order {
                number: 1,
                what: UP
            },
            &orders
        )
        .number,
        3
    );
    assert_eq!(newest(orders.recv().unwrap(), &orders).number, 5);
}

/// A pause in mid-move and a resumption: the thread of the motion still has the old velocity.
#[test]
fn an_order_that_fails_leaves_it_braking_until_it_is_seen_at_rest() {
    for (fails, braked) in [
        (OrderAction::Stop { deceleration: 0.5 }, Speed(0.0, 0.5)),
        (UP, Speed(0.0, 2.0)),
    ] {
        brakes_after_a_failed(fails, braked);
    }
}

fn brakes_after_a_failed(order: OrderAction, braked: LibraryCall) {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.shared.is_ready.store(true, Ordering::Release);
    bench.goes(40e-3, Playing);
    bench.order(&mut driver, 1, UP);
    // the call fails before any state explains it
    bench.fake.refuses.set(true);
    bench.order(&mut driver, 2, order);
    bench.goes(0.0, Paused);
    bench.calls();
    bench.without_orders(&mut driver, 2_000);
    assert_eq!(
        bench.calls(),
        [],
        "a program that is paused hears nothing, and is not fed"
    );
    bench.fake.refuses.set(false);
    // the first states after resumption show an arm that does not move yet
    bench.goes(0.0, Playing);
    bench.without_orders(&mut driver, 10);
    bench.goes(40e-3, Playing);
    bench.without_orders(&mut driver, 50);
    let calls = bench.calls();
    assert_eq!(calls[0].1, braked, "at once: {calls:?}");
    assert!(calls.iter().all(|(_, call)| *call == braked), "{calls:?}");
    bench.goes(0.0, Playing);
    bench.without_orders(&mut driver, 500);
    let calls = bench.calls();
    let (last, braking) = calls.split_last().unwrap();
    assert_eq!(
        last.1,
        HardStop(10.0),
        "once it is seen at rest, and nothing is fed after it: {calls:?}"
    );
    assert!(
        !braking.is_empty() && braking.iter().all(|(_, call)| *call == braked),
        "{calls:?}"
    );
}

#[test]
fn once_something_has_stopped_it_no_order_moves_it() {
    let protective = UrState {
        safety_bits: 1 << 2,
        ..STATE
    };
    for stopped in [
        UrState {
            program: Paused,
            ..STATE
        },
        UrState {
            program: Ended,
            ..STATE
        },
        protective,
    ] {
        let bench = ControlBench::new();
        let mut driver = bench.driver();
        bench.shared.is_ready.store(true, Ordering::Release);
        bench.shared.see(stopped, bench.fake.clock.now());
        bench.goes(0.0, Playing);
        bench.order(&mut driver, 1, UP);
        bench.order(&mut driver, 2, press(0.0, 5.0));
        bench.without_orders(&mut driver, 200);
        assert_eq!(bench.calls(), [], "{stopped:?}");
    }
}

#[test]
fn force_mode_is_ended_also_where_the_call_that_began_it_failed() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.goes(2e-3, Playing);
    bench.fake.refuses.set(true);
    bench.order(&mut driver, 1, press(0.0, 5.0));
    bench.fake.refuses.set(false);
    bench.order(&mut driver, 2, OrderAction::Stop { deceleration: 0.5 });
    let calls: Vec<_> = bench.calls().into_iter().map(|(_, call)| call).collect();
    assert_eq!(
        calls,
        [Press(0.0, 5.0), HardStop(10.0), EndPress, Speed(0.0, 0.5)]
    );
}

#[test]
fn an_arm_that_is_not_seen_to_stand_is_not_fed() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    // somebody else moves it
    bench.goes(10e-3, Playing);
    bench.without_orders(&mut driver, 100);
    // no more states
    bench.goes(0.0, Playing);
    for _ in 0..20 {
        bench.hand.advance(TURN);
        driver.turn(None).unwrap();
    }
    assert_eq!(bench.calls(), [5, 10, 15, 20].map(|_| (105, Feed))[..1]);
}

#[test]
fn a_sensor_is_not_zeroed_on_an_arm_that_does_not_come_to_rest() {
    let bench = ControlBench::new();
    let mut driver = bench.driver();
    bench.goes(20e-3, Playing);
    bench.order(&mut driver, 1, UP);
    bench.order(&mut driver, 2, OrderAction::Zero);
    let calls = bench.calls();
    assert!(
        calls[1..].iter().all(|(_, call)| *call == Speed(0.0, 2.0)),
        "{calls:?}"
    );
    assert!(
        matches!(&bench.reports()[..], [ClientReport::Failed { reason, .. }] if reason.contains("after braking for 5 s"))
    );
}
