//! Waits for each line of the client with a deadline.
//!
//! When one stays away, or the arm does not do what it is ordered to, the guard kills the client,
//! so that nothing feeds the arm any more, and stops the arm by the dashboard; then it says why. A
//! program that somebody else has paused it ends by the dashboard, so that nothing of an old order
//! is left when it is resumed.

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
use super::protocol::{Action, ClientReport, Link, PERIOD, ProgramState, UrState, pose_of};
use crate::clock::{Clock, ManualClock};
use crate::probing::arm::{ArmError, Obedience, OrderedMotion, Safety};

/// States that wait for a late caller, 128 ms of them; older ones are dropped.
const WAITING: usize = 64;
/// The end of a program is reported after this time: a safety reason arrives a little later.
pub(super) const ENDED: Duration = Duration::from_millis(40);
/// Zeroing, with the braking before it, has this much time.
pub(super) const ZEROING: Duration = Duration::from_secs(3);
/// Deceleration of that braking, m/s².
const ZEROING_STOP: f64 = 2.0;
/// A dashboard that did not stop the arm is asked again this often.
pub(super) const AGAIN: Duration = Duration::from_millis(100);
/// A program that counts no cycle for so many hangs: one that is late by one does not.
const CYCLES: f64 = 2.0;
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

/// State of the guard. It decides by the reports and by the time passed in, and never blocks.
pub(super) struct GuardState {
    pub deadlines: Deadlines,
    pub is_ready: bool,
    pub states: VecDeque<UrState>,
    /// of the newest state that has come, s
    pub newest_s: f64,
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
    /// since when the program of the controller does not run, though nothing of the safety system
    /// says why
    ended_since: Option<Instant>,
    /// whether it was paused before
    was_paused: bool,
    /// whether a state has said since it was ready that something stops the arm or its program
    has_halted: bool,
    obedience: Obedience,
    /// the newest that the program has counted, and the stamp of the first state with it, s; `None`
    /// while it is at a command, or another has the arm
    cycle: Option<(i32, f64)>,
    pub lateness: Lateness,
    pub broken: Option<ClientLoss>,
    /// since when it is asked to end
    closing_since: Option<Instant>,
}

/// Why there is no client any more.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ClientLoss {
    /// the arm or its client
    Arm(ArmError),
    /// no library, or another one
    Wheel(String),
    /// the tool that was set is not there
    Tool(String),
}

/// State of the guard, its condition variable, and the clock of all deadlines.
pub(super) struct SharedGuard {
    pub known: Mutex<GuardState>,
    pub changed: Condvar,
    pub clock: Clock,
    /// asks a dashboard that was mute
    asker: Mutex<Option<Asker>>,
}

/// Asks a dashboard to stop the arm until it has done so, on connections of its own. Who lets it go
/// waits for the answer on its way, so that it never stops the program of a later client.
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
        // one that failed asks no more
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

    /// Asks the dashboard no more.
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

