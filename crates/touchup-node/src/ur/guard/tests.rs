//! The guard on a clock that the tests move.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

use super::*;
use crate::ur::dashboard::tests::listen;
use crate::ur::protocol::ProgramState::{Ended, Paused, Playing};
use crate::ur::protocol::tests::STATE;

const MS: Duration = Duration::from_millis(1);

struct GuardBench {
    known: GuardState,
    clock: Clock,
    hand: ManualClock,
}

impl GuardBench {
    fn new() -> Self {
        let (clock, hand) = Clock::manual();
        Self {
            known: GuardState::new(Deadlines::default(), clock.now()),
            clock,
            hand,
        }
    }

    fn ready() -> Self {
        let mut bench = Self::new();
        assert_eq!(bench.take(ClientReport::Ready), None);
        bench
    }

    fn take(&mut self, report: ClientReport) -> Option<ClientLoss> {
        self.known.take(report, self.clock.now())
    }

    /// Repeats a line each millisecond; returns the number of lines until a fault, and the fault.
    fn until_broken(&mut self, line: &ClientReport) -> (u64, ClientLoss) {
        for ms in 1..10_000 {
            self.hand.advance(MS);
            if let Some(broken) = self.take(line.clone()) {
                return (ms, broken);
            }
        }
        panic!("nothing is ever wrong");
    }
}

fn state(program: ProgramState, safety_bits: u32, served: u64) -> ClientReport {
    ClientReport::State(Box::new(UrState {
        program,
        safety_bits,
        served,
        ..STATE
    }))
}

const UP: OrderAction = OrderAction::Move {
    twist: [0.0, 0.0, 20e-3, 0.0, 0.0, 0.0],
    acceleration: 1.0,
};

#[test]
fn a_client_has_ten_seconds_to_be_ready_and_from_then_on_80_ms_for_each_line() {
    let mut bench = GuardBench::new();
    bench.hand.advance(9_000 * MS);
    // its lines in that time change nothing
    assert_eq!(bench.take(ClientReport::Beat { served: 0 }), None);
    assert_eq!(bench.known.patience(bench.clock.now()), 1_000 * MS);
    bench.hand.advance(999 * MS);
    assert_eq!(bench.known.patience(bench.clock.now()), MS);
    bench.hand.advance(MS);
    assert_eq!(bench.known.patience(bench.clock.now()), Duration::ZERO);
    assert_eq!(
        bench.known.missed(),
        ClientLoss::client("hangs: it is not ready for 10000 ms".to_owned())
    );
    assert_eq!(bench.take(ClientReport::Ready), None);
    assert_eq!(bench.known.patience(bench.clock.now()), 80 * MS);
    assert_eq!(
        bench.known.missed(),
        ClientLoss::client("hangs: nothing from it for 80 ms".to_owned())
    );
}

#[test]
fn states_that_stay_away_for_more_than_80_ms_are_a_lost_arm() {
    let mut bench = GuardBench::ready();
    bench.hand.advance(50 * MS);
    assert_eq!(bench.take(state(Playing, 1, 0)), None);
    let broken = bench.until_broken(&ClientReport::Beat { served: 0 });
    assert_eq!(
        broken,
        (81, ClientLoss::Arm(ArmError::Lost { silent_ms: 81 }))
    );
}

