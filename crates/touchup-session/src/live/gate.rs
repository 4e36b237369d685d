//! Gate before a renewal of the patch: open in a program, controlled in a test.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Instant;

use crate::clock::{Clock, WorkGuard, locked};

/// Demands a permit for each renewal of the patch, and makes the time of a clock wait for the
/// patch. The default lets everything through.
#[derive(Clone, Debug, Default)]
pub struct Gate {
    permits: Option<Arc<Permits>>,
    clock: Clock,
}

/// Gives permits; leaves the gate open when dropped.
#[derive(Debug)]
pub struct GateKeeper(Arc<Permits>);

#[derive(Debug, Default)]
struct Permits {
    state: Mutex<GateState>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct GateState {
    is_open: bool,
    given: u64,
    /// finished renewals with a permit and an available change
    done: u64,
}

impl Gate {
    /// Lets everything through. The time of `clock` waits for pending requests to the patch.
    pub fn open(clock: &Clock) -> Self {
        Self {
            permits: None,
            clock: clock.clone(),
        }
    }

    /// Lets nothing through without a permit; the time behind it stands still.
    pub fn kept() -> (Self, GateKeeper) {
        let permits = Arc::new(Permits::default());
        (
            Self {
                permits: Some(Arc::clone(&permits)),
                clock: Clock::manual().0,
            },
            GateKeeper(permits),
        )
    }

    /// Stops time from a request until its answer.
    pub(super) fn begin_work(&self) -> WorkGuard {
        self.clock.begin_work()
    }

    /// The time behind the gate.
    pub(super) fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Waits for permission to work on a renewal.
    pub(super) fn pass(&self) {
        if let Some(permits) = &self.permits {
            let is_shut = |state: &mut GateState| !state.is_open && state.done == state.given;
            drop(
                permits
                    .changed
                    .wait_while(locked(&permits.state), is_shut)
                    .unwrap_or_else(PoisonError::into_inner),
            );
        }
    }

    /// Notes an available change of a renewal.
    pub(super) fn note_done(&self) {
        if let Some(permits) = &self.permits {
            locked(&permits.state).done += 1;
            permits.changed.notify_all();
        }
    }
}

impl GateKeeper {
    /// Lets one requested renewal through, and returns once its change is available.
    pub fn let_one_through(&self) {
        let mut state = locked(&self.0.state);
        state.given = state.done + 1;
        self.0.changed.notify_all();
        let is_running = |state: &mut GateState| state.done < state.given;
        drop(
            self.0
                .changed
                .wait_while(state, is_running)
                .unwrap_or_else(PoisonError::into_inner),
        );
    }
}

impl Drop for GateKeeper {
    fn drop(&mut self) {
        locked(&self.0.state).is_open = true;
        self.0.changed.notify_all();
    }
}
