//! Waits for each line of the client with a deadline.
//!
//! If a line is missing, or the arm disobeys an order, the guard kills the client, so that nothing
//! feeds the arm any more, and stops the arm by the dashboard; then it reports the reason. It ends
//! by the dashboard a program that somebody else has paused, so that no old order survives until
//! the resumption.

use std::collections::VecDeque;
use std::process::Child;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use nalgebra::Vector3;

use super::dashboard::Dashboard;
use super::lateness::Lateness;
use super::params::Deadlines;
use super::protocol::{
    ClientReport, OrderAction, PERIOD, ProgramState, RtdeConnection, UrState, pose_of,
};
use touchup_probing::arm::{ArmError, Obedience, OrderedMotion, Safety};
use touchup_session::clock::{Clock, ManualClock};

/// Maximum number of states that wait for a late caller, 128 ms; older ones drop out.
const WAITING: usize = 64;
/// Delay of the report of an ended program, as a safety reason arrives a little later.
pub(super) const ENDED: Duration = Duration::from_millis(40);
/// Maximum duration of zeroing, with the braking before it.
pub(super) const ZEROING: Duration = Duration::from_secs(3);
/// Deceleration of that braking, m/s².
const ZEROING_STOP: f64 = 2.0;
/// Period of further stop requests to a dashboard that did not stop the arm.
pub(super) const AGAIN: Duration = Duration::from_millis(100);
/// Number of periods without a counted cycle that make a program hang: a delay by one does not.
const CYCLES: f64 = 2.0;
/// Maximum time from the end of its stdin to the end of the client.
pub(super) const FAREWELL: Duration = Duration::from_millis(1500);

/// Means by which the arm stopped after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halt {
    /// The dashboard confirmed the stop.
    Dashboard {
        /// time from the detection of the fault to the answer
        took: Duration,
    },
    /// The dashboard does not answer; the watchdog of the controller stops the arm.
    Watchdog,
}

/// State of the guard. It decides by the reports and the time passed in, and never blocks.
pub(super) struct GuardState {
    pub deadlines: Deadlines,
    pub is_ready: bool,
    pub states: VecDeque<UrState>,
    /// stamp of the newest state, s
    pub newest_s: f64,
    pub done: u64,
    pub sent: u64,
    pub served: u64,
    /// start of the client
    begun_at: Instant,
    /// time since which an order waits for its call to return
    waiting_since: Option<Instant>,
    /// number of a long order
    asked: Option<u64>,
    /// arrival of the last new state
    fresh_at: Option<Instant>,
    /// time since which the program of the controller does not run without a reason from the safety
    /// system
    ended_since: Option<Instant>,
    /// whether a pause of the program came first
    was_paused: bool,
    /// whether a state since `Ready` shows a stop of the arm or its program
    has_halted: bool,
    obedience: Obedience,
    /// newest cycle count of the program, and the stamp of its first state, s; `None` during a
    /// command, or while another has the arm
    cycle: Option<(i32, f64)>,
    pub lateness: Lateness,
    pub broken: Option<ClientLoss>,
    /// time of the request to end
    closing_since: Option<Instant>,
}

/// Reason for the loss of the client.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ClientLoss {
    /// the arm or its client
    Arm(ArmError),
    /// no library, or another version
    Wheel(String),
    /// the commanded tool is not in effect
    Tool(String),
}

/// State of the guard, its condition variable, and the clock of all deadlines.
pub(super) struct SharedGuard {
    pub known: Mutex<GuardState>,
    pub changed: Condvar,
    pub clock: Clock,
    /// repeats the stop request to a mute dashboard
    asker: Mutex<Option<Asker>>,
}