#[test]
fn a_call_that_does_not_return_for_more_than_120_ms_is_a_hanging_client() {
    let mut bench = GuardBench::ready();
    assert_eq!(bench.known.send(&UP, bench.clock.now()), 1);
    bench.hand.advance(100 * MS);
    assert_eq!(bench.known.send(&UP, bench.clock.now()), 2);
    // the first call has returned: the time of the second begins
    assert_eq!(bench.take(state(Playing, 1, 1)), None);
    let broken = bench.until_broken(&state(Playing, 1, 1));
    let hangs = |ms| {
        ClientLoss::client(format!(
            "hangs: a call of ur-rtde has not returned for {ms} ms"
        ))
    };
    assert_eq!(broken, (121, hangs(121)));
    // without a running call there is no deadline
    assert_eq!(bench.take(state(Playing, 1, 2)), None);
    bench.hand.advance(5_000 * MS);
    assert_eq!(bench.take(state(Playing, 1, 2)), None);
    // zeroing has three seconds, and the next order 120 ms again
    assert_eq!(bench.known.send(&OrderAction::Zero, bench.clock.now()), 3);
    assert_eq!(
        bench.until_broken(&state(Playing, 1, 2)),
        (3_001, hangs(3_001))
    );
    assert_eq!(bench.take(ClientReport::Done { number: 3 }), None);
    assert_eq!(bench.known.done, 3);
    bench.known.send(&UP, bench.clock.now());
    assert_eq!(bench.until_broken(&state(Playing, 1, 3)), (121, hangs(121)));
}

#[test]
fn a_program_that_has_ended_is_reported_after_40_ms_unless_the_state_gives_the_reason() {
    let mut bench = GuardBench::ready();
    let has_ended = |bench: &GuardBench| bench.known.has_ended(bench.clock.now());
    bench.take(state(Ended, 1, 0));
    bench.hand.advance(40 * MS);
    bench.take(state(Ended, 1, 0));
    assert!(!has_ended(&bench));
    bench.hand.advance(MS);
    assert!(has_ended(&bench));
    // a protective stop
    bench.take(state(Ended, 1 << 2, 0));
    assert!(!has_ended(&bench));
    bench.take(state(Ended, 1, 0));
    bench.hand.advance(30 * MS);
    // the program runs again
    bench.take(state(Playing, 1, 0));
    bench.hand.advance(30 * MS);
    assert!(!has_ended(&bench));
}

#[test]
fn a_client_that_is_asked_to_end_has_a_second_and_a_half() {
    let mut bench = GuardBench::ready();
    bench.known.close(bench.clock.now());
    bench.hand.advance(1_499 * MS);
    bench.take(state(Playing, 1, 0));
    assert_eq!(bench.known.patience(bench.clock.now()), MS);
    bench.hand.advance(MS);
    assert_eq!(bench.known.patience(bench.clock.now()), Duration::ZERO);
    assert_eq!(
        bench.known.missed(),
        ClientLoss::client("hangs: it does not end for 1500 ms".to_owned())
    );
}

#[test]
fn untaken_states_are_the_newest_64() {
    let mut bench = GuardBench::ready();
    for served in 0..100 {
        bench.take(state(Playing, 1, served));
    }
    let served: Vec<u64> = bench
        .known
        .states
        .iter()
        .map(|state| state.served)
        .collect();
    assert_eq!(served, (36..100).collect::<Vec<_>>());
}

/// A dashboard that answers `stop` and records its requests, and a guard of a client whose lines
/// come from the test.
struct Watch {
    hand: ManualClock,
    shared: Arc<SharedGuard>,
    reports: Sender<ClientReport>,
    asked: Receiver<String>,
    guard: JoinHandle<Option<Halt>>,
    client: u32,
}

impl Watch {
    /// - `connections`: number of connections to the dashboard; it serves the last one and closes
    ///   earlier ones.
    fn begin(connections: usize) -> Self {
        let (host, listener) = listen();
        let (ask, asked) = channel();
        thread::spawn(move || {
            for left in (0..connections).rev() {
                let (mut socket, _) = listener.accept().unwrap();
                writeln!(socket, "Connected: a test").unwrap();
                if left > 0 {
                    continue;
                }
                for line in BufReader::new(socket.try_clone().unwrap())
                    .lines()
                    .map_while(Result::ok)
                {
                    ask.send(line).unwrap();
                    writeln!(socket, "Stopped").unwrap();
                }
            }
        });
        let (clock, hand) = Clock::manual();
        // answers of the dashboard come in real time
        let deadlines = Deadlines {
            dashboard: Duration::from_secs(60),
            ..Deadlines::default()
        };
        let dashboard = Dashboard::connect(&host, deadlines.dashboard).unwrap();
        let shared = Arc::new(SharedGuard::new(deadlines, clock));
        let mut command = Command::new("sleep");
        let child = command
            .arg("1000")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let client = child.id();
        let (reports, lines) = channel();
        let guard = Guard {
            child,
            host,
            dashboard,
            shared: shared.clone(),
            hand: None,
        };
        let guard = thread::spawn(move || guard.watch(&lines));
        while hand.waiting() == 0 {
            thread::yield_now();
        }
        Self {
            hand,
            shared,
            reports,
            asked,
            guard,
            client,
        }
    }

