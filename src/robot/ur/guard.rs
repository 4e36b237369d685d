//! Who waits for each line of the client with a deadline.
//!
//! When one stays away the guard kills the client, so that nothing feeds the arm any more, and stops the arm by the dashboard; then it
//! says why.

use std::collections::VecDeque;
use std::process::Child;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::dashboard::Dashboard;
use super::params::Deadlines;
use super::protocol::{Link, Report, State};
use crate::clock::{Clock, ManualClock};
use crate::robot::{ArmError, Safety};

/// States that wait for a caller who is late, 128 ms of them; older ones are dropped.
const WAITING: usize = 64;
/// A program that has ended is told after this time: the reason, when it is one of safety, comes a little later.
pub(super) const ENDED: Duration = Duration::from_millis(40);
/// Zeroing, with the braking before it, has this much time.
pub(super) const ZEROING: Duration = Duration::from_secs(3);
/// The client ends by itself within this time of its stdin.
pub(super) const FAREWELL: Duration = Duration::from_millis(1500);

/// How the arm was stopped after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halt {
    /// The dashboard said so.
    Dashboard {
        /// from the fault being seen to the answer
        took: Duration,
    },
    /// The dashboard does not answer; the watchdog of the controller stops the arm.
    Watchdog,
}

/// What the guard knows. It decides by what is reported and by the time that it is given, and waits for nothing.
pub(super) struct Known {
    pub deadlines: Deadlines,
    pub is_ready: bool,
    pub states: VecDeque<State>,
    pub done: u64,
    pub sent: u64,
    pub served: u64,
    /// when the client was started
    begun_at: Instant,
    /// since when an order waits for its call to return
    waiting_since: Option<Instant>,
    /// an order that takes its time
    asked: Option<u64>,
    /// when the last new state came
    fresh_at: Option<Instant>,
    /// since when the program of the controller does not run
    ended_since: Option<Instant>,
    pub broken: Option<Broken>,
    /// since when it is told to end
    closing_since: Option<Instant>,
}

/// Why there is no client any more.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Broken {
    /// the arm or its client
    Arm(ArmError),
    /// no library, or another one
    Wheel(String),
    /// the tool that was set is not there
    Tool(String),
}

/// What the guard knows, that it has changed, and the clock that all deadlines are kept on.
pub(super) struct Shared {
    pub known: Mutex<Known>,
    pub changed: Condvar,
    pub clock: Clock,
}

impl Shared {
    pub fn new(deadlines: Deadlines, clock: Clock) -> Self {
        Self { known: Mutex::new(Known::new(deadlines, clock.now())), changed: Condvar::new(), clock }
    }

    pub fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Broken {
    pub fn error(&self) -> ArmError {
        match self {
            Self::Arm(error) => error.clone(),
            Self::Wheel(reason) | Self::Tool(reason) => ArmError::Client { reason: reason.clone() },
        }
    }

    fn client(reason: String) -> Self {
        Self::Arm(ArmError::Client { reason })
    }
}

impl Known {
    pub fn new(deadlines: Deadlines, now: Instant) -> Self {
        Self {
            deadlines,
            is_ready: false,
            states: VecDeque::new(),
            done: 0,
            sent: 0,
            served: 0,
            begun_at: now,
            waiting_since: None,
            asked: None,
            fresh_at: None,
            ended_since: None,
            broken: None,
            closing_since: None,
        }
    }

    /// An order goes out; returns its number.
    ///
    /// - `takes_time`: it zeroes the sensor, after braking.
    pub fn send(&mut self, takes_time: bool, now: Instant) -> u64 {
        self.sent += 1;
        self.waiting_since.get_or_insert(now);
        if takes_time {
            self.asked = Some(self.sent);
        }
        self.sent
    }

    /// The client is told to end.
    pub fn close(&mut self, now: Instant) {
        self.closing_since = Some(now);
    }

    pub fn is_closing(&self) -> bool {
        self.closing_since.is_some()
    }

    /// Whether the program of the controller does not run, for long enough that the reason would have been told.
    pub fn has_ended(&self, now: Instant) -> bool {
        self.ended_since.is_some_and(|since| now.saturating_duration_since(since) > ENDED)
    }

    /// How long the next line may stay away from now on.
    pub fn patience(&self, now: Instant) -> Duration {
        let (since, deadline, _) = self.awaited();
        deadline.saturating_sub(now.saturating_duration_since(since.unwrap_or(now)))
    }

    /// What is wrong when that time has passed without a line.
    pub fn missed(&self) -> Broken {
        let (_, deadline, misses) = self.awaited();
        Broken::client(format!("hangs: {misses} for {} ms", deadline.as_millis()))
    }