/// What of an order shows in the velocity of the arm.
fn ordered(what: &Action) -> OrderedMotion {
    match *what {
        Action::Move {
            twist,
            acceleration,
        } => OrderedMotion::Move {
            twist,
            acceleration,
        },
        Action::Press {
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
        Action::Stop { deceleration } => OrderedMotion::Stop { deceleration },
        Action::Zero => OrderedMotion::Stop {
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

    /// An order goes out; returns its number.
    pub fn send(&mut self, what: &Action, now: Instant) -> u64 {
        self.sent += 1;
        self.waiting_since.get_or_insert(now);
        self.obedience
            .order(&ordered(what), now.saturating_duration_since(self.begun_at));
        if *what == Action::Zero {
            self.asked = Some(self.sent);
        }
        self.sent
    }

    /// Asks the client to end.
    pub fn close(&mut self, now: Instant) {
        self.closing_since = Some(now);
    }

    /// Whether the program of the controller does not run, for long enough that the reason would
    /// have arrived.
    pub fn has_ended(&self, now: Instant) -> bool {
        self.ended_since
            .is_some_and(|since| now.saturating_duration_since(since) > ENDED)
    }

    /// Why it does not.
    pub fn ended(&self) -> ArmError {
        if self.was_paused {
            ArmError::ProgramPaused
        } else {
            ArmError::ProgramEnded
        }
    }

    /// Notes a state of a client that is ready; whether it is the first in which something else
    /// stops a program that is still there.
    pub fn is_to_be_ended(&mut self, state: &UrState) -> bool {
        let is_first = self.is_ready && !state.may_move() && !self.has_halted;
        self.has_halted |= is_first;
        self.was_paused |= is_first && state.program == ProgramState::Paused;
        is_first && state.program != ProgramState::Ended && self.closing_since.is_none()
    }

    /// How long the next line may stay away from now on.
    pub fn patience(&self, now: Instant) -> Duration {
        let (since, deadline, _) = self.awaited();
        deadline.saturating_sub(now.saturating_duration_since(since.unwrap_or(now)))
    }

    /// The fault when that time has passed without a line.
    pub fn missed(&self) -> ClientLoss {
        let (_, deadline, misses) = self.awaited();
        ClientLoss::client(format!("hangs: {misses} for {} ms", deadline.as_millis()))
    }

    /// What is waited for: since when, where that was before now, how long, and what is said when
    /// it stays away.
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

    /// Takes a line of the client; returns a fault.
    #[expect(clippy::too_many_lines)]
    pub fn take(&mut self, report: ClientReport, now: Instant) -> Option<ClientLoss> {
        match report {
            ClientReport::Ready => {
                (self.is_ready, self.fresh_at) = (true, Some(now));
                // those of before have the pose of another tool
                self.states.clear();
                self.obedience = Obedience::new(now.saturating_duration_since(self.begun_at));
                self.lateness = Lateness::new(now);
            }
            ClientReport::State(state) => {
                (self.fresh_at, self.newest_s) = (Some(now), state.stamp_s);
                self.lateness.take(state.stamp_s, now);
                // where the safety system has ended it, the state says so by itself
                let has_ended = !state.is_playing() && state.safety() == Safety::Normal;
                self.ended_since = has_ended.then(|| self.ended_since.unwrap_or(now));
                if self.states.len() == WAITING {
                    self.states.pop_front();
                }
                self.states.push_back(*state);
                self.serve(state.served, now);
                // what does not play is somebody else's, or stands
                if !self.is_ready || self.has_halted || !state.may_move() {
                    self.cycle = None;
                } else if let Some(fault) = self.hangs(&state).or_else(|| {
                    let since = now.saturating_duration_since(self.begun_at);
                    self.obedience
                        .see(&pose_of(state.pose), &state.velocity, since)
                }) {
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
                    Link::States => "its states",
                    Link::Control => "orders to it",
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

    /// The fault of a program whose main loop has stopped, whatever it was ordered; at a command
    /// that takes more than a cycle the deadline of its call counts.
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

/// The thread that waits with deadlines, with a dashboard for itself.
pub(super) struct Guard {
    pub child: Child,
    pub host: String,
    pub dashboard: Dashboard,
    pub shared: Arc<SharedGuard>,
    /// of a controller in lock step: its states move the clock
    pub hand: Option<ManualClock>,
}

impl Guard {
    /// Until the client ends; returns how the arm was stopped when that was not wanted.
    #[expect(clippy::too_many_lines)]
    pub fn watch(mut self, reports: &Receiver<ClientReport>) -> Option<Halt> {
        let clock = self.shared.clock.clone();
        let mut stamp_s = f64::INFINITY;
        let broken = loop {
            let patience = self.shared.known().patience(clock.now());
            // lines may come and come from a client that is never ready or never ends
            let report = if patience.is_zero() {
                Err(RecvTimeoutError::Timeout)
            } else {
                clock.recv_timeout(reports, patience)
            };
            let broken = match report {
                Ok(report) => {
                    if let (Some(hand), ClientReport::State(state)) = (&self.hand, &report) {
                        hand.advance(
                            Duration::try_from_secs_f64(state.stamp_s - stamp_s)
                                .unwrap_or_default(),
                        );
                        stamp_s = state.stamp_s;
                    }
                    let mut known = self.shared.known();
                    let is_to_be_ended = matches!(&report, ClientReport::State(state) if known.is_to_be_ended(state));
                    let broken = known.take(report, clock.now());
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
                // it ended on request
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