    /// Sends a line, and returns when the guard waits for the next one.
    fn say(&self, report: ClientReport) {
        let begun = self.hand.begun();
        self.reports.send(report).unwrap();
        while self.hand.begun() == begun {
            thread::yield_now();
        }
    }

    /// Asserts that no fault occurs for some time.
    fn is_calm_after(&self, time: Duration) {
        self.hand.advance(time);
        assert_eq!(self.hand.waiting(), 1, "it waits on");
        assert!(self.shared.known().broken.is_none() && self.asked.try_recv().is_err());
    }

    /// Asserts that the guard stops waiting after some time.
    fn acts_after(&self, time: Duration) {
        self.hand.advance(time);
        assert_eq!(self.hand.waiting(), 0, "it waits on");
    }

    /// Asks the client to end and closes its pipe; returns how the guard stopped the arm.
    fn end_on_request(self) -> Option<Halt> {
        self.shared.known().close(self.shared.clock.now());
        drop(self.reports);
        self.guard.join().unwrap()
    }

    /// Result of the guard, the fault, and the requests to the dashboard.
    fn end(self) -> (Option<Halt>, Option<ClientLoss>, Vec<String>) {
        let begun = Instant::now();
        while !self.guard.is_finished() {
            assert!(begun.elapsed() < Duration::from_secs(60), "it never ends");
            thread::sleep(MS);
        }
        let halt = self.guard.join().unwrap();
        let client = format!("/proc/{}", self.client);
        assert!(
            !std::path::Path::new(&client).exists(),
            "the client is gone"
        );
        let broken = self.shared.known().broken.clone();
        (halt, broken, self.asked.iter().collect())
    }
}

const STOPPED: Option<Halt> = Some(Halt::Dashboard {
    took: Duration::ZERO,
});

#[test]
fn a_missed_line_kills_the_client_and_stops_the_arm() {
    let watch = Watch::begin(1);
    watch.say(ClientReport::Ready);
    watch.is_calm_after(79 * MS);
    watch.say(ClientReport::Beat { served: 0 });
    watch.is_calm_after(79 * MS);
    watch.acts_after(MS);
    let (halt, broken, asked) = watch.end();
    assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
    assert_eq!(
        broken,
        Some(ClientLoss::client(
            "hangs: nothing from it for 80 ms".to_owned()
        ))
    );
}

#[test]
fn silent_states_stop_the_arm_though_lines_come() {
    let watch = Watch::begin(1);
    watch.say(ClientReport::Ready);
    watch.is_calm_after(40 * MS);
    watch.say(ClientReport::Beat { served: 0 });
    watch.is_calm_after(40 * MS);
    watch.say(ClientReport::Beat { served: 0 });
    watch.is_calm_after(MS);
    watch
        .reports
        .send(ClientReport::Beat { served: 0 })
        .unwrap();
    let (halt, broken, asked) = watch.end();
    assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
    assert_eq!(
        broken,
        Some(ClientLoss::Arm(ArmError::Lost { silent_ms: 81 }))
    );
}

#[test]
fn a_client_that_is_never_ready_is_killed_and_no_other_program_is_stopped() {
    let watch = Watch::begin(1);
    watch.is_calm_after(9_999 * MS);
    watch.acts_after(MS);
    let (halt, broken, asked) = watch.end();
    assert_eq!((halt, asked), (None, Vec::new()));
    assert_eq!(
        broken,
        Some(ClientLoss::client(
            "hangs: it is not ready for 10000 ms".to_owned()
        ))
    );
}

