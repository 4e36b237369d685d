//! The process that speaks to the arm, from the inside: the only place with Python.
//!
//! One thread owns `rtde_control` and executes the orders ([`control`]); a second one passes on the states of
//! `rtde_receive` ([`states`]); a third reads the orders. When a connection of the library is lost the process says so and ends at
//! once, for the library would connect again by itself, start its program unasked, and crash.

mod control;
mod library;
mod states;

use std::io::{BufRead, BufReader, PipeWriter, Write, stdin, stdout};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
use std::thread;

use pyo3::prelude::*;

use self::control::{Driver, DriverEnd};
use self::library::{Receive, RtdeControl, leave};
use super::protocol::{Begin, ClientReport, Link, Order, UrState};
use crate::clock::Clock;

/// Why the process gives up before it has begun.
#[derive(Debug, thiserror::Error)]
pub enum ChildError {
    /// It is started by touchup, with its orders on stdin.
    #[error("this is started by touchup itself: the first line on stdin has to be an order to begin ({0})")]
    NoOrders(String),
    /// A call of Python.
    #[error("{call}: {reason}")]
    Python {
        /// which
        call: &'static str,
        /// what it raised
        reason: String,
    },
}

/// Shared by the threads.
struct ChildShared {
    reports: Mutex<PipeWriter>,
    /// number of the last order whose calls have returned
    served: AtomicU64,
    latest: Mutex<Option<UrState>>,
}

impl ChildShared {
    fn report(&self, report: &ClientReport) {
        let Ok(mut line) = serde_json::to_vec(report) else { return };
        line.push(b'\n');
        // when the reader is gone, stdin ends too
        let _ = self.reports.lock().unwrap_or_else(PoisonError::into_inner).write_all(&line);
    }

    fn latest(&self) -> Option<UrState> {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reports a lost connection, and ends the process.
    fn lost(&self, which: Link) -> ! {
        self.report(&ClientReport::Lost { which });
        leave(3)
    }

    fn number(&self) -> u64 {
        self.served.load(Ordering::Acquire)
    }
}

/// Serves orders until stdin ends; then brakes, ends the program of the controller and itself.
///
/// # Errors
/// [`ChildError`], when it cannot begin. Later errors go out as reports.
pub fn run() -> Result<(), ChildError> {
    let mut lines = BufReader::new(stdin()).lines().map_while(Result::ok);
    let first = lines.next().unwrap_or_default();
    let begin: Begin = serde_json::from_str(&first).map_err(|error| ChildError::NoOrders(error.to_string()))?;
    let reports = stdout().as_fd().try_clone_to_owned().map_err(|error| ChildError::NoOrders(error.to_string()))?;
    let shared =
        ChildShared { reports: Mutex::new(reports.into()), served: AtomicU64::new(0), latest: Mutex::new(None) };
    if let Err(error) = library::load(&begin.site_packages) {
        shared.report(&ClientReport::BadWheel { reason: error.to_string() });
        return Err(error);
    }
    // the constructor of control starts a program: only when states come
    let connected = Receive::connect(&begin.host).and_then(|receive| Ok((receive, RtdeControl::connect(&begin.host)?)));
    let (receive, control) = connected.inspect_err(|error| shared.report(&failure(error)))?;
    let (sender, orders) = channel();
    let (clock, hand) = if begin.is_lock_step {
        let (clock, hand) = Clock::manual();
        (clock, Some(hand))
    } else {
        (Clock::system(), None)
    };
    thread::scope(|scope| {
        scope.spawn(|| states::hand_on(&receive, &shared, hand.as_ref()));
        scope.spawn(move || {
            for line in lines {
                let Ok(order) = serde_json::from_str::<Order>(&line) else { continue };
                if sender.send(order).is_err() {
                    break;
                }
            }
        });
        match Driver::new(&control, &shared, &begin, clock).run(&orders) {
            Ok(()) => leave(0),
            Err(DriverEnd::Lost(which)) => shared.lost(which),
            Err(DriverEnd::BadTool(reason)) => {
                shared.report(&ClientReport::BadTool { reason });
                leave(4)
            }
            Err(DriverEnd::NotReady(error)) => {
                shared.report(&failure(&error));
                leave(5)
            }
        }
    })
}

/// A call that did not work, as a report.
fn failure(error: &ChildError) -> ClientReport {
    match error {
        ChildError::Python { call, reason } => {
            ClientReport::Failed { call: (*call).to_owned(), reason: reason.clone() }
        }
        ChildError::NoOrders(reason) => ClientReport::Failed { call: "the orders".to_owned(), reason: reason.clone() },
    }
}

/// Version of the Python that this was linked with, as `3.11`.
pub fn python_version() -> String {
    Python::attach(|py| {
        let version = py.version_info();
        format!("{}.{}", version.major, version.minor)
    })
}
