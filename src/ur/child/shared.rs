//! What the threads have in common.

use std::io::{PipeWriter, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use super::library::leave;
use crate::ur::protocol::{ClientReport, Link, UrState};

/// Shared by the threads.
pub struct ChildShared {
    pub reports: Mutex<PipeWriter>,
    /// number of the last order whose calls have returned
    pub served: AtomicU64,
    pub latest: Mutex<Option<UrState>>,
}

impl ChildShared {
    pub fn report(&self, report: &ClientReport) {
        let Ok(mut line) = serde_json::to_vec(report) else { return };
        line.push(b'\n');
        // when the reader is gone, stdin ends too
        let _ = self.reports.lock().unwrap_or_else(PoisonError::into_inner).write_all(&line);
    }

    pub fn latest(&self) -> Option<UrState> {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reports a lost connection, and ends the process.
    pub fn lost(&self, which: Link) -> ! {
        self.report(&ClientReport::Lost { which });
        leave(3)
    }

    pub fn number(&self) -> u64 {
        self.served.load(Ordering::Acquire)
    }
}