#[test]
fn a_client_that_does_not_end_is_killed_and_the_arm_stopped() {
    let watch = Watch::begin(1);
    watch.say(ClientReport::Ready);
    watch.shared.known().close(watch.shared.clock.now());
    watch.say(ClientReport::Beat { served: 0 });
    watch.is_calm_after(1_499 * MS);
    watch.acts_after(MS);
    let (halt, broken, asked) = watch.end();
    assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
    assert_eq!(
        broken,
        Some(ClientLoss::client(
            "hangs: it does not end for 1500 ms".to_owned()
        ))
    );
}

#[test]
fn a_client_that_ends_on_request_is_no_fault() {
    let watch = Watch::begin(1);
    watch.say(ClientReport::Ready);
    watch.shared.known().close(watch.shared.clock.now());
    let Watch {
        guard,
        reports,
        shared,
        asked,
        ..
    } = watch;
    drop(reports);
    assert_eq!((guard.join().unwrap(), asked.iter().count()), (None, 0));
    assert!(shared.known().broken.is_none());
}

#[test]
fn a_dashboard_that_was_closed_is_connected_again_to_stop_the_arm() {
    let watch = Watch::begin(2);
    watch.reports.send(ClientReport::Ready).unwrap();
    // a later line reveals the closed connection
    while watch.reports.send(ClientReport::Beat { served: 0 }).is_ok() {
        thread::yield_now();
    }
    let (halt, broken, asked) = watch.end();
    assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
    assert_eq!(
        broken,
        Some(ClientLoss::Arm(ArmError::Dropped {
            what: "its dashboard"
        }))
    );
}

fn moving(speed: f64, served: u64) -> ClientReport {
    ClientReport::State(Box::new(UrState {
        velocity: [0.0, 0.0, speed, 0.0, 0.0, 0.0],
        served,
        ..STATE
    }))
}

/// Every call returns, every line comes, and the arm goes on.
#[test]
fn an_arm_that_does_not_do_what_it_is_ordered_to_is_stopped_by_the_dashboard() {
    let watch = Watch::begin(1);
    watch.say(ClientReport::Ready);
    for _ in 0..100 {
        let number = watch.shared.known().send(&UP, watch.shared.clock.now());
        watch.hand.advance(2 * MS);
        watch.say(moving(20e-3, number));
    }
    let stop = OrderAction::Stop { deceleration: 1.0 };
    let mut after = 0;
    while !watch.guard.is_finished() && after < 1000 {
        let number = watch.shared.known().send(&stop, watch.shared.clock.now());
        watch.hand.advance(2 * MS);
        after += 2;
        let begun = watch.hand.begun();
        let _ = watch.reports.send(moving(20e-3, number));
        while watch.hand.begun() == begun && !watch.guard.is_finished() {
            thread::yield_now();
        }
    }
    let (halt, broken, asked) = watch.end();
    assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
    assert!(
        matches!(broken, Some(ClientLoss::Arm(ArmError::Disobeys { .. }))),
        "{broken:?}"
    );
    assert!((100..=130).contains(&after), "{after} ms");
}

/// One state each 2 ms with a cycle count; returns the time of the hang fault and its silent time,
/// ms.
fn hangs(count: impl Fn(i32) -> Option<i32>) -> Option<(i32, f64)> {
    let mut bench = GuardBench::ready();
    (0..500).find_map(|number| {
        bench.hand.advance(2 * MS);
        let state = UrState {
            stamp_s: 86_400.0 + f64::from(number) * 2e-3,
            cycle: count(number)?,
            ..STATE
        };
        match bench.take(ClientReport::State(Box::new(state)))? {
            ClientLoss::Arm(ArmError::ProgramHangs { silent_ms, .. }) => {
                Some((number * 2, silent_ms.round()))
            }
            other => panic!("{other:?}"),
        }
    })
}

