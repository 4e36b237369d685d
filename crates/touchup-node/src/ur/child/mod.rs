//! The process that speaks to the arm, from the inside: the only place with Python.
//!
//! One thread owns `rtde_control` and executes the orders (`control`); a second one passes on the
//! states of `rtde_receive` (`states`); a third reads the orders. After the loss of a connection
//! the process reports it and ends at once, as the library would reconnect by itself, and crash.

mod control;
mod error;
mod library;
mod program;
mod shared;
mod states;

use std::io::{BufRead, BufReader, stdin, stdout};
use std::os::fd::AsFd;
use std::sync::mpsc::channel;
use std::thread;

use pyo3::prelude::*;

use self::control::{Driver, DriverEnd};
pub use self::error::ChildError;
use self::error::failure;
use self::library::{Receive, RtdeControl, leave};
use self::shared::{ChildShared, lines_to};
use super::priority;
use super::protocol::{Begin, ClientReport, Order};
use touchup_session::clock::Clock;

/// Serves orders until stdin ends; then brakes, ends the program of the controller and itself.
///
/// # Errors
/// [`ChildError`] if it cannot begin. Later errors go out as reports.
pub fn run() -> Result<(), ChildError> {
    let mut lines = BufReader::new(stdin()).lines().map_while(Result::ok);
    let first = lines.next().unwrap_or_default();
    let begin: Begin =
        serde_json::from_str(&first).map_err(|error| ChildError::NoOrders(error.to_string()))?;
    if !begin.is_lock_step {
        // for all threads, the library's included; the parent process reports a refusal
        let _ = priority::raise(priority::CLIENT, true);
    }
    let reports = stdout()
        .as_fd()
        .try_clone_to_owned()
        .map_err(|error| ChildError::NoOrders(error.to_string()))?;
    let shared = ChildShared::new(lines_to(reports.into()));
    if let Err(error) = library::load(&begin.site_packages) {
        shared.report(&ClientReport::BadWheel {
            reason: error.to_string(),
        });
        return Err(error);
    }
    // the constructor of control starts a program: only after the first state
    let connected = Receive::connect(&begin.host)
        .and_then(|receive| Ok((receive, RtdeControl::connect(&begin)?)));
    let (receive, control) = connected.inspect_err(|error| shared.report(&failure(error)))?;
    let (sender, orders) = channel();
    let (clock, hand) = begin.is_lock_step.then(Clock::manual).unzip();
    let clock = clock.unwrap_or_else(Clock::system);
    thread::scope(|scope| {
        scope.spawn(|| states::hand_on(&receive, &shared, &clock, hand.as_ref()));
        scope.spawn(move || {
            let mut orders = lines.filter_map(|line| serde_json::from_str::<Order>(&line).ok());
            // until the receiver is gone
            let _ = orders.try_for_each(|order| sender.send(order));
        });
        match Driver::new(&control, &shared, &begin, clock.clone()).run(&orders) {
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

/// Version of the linked Python, as `3.11`.
pub fn python_version() -> String {
    Python::attach(|py| {
        let version = py.version_info();
        format!("{}.{}", version.major, version.minor)
    })
}