    /// What is waited for: since when, where that was before now, how long, and what is said when it stays away.
    fn awaited(&self) -> (Option<Instant>, Duration, &'static str) {
        match (self.closing_since, self.is_ready) {
            (Some(since), _) => (Some(since), FAREWELL, "it does not end"),
            (_, true) => (None, self.deadlines.beat, "nothing from it"),
            (_, false) => (Some(self.begun_at), self.deadlines.connect, "it is not ready"),
        }
    }

    /// What a line tells; returns what is wrong.
    pub fn take(&mut self, report: Report, now: Instant) -> Option<Broken> {
        match report {
            Report::Ready => {
                (self.is_ready, self.fresh_at) = (true, Some(now));
                // those of before have the pose of another tool
                self.states.clear();
            }
            Report::State(state) => {
                self.fresh_at = Some(now);
                // where the safety system has ended it, the state says so by itself
                let has_ended = !state.is_playing && state.safety() == Safety::Normal;
                self.ended_since = has_ended.then(|| self.ended_since.unwrap_or(now));
                if self.states.len() == WAITING {
                    self.states.pop_front();
                }
                self.states.push_back(*state);
                self.serve(state.served, now);
            }
            Report::Beat { served } => self.serve(served, now),
            Report::Done { number } => {
                self.done = number;
                self.asked = self.asked.filter(|asked| *asked != number);
                self.serve(number, now);
            }
            Report::Lost { which } => {
                let what = match which {
                    Link::States => "its states",
                    Link::Control => "orders to it",
                };
                return Some(Broken::Arm(ArmError::Dropped { what }));
            }
            Report::BadWheel { reason } => return Some(Broken::Wheel(reason)),
            Report::BadTool { reason } => return Some(Broken::Tool(reason)),
            Report::Failed { call, reason } => {
                return Some(Broken::client(format!("was refused a call: {call}: {reason}")));
            }
        }
        let since = |at: Option<Instant>| at.map_or(Duration::ZERO, |at| now.saturating_duration_since(at));
        let silent = since(self.fresh_at);
        if self.is_ready && silent > self.deadlines.silent {
            return Some(Broken::Arm(ArmError::Lost { silent_ms: silent.as_millis() as u64 }));
        }
        let patience = if self.asked.is_some() { ZEROING } else { self.deadlines.order };
        let waited = since(self.waiting_since);
        (waited > patience)
            .then(|| Broken::client(format!("hangs: a call of ur-rtde has not returned for {} ms", waited.as_millis())))
    }

    fn serve(&mut self, served: u64, now: Instant) {
        if served > self.served {
            self.served = served;
            self.waiting_since = (served < self.sent).then_some(now);
        }
    }
}

/// The thread that waits with deadlines, with a dashboard for itself.
pub(super) struct Guard {
    pub child: Child,
    pub host: String,
    pub dashboard: Dashboard,
    pub shared: Arc<Shared>,
    /// of a controller in lock step: its states move the clock
    pub hand: Option<ManualClock>,
}

impl Guard {
    /// Until the client ends; returns how the arm was stopped when that was not wanted.
    pub fn watch(mut self, reports: &Receiver<Report>) -> Option<Halt> {
        let clock = self.shared.clock.clone();
        let mut stamp_s = f64::INFINITY;
        let broken = loop {
            let patience = self.shared.known().patience(clock.now());
            // lines may come and come from a client that is never ready or never ends
            let report =
                if patience.is_zero() { Err(RecvTimeoutError::Timeout) } else { clock.recv_timeout(reports, patience) };
            let broken = match report {
                Ok(report) => {
                    if let (Some(hand), Report::State(state)) = (&self.hand, &report) {
                        hand.advance(Duration::try_from_secs_f64(state.stamp_s - stamp_s).unwrap_or_default());
                        stamp_s = state.stamp_s;
                    }
                    let broken = self.shared.known().take(report, clock.now());
                    self.shared.changed.notify_all();
                    broken
                }
                // it ended because it was told to
                Err(RecvTimeoutError::Disconnected) if self.shared.known().is_closing() => break None,
                Err(RecvTimeoutError::Timeout) => Some(self.shared.known().missed()),
                Err(RecvTimeoutError::Disconnected) => {
                    let end = self.child.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
                    Some(Broken::client(format!("has ended ({end})")))
                }
            };
            if broken.is_some() {
                break broken;
            }
            if !self.dashboard.is_open() {
                break Some(Broken::Arm(ArmError::Dropped { what: "its dashboard" }));
            }
        };
        // nothing feeds the arm any more from here on; one that has ended already is as good
        let _ = self.child.kill();
        // before it is ready nothing of ours moves, and what runs may be somebody else's
        let halt = (broken.is_some() && self.shared.known().is_ready).then(|| self.halt());
        let _ = self.child.wait();
        if let Some(broken) = broken {
            tracing::error!(reason = %broken.error(), ?halt, "the arm was stopped");
            self.shared.known().broken = Some(broken);
            self.shared.changed.notify_all();
        }
        halt
    }