#[test]
fn a_program_that_counts_no_cycle_for_two_of_them_hangs_and_one_that_is_late_by_one_does_not() {
    assert_eq!(hangs(Some), None);
    // a hang at 200 ms, after the count of that cycle
    assert_eq!(hangs(|number| Some(number.min(100))), Some((204, 4.0)));
    assert_eq!(hangs(|number| Some(number / 2)), None, "each takes two");
    assert_eq!(hangs(|number| Some(number / 3)), Some((4, 4.0)));
    assert_eq!(hangs(|number| Some(number % 7)), None, "begins anew");
    // missing states do not shorten the time
    let left_out = |number: i32| (number != 101).then_some(number.min(100));
    assert_eq!(hangs(left_out), Some((204, 4.0)));
    // a command of 300 ms, and a hang after it
    let command = |number: i32| {
        Some(if (100..250).contains(&number) {
            -1
        } else {
            number.min(300)
        })
    };
    assert_eq!(hangs(command), Some((604, 4.0)));
}

/// A resumed program has nothing to continue.
#[test]
fn a_program_that_somebody_pauses_is_ended_once() {
    for stopped in [
        state(Paused, 1, 0),
        state(Paused, 1 << 4, 0),
        state(Playing, 1 << 2, 0),
    ] {
        let watch = Watch::begin(1);
        watch.say(ClientReport::Ready);
        watch.say(state(Playing, 1, 0));
        for _ in 0..5 {
            watch.say(stopped.clone());
        }
        assert_eq!(watch.asked.recv(), Ok("stop".to_owned()));
        watch.say(state(Ended, 1, 0));
        watch.hand.advance(41 * MS);
        let reason = watch.shared.known().ended();
        let was_paused = matches!(&stopped, ClientReport::State(state) if state.program == Paused);
        assert_eq!(
            reason,
            if was_paused {
                ArmError::ProgramPaused
            } else {
                ArmError::ProgramEnded
            }
        );
        assert!(watch.asked.try_recv().is_err() && watch.shared.known().broken.is_none());
        assert_eq!(watch.end_on_request(), None);
    }
}

/// The first two connections never answer a request, the third does.
#[test]
fn a_mute_dashboard_is_asked_until_it_has_stopped_the_arm() {
    let (host, listener) = listen();
    let (ask, asked) = channel();
    let serve = thread::spawn(move || {
        let mut connections = Vec::new();
        for number in 0..3 {
            let (mut socket, _) = listener.accept().unwrap();
            writeln!(socket, "Connected: a test").unwrap();
            let mut line = String::new();
            BufReader::new(socket.try_clone().unwrap())
                .read_line(&mut line)
                .unwrap();
            ask.send((number, line)).unwrap();
            if number == 2 {
                writeln!(socket, "Stopped").unwrap();
            }
            connections.push(socket);
        }
    });
    let deadlines = Deadlines {
        dashboard: 50 * MS,
        ..Deadlines::default()
    };
    let (clock, _hand) = Clock::manual();
    let dashboard = Dashboard::connect(&host, deadlines.dashboard).unwrap();
    let shared = Arc::new(SharedGuard::new(deadlines, clock));
    let child = Command::new("true").spawn().unwrap();
    let mut guard = Guard {
        child,
        host,
        dashboard,
        shared: shared.clone(),
        hand: None,
    };
    assert_eq!(guard.halt(), Halt::Watchdog);
    guard.child.wait().unwrap();
    serve.join().unwrap();
    assert_eq!(
        asked.iter().collect::<Vec<_>>(),
        [0, 1, 2].map(|number| (number, "stop\n".to_owned()))
    );
    shared.ask_no_more();
}

#[test]
fn a_program_that_has_ended_by_itself_is_not_stopped_again() {
    let watch = Watch::begin(1);
    watch.say(ClientReport::Ready);
    watch.say(state(Ended, 1 << 2, 0));
    watch.is_calm_after(MS);
    assert_eq!(watch.end_on_request(), None);
}
