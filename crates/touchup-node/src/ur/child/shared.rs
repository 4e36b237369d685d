//! State shared by the threads.

use std::io::{PipeWriter, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::library::leave;
use crate::ur::protocol::{ClientReport, RtdeConnection, UrState};

/// The newest state and its arrival.
#[derive(Clone, Copy, Debug)]
pub struct ReceivedState {
    pub state: UrState,
    pub at: Instant,
}

/// State shared by the threads.
pub struct ChildShared {
    reports: Box<dyn Fn(&ClientReport) + Send + Sync>,
    /// number of the last order whose calls have returned
    pub served: AtomicU64,
    pub latest: Mutex<Option<ReceivedState>>,
    /// the arm takes commands
    pub is_ready: AtomicBool,
    /// a state since then shows a stop of the arm or its program
    pub has_halted: AtomicBool,
}

/// Writes a line for each report.
pub fn lines_to(pipe: PipeWriter) -> impl Fn(&ClientReport) + Send + Sync + 'static {
    let pipe = Mutex::new(pipe);
    move |report| {
        let Ok(mut line) = serde_json::to_vec(report) else {
            return;
        };
        line.push(b'\n');
        // a missing reader also ends stdin
        let _ = pipe
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .write_all(&line);
    }
}

impl ChildShared {
    pub fn report(&self, report: &ClientReport) {
        (self.reports)(report);
    }

    /// - `reports`: sink of each report.
    pub fn new(reports: impl Fn(&ClientReport) + Send + Sync + 'static) -> Self {
        Self {
            reports: Box::new(reports),
            served: AtomicU64::new(0),
            latest: Mutex::new(None),
            is_ready: AtomicBool::new(false),
            has_halted: AtomicBool::new(false),
        }
    }

    pub fn latest(&self) -> Option<ReceivedState> {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stores a new state.
    pub fn see(&self, state: UrState, at: Instant) {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner) =
            Some(ReceivedState { state, at });
        if self.is_ready.load(Ordering::Acquire) && !state.may_move() {
            self.has_halted.store(true, Ordering::Release);
        }
    }

    /// Reports a lost connection, and ends the process.
    pub fn lost(&self, which: RtdeConnection) -> ! {
        self.report(&ClientReport::Lost { which });
        leave(3)
    }

    pub fn number(&self) -> u64 {
        self.served.load(Ordering::Acquire)
    }
}