    fn halt(&mut self) -> Halt {
        let begun = self.shared.clock.now();
        let (host, deadline) = (&self.host, self.shared.known().deadlines.dashboard);
        let stopped = self.dashboard.stop().or_else(|error| {
            // one that was closed, not one that is silent, may be there again
            if self.dashboard.is_silent() { Err(error) } else { Dashboard::connect(host, deadline)?.stop() }
        });
        match stopped {
            Ok(()) => Halt::Dashboard { took: self.shared.clock.since(begun) },
            Err(error) => {
                tracing::error!(%error, "the arm cannot be stopped by its dashboard: its watchdog does it");
                Halt::Watchdog
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::net::TcpListener;
    use std::process::{Command, Stdio};
    use std::sync::mpsc::{Sender, channel};
    use std::thread::{self, JoinHandle};

    use super::*;
    use crate::robot::ur::protocol::tests::STATE;

    const MS: Duration = Duration::from_millis(1);

    struct Bench {
        known: Known,
        clock: Clock,
        hand: ManualClock,
    }

    impl Bench {
        fn new() -> Self {
            let (clock, hand) = Clock::manual();
            Self { known: Known::new(Deadlines::default(), clock.now()), clock, hand }
        }

        fn ready() -> Self {
            let mut bench = Self::new();
            assert_eq!(bench.take(Report::Ready), None);
            bench
        }

        fn take(&mut self, report: Report) -> Option<Broken> {
            self.known.take(report, self.clock.now())
        }

        /// Has the same line come each millisecond; returns after how many of them something is wrong, and what.
        fn until_broken(&mut self, line: &Report) -> (u64, Broken) {
            for ms in 1..10_000 {
                self.hand.advance(MS);
                if let Some(broken) = self.take(line.clone()) {
                    return (ms, broken);
                }
            }
            panic!("nothing is ever wrong");
        }
    }

    fn state(is_playing: bool, safety_bits: u32, served: u64) -> Report {
        Report::State(Box::new(State { is_playing, safety_bits, served, ..STATE }))
    }

    #[test]
    fn a_client_has_ten_seconds_to_be_ready_and_from_then_on_80_ms_for_each_line() {
        let mut bench = Bench::new();
        bench.hand.advance(9_000 * MS);
        // what it says meanwhile changes nothing
        assert_eq!(bench.take(Report::Beat { served: 0 }), None);
        assert_eq!(bench.known.patience(bench.clock.now()), 1_000 * MS);
        bench.hand.advance(999 * MS);
        assert_eq!(bench.known.patience(bench.clock.now()), MS);
        bench.hand.advance(MS);
        assert_eq!(bench.known.patience(bench.clock.now()), Duration::ZERO);
        assert_eq!(bench.known.missed(), Broken::client("hangs: it is not ready for 10000 ms".to_owned()));
        assert_eq!(bench.take(Report::Ready), None);
        assert_eq!(bench.known.patience(bench.clock.now()), 80 * MS);
        assert_eq!(bench.known.missed(), Broken::client("hangs: nothing from it for 80 ms".to_owned()));
    }

    #[test]
    fn states_that_stay_away_for_more_than_80_ms_are_a_lost_arm() {
        let mut bench = Bench::ready();
        bench.hand.advance(50 * MS);
        assert_eq!(bench.take(state(true, 1, 0)), None);
        let broken = bench.until_broken(&Report::Beat { served: 0 });
        assert_eq!(broken, (81, Broken::Arm(ArmError::Lost { silent_ms: 81 })));
    }

    #[test]
    fn a_call_that_does_not_return_for_more_than_200_ms_is_a_hanging_client() {
        let mut bench = Bench::ready();
        assert_eq!(bench.known.send(false, bench.clock.now()), 1);
        bench.hand.advance(150 * MS);
        assert_eq!(bench.known.send(false, bench.clock.now()), 2);
        // the first has returned: the time of the second begins
        assert_eq!(bench.take(state(true, 1, 1)), None);
        let broken = bench.until_broken(&state(true, 1, 1));
        let hangs = |ms| Broken::client(format!("hangs: a call of ur-rtde has not returned for {ms} ms"));
        assert_eq!(broken, (201, hangs(201)));
        // none under way, no deadline
        assert_eq!(bench.take(state(true, 1, 2)), None);
        bench.hand.advance(5_000 * MS);
        assert_eq!(bench.take(state(true, 1, 2)), None);
        // zeroing has three seconds, and what comes after it 200 ms again
        assert_eq!(bench.known.send(true, bench.clock.now()), 3);
        assert_eq!(bench.until_broken(&state(true, 1, 2)), (3_001, hangs(3_001)));
        assert_eq!(bench.take(Report::Done { number: 3 }), None);
        assert_eq!(bench.known.done, 3);
        bench.known.send(false, bench.clock.now());
        assert_eq!(bench.until_broken(&state(true, 1, 3)), (201, hangs(201)));
    }

    #[test]
    fn a_program_that_has_ended_is_told_after_40_ms_unless_the_state_says_why() {
        let mut bench = Bench::ready();
        let has_ended = |bench: &Bench| bench.known.has_ended(bench.clock.now());
        bench.take(state(false, 1, 0));
        bench.hand.advance(40 * MS);
        bench.take(state(false, 1, 0));
        assert!(!has_ended(&bench));
        bench.hand.advance(MS);
        assert!(has_ended(&bench));
        // a protective stop
        bench.take(state(false, 1 << 2, 0));
        assert!(!has_ended(&bench));
        bench.take(state(false, 1, 0));
        bench.hand.advance(30 * MS);
        // it runs again
        bench.take(state(true, 1, 0));
        bench.hand.advance(30 * MS);
        assert!(!has_ended(&bench));
    }

    #[test]
    fn a_client_that_is_told_to_end_has_a_second_and_a_half() {
        let mut bench = Bench::ready();
        bench.known.close(bench.clock.now());
        bench.hand.advance(1_499 * MS);
        bench.take(state(true, 1, 0));
        assert_eq!(bench.known.patience(bench.clock.now()), MS);
        bench.hand.advance(MS);
        assert_eq!(bench.known.patience(bench.clock.now()), Duration::ZERO);
        assert_eq!(bench.known.missed(), Broken::client("hangs: it does not end for 1500 ms".to_owned()));
    }

    #[test]
    fn states_that_nobody_takes_are_the_newest_64() {
        let mut bench = Bench::ready();
        for served in 0..100 {
            bench.take(state(true, 1, served));
        }
        let served: Vec<u64> = bench.known.states.iter().map(|state| state.served).collect();
        assert_eq!(served, (36..100).collect::<Vec<_>>());
    }

    /// A dashboard that answers `stop`, with what it was asked, and a guard of a client that says what the test sends.
    struct Watch {
        hand: ManualClock,
        shared: Arc<Shared>,
        reports: Sender<Report>,
        asked: Receiver<String>,
        guard: JoinHandle<Option<Halt>>,
        client: u32,
    }

    impl Watch {
        /// - `connections`: to the dashboard, each of which it serves; but the first it closes when there are two.
        fn begin(connections: usize) -> Self {
            let (host, listener) = (1..250)
                .find_map(|number| {
                    let host = format!("127.9.{}.{number}", std::process::id() % 250 + 1);
                    TcpListener::bind((host.as_str(), 29_999)).ok().map(|listener| (host, listener))
                })
                .unwrap();
            let (ask, asked) = channel();
            thread::spawn(move || {
                for left in (0..connections).rev() {
                    let (mut socket, _) = listener.accept().unwrap();
                    writeln!(socket, "Connected: a test").unwrap();
                    if left > 0 {
                        continue;
                    }
                    for line in BufReader::new(socket.try_clone().unwrap()).lines().map_while(Result::ok) {
                        ask.send(line).unwrap();
                        writeln!(socket, "Stopped").unwrap();
                    }
                }
            });
            let (clock, hand) = Clock::manual();
            // an answer of the dashboard is waited for in real time
            let deadlines = Deadlines { dashboard: Duration::from_secs(60), ..Deadlines::default() };
            let dashboard = Dashboard::connect(&host, deadlines.dashboard).unwrap();
            let shared = Arc::new(Shared::new(deadlines, clock));
            let mut command = Command::new("sleep");
            let child = command.arg("1000").stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            let client = child.id();
            let (reports, lines) = channel();
            let guard = Guard { child, host, dashboard, shared: shared.clone(), hand: None };
            let guard = thread::spawn(move || guard.watch(&lines));
            while hand.waiting() == 0 {
                thread::yield_now();
            }
            Self { hand, shared, reports, asked, guard, client }
        }

        /// Has a line come, and returns when the guard waits for the next one.
        fn say(&self, report: Report) {
            let begun = self.hand.begun();
            self.reports.send(report).unwrap();
            while self.hand.begun() == begun {
                thread::yield_now();
            }
        }

        /// Nothing is wrong after some time.
        fn is_calm_after(&self, time: Duration) {
            self.hand.advance(time);
            assert_eq!(self.hand.waiting(), 1, "it waits on");
            assert!(self.shared.known().broken.is_none() && self.asked.try_recv().is_err());
        }

        /// After some time the guard waits no longer.
        fn acts_after(&self, time: Duration) {
            self.hand.advance(time);
            assert_eq!(self.hand.waiting(), 0, "it waits on");
        }

        /// How the guard ended, what was wrong, and what the dashboard was asked.
        fn end(self) -> (Option<Halt>, Option<Broken>, Vec<String>) {
            let begun = Instant::now();
            while !self.guard.is_finished() {
                assert!(begun.elapsed() < Duration::from_secs(60), "it never ends");
                thread::sleep(MS);
            }
            let halt = self.guard.join().unwrap();
            let client = format!("/proc/{}", self.client);
            assert!(!std::path::Path::new(&client).exists(), "the client is gone");
            let broken = self.shared.known().broken.clone();
            (halt, broken, self.asked.iter().collect())
        }
    }

    const STOPPED: Option<Halt> = Some(Halt::Dashboard { took: Duration::ZERO });

    #[test]
    fn a_missed_line_kills_the_client_and_stops_the_arm() {
        let watch = Watch::begin(1);
        watch.say(Report::Ready);
        watch.is_calm_after(79 * MS);
        watch.say(Report::Beat { served: 0 });
        watch.is_calm_after(79 * MS);
        watch.acts_after(MS);
        let (halt, broken, asked) = watch.end();
        assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
        assert_eq!(broken, Some(Broken::client("hangs: nothing from it for 80 ms".to_owned())));
    }

    #[test]
    fn silent_states_stop_the_arm_though_lines_come() {
        let watch = Watch::begin(1);
        watch.say(Report::Ready);
        watch.is_calm_after(40 * MS);
        watch.say(Report::Beat { served: 0 });
        watch.is_calm_after(40 * MS);
        watch.say(Report::Beat { served: 0 });
        watch.is_calm_after(MS);
        watch.reports.send(Report::Beat { served: 0 }).unwrap();
        let (halt, broken, asked) = watch.end();
        assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
        assert_eq!(broken, Some(Broken::Arm(ArmError::Lost { silent_ms: 81 })));
    }

    #[test]
    fn a_client_that_is_never_ready_is_killed_and_nobody_elses_program_stopped() {
        let watch = Watch::begin(1);
        watch.is_calm_after(9_999 * MS);
        watch.acts_after(MS);
        let (halt, broken, asked) = watch.end();
        assert_eq!((halt, asked), (None, Vec::new()));
        assert_eq!(broken, Some(Broken::client("hangs: it is not ready for 10000 ms".to_owned())));
    }

    #[test]
    fn a_client_that_does_not_end_is_killed_and_the_arm_stopped() {
        let watch = Watch::begin(1);
        watch.say(Report::Ready);
        watch.shared.known().close(watch.shared.clock.now());
        watch.say(Report::Beat { served: 0 });
        watch.is_calm_after(1_499 * MS);
        watch.acts_after(MS);
        let (halt, broken, asked) = watch.end();
        assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
        assert_eq!(broken, Some(Broken::client("hangs: it does not end for 1500 ms".to_owned())));
    }

    #[test]
    fn a_client_that_ends_as_it_was_told_is_no_fault() {
        let watch = Watch::begin(1);
        watch.say(Report::Ready);
        watch.shared.known().close(watch.shared.clock.now());
        let Watch { guard, reports, shared, asked, .. } = watch;
        drop(reports);
        assert_eq!((guard.join().unwrap(), asked.iter().count()), (None, 0));
        assert!(shared.known().broken.is_none());
    }

    #[test]
    fn a_dashboard_that_was_closed_is_connected_again_to_stop_the_arm() {
        let watch = Watch::begin(2);
        watch.reports.send(Report::Ready).unwrap();
        // that it is closed is seen with a line that comes after that
        while watch.reports.send(Report::Beat { served: 0 }).is_ok() {
            thread::yield_now();
        }
        let (halt, broken, asked) = watch.end();
        assert_eq!((halt, asked), (STOPPED, vec!["stop".to_owned()]));
        assert_eq!(broken, Some(Broken::Arm(ArmError::Dropped { what: "its dashboard" })));
    }
}