/// Asks a dashboard to stop the arm until it succeeds, on connections of its own. Dropping it waits
/// for the pending answer, so that it never stops the program of a later client.
struct Asker {
    over: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Asker {
    fn begin(host: String, deadline: Duration) -> Self {
        let (over, is_over) = channel();
        let ask = move || {
            while is_over.recv_timeout(AGAIN) == Err(RecvTimeoutError::Timeout) {
                if Dashboard::connect(&host, deadline)
                    .and_then(|mut dashboard| dashboard.stop())
                    .is_ok()
                {
                    tracing::warn!(
                        "the dashboard, which had not answered, has stopped the program of the arm"
                    );
                    break;
                }
            }
        };
        Self {
            over: Some(over),
            thread: Some(thread::spawn(ask)),
        }
    }
}

impl Drop for Asker {
    fn drop(&mut self) {
        self.over = None;
        // a failed thread asks no more
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl SharedGuard {
    pub fn new(deadlines: Deadlines, clock: Clock) -> Self {
        Self {
            known: Mutex::new(GuardState::new(deadlines, clock.now())),
            changed: Condvar::new(),
            clock,
            asker: Mutex::default(),
        }
    }

    /// Ends the repeated stop requests.
    pub fn ask_no_more(&self) {
        *self.asker.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    pub fn known(&self) -> MutexGuard<'_, GuardState> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ClientLoss {
    pub fn error(&self) -> ArmError {
        match self {
            Self::Arm(error) => error.clone(),
            Self::Wheel(reason) | Self::Tool(reason) => ArmError::Client {
                reason: reason.clone(),
            },
        }
    }

    fn client(reason: String) -> Self {
        Self::Arm(ArmError::Client { reason })
    }
}

/// Motion of an order as visible in the velocity of the arm.
fn ordered(what: &OrderAction) -> OrderedMotion {
    match *what {
        OrderAction::Move {
            twist,
            acceleration,
        } => OrderedMotion::Move {
            twist,
            acceleration,
        },
        OrderAction::Press {
            frame,
            speed,
            feed,
            acceleration,
            ..
        } => {
            let axis = pose_of(frame).rotation * Vector3::z();
            OrderedMotion::Press {
                axis,
                speed,
                feed: feed.into(),
                acceleration,
            }
        }
        OrderAction::Stop { deceleration } => OrderedMotion::Stop { deceleration },
        OrderAction::Zero => OrderedMotion::Stop {
            deceleration: ZEROING_STOP,
        },
    }
}

impl GuardState {
    pub fn new(deadlines: Deadlines, now: Instant) -> Self {
        Self {
            deadlines,
            is_ready: false,
            states: VecDeque::new(),
            newest_s: f64::NAN,
            done: 0,
            sent: 0,
            served: 0,
            begun_at: now,
            waiting_since: None,
            asked: None,
            fresh_at: None,
            ended_since: None,
            was_paused: false,
            has_halted: false,
            obedience: Obedience::new(Duration::ZERO),
            cycle: None,
            lateness: Lateness::new(now),
            broken: None,
            closing_since: None,
        }
    }

    /// Notes an order; returns its number.
    pub fn send(&mut self, what: &OrderAction, now: Instant) -> u64 {
        self.sent += 1;
        self.waiting_since.get_or_insert(now);
        self.obedience
            .order(&ordered(what), now.saturating_duration_since(self.begun_at));
        if *what == OrderAction::Zero {
            self.asked = Some(self.sent);
        }
        self.sent
    }

    /// Asks the client to end.
    pub fn close(&mut self, now: Instant) {
        self.closing_since = Some(now);
    }

    /// Whether the program of the controller has not run for longer than the delay of a safety
    /// reason.
    pub fn has_ended(&self, now: Instant) -> bool {
        self.ended_since
            .is_some_and(|since| now.saturating_duration_since(since) > ENDED)
    }

    /// Reason why the program does not run.
    pub fn ended(&self) -> ArmError {
        if self.was_paused {
            ArmError::ProgramPaused
        } else {
            ArmError::ProgramEnded
        }
    }

    /// Notes a state of a ready client; returns whether it is the first in which something else
    /// stops a program that is still present.
    pub fn is_to_be_ended(&mut self, state: &UrState) -> bool {
        let is_first = self.is_ready && !state.may_move() && !self.has_halted;
        self.has_halted |= is_first;
        self.was_paused |= is_first && state.program == ProgramState::Paused;
        is_first && state.program != ProgramState::Ended && self.closing_since.is_none()
    }

    /// Remaining time for the next line.
    pub fn patience(&self, now: Instant) -> Duration {
        let (since, deadline, _) = self.awaited();
        deadline.saturating_sub(now.saturating_duration_since(since.unwrap_or(now)))
    }

    /// Fault of a line missing for that time.
    pub fn missed(&self) -> ClientLoss {
        let (_, deadline, misses) = self.awaited();
        ClientLoss::client(format!("hangs: {misses} for {} ms", deadline.as_millis()))
    }

    /// Next awaited event: earlier start of the wait, deadline, and words for its absence.
    fn awaited(&self) -> (Option<Instant>, Duration, &'static str) {
        match (self.closing_since, self.is_ready) {
            (Some(since), _) => (Some(since), FAREWELL, "it does not end"),
            (_, true) => (None, self.deadlines.beat, "nothing from it"),
            (_, false) => (
                Some(self.begun_at),
                self.deadlines.connect,
                "it is not ready",
            ),
        }
    }

    /// Handles a line of the client; returns a fault.
    pub fn take(&mut self, report: ClientReport, now: Instant) -> Option<ClientLoss> {
        match report {
            ClientReport::Ready => {
                (self.is_ready, self.fresh_at) = (true, Some(now));
                // older states have the pose of another tool
                self.states.clear();
                self.obedience = Obedience::new(now.saturating_duration_since(self.begun_at));
                self.lateness = Lateness::new(now);
            }
            ClientReport::State(state) => {
                if let Some(fault) = self.take_state(*state, now) {
                    return Some(ClientLoss::Arm(fault));
                }
            }
            ClientReport::Beat { served } => self.serve(served, now),
            ClientReport::Done { number } => {
                self.done = number;
                self.asked = self.asked.filter(|asked| *asked != number);
                self.serve(number, now);
            }
            ClientReport::Lost { which } => {
                let what = match which {
                    RtdeConnection::States => "its states",
                    RtdeConnection::Control => "orders to it",
                };
                return Some(ClientLoss::Arm(ArmError::Dropped { what }));
            }
            ClientReport::BadWheel { reason } => return Some(ClientLoss::Wheel(reason)),
            ClientReport::BadTool { reason } => return Some(ClientLoss::Tool(reason)),
            ClientReport::Failed { call, reason } => {
                return Some(ClientLoss::client(format!(
                    "was refused a call: {call}: {reason}"
                )));
            }
        }
        self.overdue(now)
    }

    /// Notes a state; returns a fault of the program or the arm.
    fn take_state(&mut self, state: UrState, now: Instant) -> Option<ArmError> {
        (self.fresh_at, self.newest_s) = (Some(now), state.stamp_s);
        self.lateness.take(state.stamp_s, now);
        // a state after a safety stop carries its own reason
        let has_ended = !state.is_playing() && state.safety() == Safety::Normal;
        self.ended_since = has_ended.then(|| self.ended_since.unwrap_or(now));
        if self.states.len() == WAITING {
            self.states.pop_front();
        }
        self.states.push_back(state);
        self.serve(state.served, now);
        // a program that does not play belongs to somebody else, or stands
        if !self.is_ready || self.has_halted || !state.may_move() {
            self.cycle = None;
            return None;
        }
        self.hangs(&state).or_else(|| {
            let since = now.saturating_duration_since(self.begun_at);
            self.obedience
                .see(&pose_of(state.pose), &state.velocity, since)
        })
    }

    /// Fault of states, or of a call, missing for too long.
    fn overdue(&self, now: Instant) -> Option<ClientLoss> {
        let since =
            |at: Option<Instant>| at.map_or(Duration::ZERO, |at| now.saturating_duration_since(at));
        let silent = since(self.fresh_at);
        if self.is_ready && silent > self.deadlines.silent {
            return Some(ClientLoss::Arm(ArmError::Lost {
                silent_ms: silent.as_millis() as u64,
            }));
        }
        let patience = if self.asked.is_some() {
            ZEROING
        } else {
            self.deadlines.order
        };
        let waited = since(self.waiting_since);
        (waited > patience).then(|| {
            ClientLoss::client(format!(
                "hangs: a call of ur-rtde has not returned for {} ms",
                waited.as_millis()
            ))
        })
    }

    /// Fault of a program whose main loop has stopped, whatever the order; for a command longer
    /// than a cycle the deadline of its call counts.
    fn hangs(&mut self, state: &UrState) -> Option<ArmError> {
        let seen = self.cycle.filter(|(cycle, _)| *cycle == state.cycle);
        let since_s = seen.map_or(state.stamp_s, |(_, since_s)| since_s);
        self.cycle = (state.cycle >= 0).then_some((state.cycle, since_s));
        let silent_s = state.stamp_s - since_s;
        ((silent_s / PERIOD).round() >= CYCLES).then_some(ArmError::ProgramHangs {
            silent_ms: silent_s * 1e3,
            cycle_ms: PERIOD * 1e3,
        })
    }

    fn serve(&mut self, served: u64, now: Instant) {
        if served > self.served {
            self.served = served;
            self.waiting_since = (served < self.sent).then_some(now);
        }
    }
}

/// The thread that waits with deadlines, with its own dashboard.
pub(super) struct Guard {
    pub child: Child,
    pub host: String,
    pub dashboard: Dashboard,
    pub shared: Arc<SharedGuard>,
    /// clock of a controller in lock step, moved by its states
    pub hand: Option<ManualClock>,
}

impl Guard {
    /// Runs until the client ends; returns how it stopped the arm after a fault.
    pub fn watch(mut self, reports: &Receiver<ClientReport>) -> Option<Halt> {
        let clock = self.shared.clock.clone();
        let mut stamp_s = f64::INFINITY;
        let broken = loop {
            let patience = self.shared.known().patience(clock.now());
            // a client that is never ready or never ends may send lines forever
            let report = if patience.is_zero() {
                Err(RecvTimeoutError::Timeout)
            } else {
                clock.recv_timeout(reports, patience)
            };
            let broken = match report {
                Ok(report) => self.take(report, &mut stamp_s),
                // the client ended on request
                Err(RecvTimeoutError::Disconnected)
                    if self.shared.known().closing_since.is_some() =>
                {
                    break None;
                }
                Err(RecvTimeoutError::Timeout) => Some(self.shared.known().missed()),
                Err(RecvTimeoutError::Disconnected) => {
                    let end = self
                        .child
                        .wait()
                        .map_or_else(|error| error.to_string(), |status| status.to_string());
                    Some(ClientLoss::client(format!("has ended ({end})")))
                }
            };
            if broken.is_some() {
                break broken;
            }
            if !self.dashboard.is_open() {
                break Some(ClientLoss::Arm(ArmError::Dropped {
                    what: "its dashboard",
                }));
            }
        };
        // nothing feeds the arm from here on; a client that has already ended is as good
        let _ = self.child.kill();
        // before `Ready` nothing of ours moves, and a running program may be somebody else's
        let halt = (broken.is_some() && self.shared.known().is_ready).then(|| self.halt());
        let _ = self.child.wait();
        if let Some(broken) = broken {
            tracing::error!(reason = %broken.error(), ?halt, "the arm was stopped");
            self.shared.known().broken = Some(broken);
            self.shared.changed.notify_all();
        }
        halt
    }

    /// Handles a line of the client; returns a fault.
    ///
    /// - `stamp_s`: of the last state.
    fn take(&mut self, report: ClientReport, stamp_s: &mut f64) -> Option<ClientLoss> {
        if let (Some(hand), ClientReport::State(state)) = (&self.hand, &report) {
            let passed = Duration::try_from_secs_f64(state.stamp_s - *stamp_s);
            hand.advance(passed.unwrap_or_default());
            *stamp_s = state.stamp_s;
        }
        let mut known = self.shared.known();
        let is_to_be_ended =
            matches!(&report, ClientReport::State(state) if known.is_to_be_ended(state));
        let broken = known.take(report, self.shared.clock.now());
        drop(known);
        self.shared.changed.notify_all();
        if is_to_be_ended {
            let halt = self.halt();
            tracing::warn!(
                ?halt,
                "something stopped the arm: its program is ended, so that nothing goes on by itself"
            );
        }
        broken
    }

    fn halt(&mut self) -> Halt {
        let begun = self.shared.clock.now();
        let (host, deadline) = (&self.host, self.shared.known().deadlines.dashboard);
        let stopped = self.dashboard.stop().or_else(|error| {
            // a closed connection, unlike a silent one, may work again
            if self.dashboard.is_silent {
                Err(error)
            } else {
                Dashboard::connect(host, deadline)?.stop()
            }
        });
        match stopped {
            Ok(()) => Halt::Dashboard {
                took: self.shared.clock.since(begun),
            },
            Err(error) => {
                tracing::error!(
                    %error,
                    "the arm cannot be stopped by its dashboard: its watchdog does it, and the dashboard is asked again"
                );
                let asker = &self.shared.asker;
                let mut asker = asker.lock().unwrap_or_else(PoisonError::into_inner);
                asker.get_or_insert_with(|| Asker::begin(self.host.clone(), deadline));
                Halt::Watchdog
            }
        }
    }
}

#[cfg(test)]
mod tests;
