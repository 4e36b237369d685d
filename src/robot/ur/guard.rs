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

/// What the guard knows.
#[derive(Default)]
pub(super) struct Known {
    pub is_ready: bool,
    pub states: VecDeque<State>,
    pub done: u64,
    pub sent: u64,
    pub served: u64,
    /// since when an order waits for its call to return
    pub waiting_since: Option<Instant>,
    /// an order that takes its time
    pub asked: Option<u64>,
    /// when the last new state came
    pub fresh_at: Option<Instant>,
    /// since when the program of the controller does not run
    pub ended_since: Option<Instant>,
    pub broken: Option<Broken>,
    /// since when it is told to end
    pub closing_since: Option<Instant>,
}

/// Why there is no client any more.
#[derive(Clone, Debug)]
pub(super) enum Broken {
    /// the arm or its client
    Arm(ArmError),
    /// no library, or another one
    Wheel(String),
    /// the tool that was set is not there
    Tool(String),
}

/// What the guard knows, and that it has changed.
pub(super) struct Shared {
    pub known: Mutex<Known>,
    pub changed: Condvar,
}

impl Shared {
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
}

/// The thread that waits with deadlines, with a dashboard for itself.
pub(super) struct Guard {
    pub child: Child,
    pub host: String,
    pub dashboard: Dashboard,
    pub deadlines: Deadlines,
    pub shared: Arc<Shared>,
}

impl Guard {
    /// Until the client ends; returns how the arm was stopped when that was not wanted.
    pub fn watch(mut self, reports: &Receiver<Report>) -> Option<Halt> {
        let begun = Instant::now();
        let broken = loop {
            let (is_ready, closing_since) = {
                let known = self.shared.known();
                (known.is_ready, known.closing_since)
            };
            let (since, deadline, misses) = match (closing_since, is_ready) {
                (Some(since), _) => (since, FAREWELL, "it does not end"),
                (_, true) => (Instant::now(), self.deadlines.beat, "nothing from it"),
                (_, false) => (begun, self.deadlines.connect, "it is not ready"),
            };
            let patience = deadline.saturating_sub(since.elapsed());
            // states may come and come from a client whose other half hangs
            let report =
                if patience.is_zero() { Err(RecvTimeoutError::Timeout) } else { reports.recv_timeout(patience) };
            let broken = match report {
                Ok(report) => self.take(report),
                // it ended because it was told to
                Err(RecvTimeoutError::Disconnected) if self.shared.known().closing_since.is_some() => break None,
                Err(RecvTimeoutError::Timeout) => {
                    let reason = format!("hangs: {misses} for {} ms", deadline.as_millis());
                    Some(Broken::Arm(ArmError::Client { reason }))
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let end = self.child.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
                    Some(Broken::Arm(ArmError::Client { reason: format!("has ended ({end})") }))
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
        let begun = Instant::now();
        let (host, deadline) = (&self.host, self.deadlines.dashboard);
        let stopped = self.dashboard.stop().or_else(|error| {
            // one that was closed, not one that is silent, may be there again
            if begun.elapsed() > deadline / 2 { Err(error) } else { Dashboard::connect(host, deadline)?.stop() }
        });
        match stopped {
            Ok(()) => Halt::Dashboard { took: begun.elapsed() },
            Err(error) => {
                tracing::error!(%error, "the arm cannot be stopped by its dashboard: its watchdog does it");
                Halt::Watchdog
            }
        }
    }

    /// What a line tells; returns what is wrong.
    fn take(&self, report: Report) -> Option<Broken> {
        let now = Instant::now();
        let mut known = self.shared.known();
        match report {
            Report::Ready => {
                (known.is_ready, known.fresh_at) = (true, Some(now));
                // those of before have the pose of another tool
                known.states.clear();
            }
            Report::State(state) => {
                known.fresh_at = Some(now);
                // where the safety system has ended it, the state says so by itself
                let has_ended = !state.is_playing && state.safety() == Safety::Normal;
                known.ended_since = has_ended.then(|| known.ended_since.unwrap_or(now));
                if known.states.len() == WAITING {
                    known.states.pop_front();
                }
                known.states.push_back(*state);
                serve(&mut known, state.served, now);
            }
            Report::Beat { served } => serve(&mut known, served, now),
            Report::Done { number } => {
                known.done = number;
                known.asked = known.asked.filter(|asked| *asked != number);
                serve(&mut known, number, now);
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
                let reason = format!("was refused a call: {call}: {reason}");
                return Some(Broken::Arm(ArmError::Client { reason }));
            }
        }
        self.shared.changed.notify_all();
        let silent_ms = silence(&known);
        if known.is_ready && u128::from(silent_ms) > self.deadlines.silent.as_millis() {
            return Some(Broken::Arm(ArmError::Lost { silent_ms }));
        }
        let patience = if known.asked.is_some() { ZEROING } else { self.deadlines.order };
        let waited = known.waiting_since.map_or(Duration::ZERO, |since| since.elapsed());
        (waited > patience).then(|| {
            let reason = format!("hangs: a call of ur-rtde has not returned for {} ms", waited.as_millis());
            Broken::Arm(ArmError::Client { reason })
        })
    }
}

/// Since the last new state, ms.
fn silence(known: &Known) -> u64 {
    known.fresh_at.map_or(0, |at| at.elapsed().as_millis() as u64)
}

fn serve(known: &mut Known, served: u64, now: Instant) {
    if served > known.served {
        known.served = served;
        known.waiting_since = (served < known.sent).then_some(now);
    }
}
