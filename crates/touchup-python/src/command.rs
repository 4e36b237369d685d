//! The command `touchup` of the wheel.

use std::ffi::OsString;
use std::io::{IsTerminal, stderr};

use pyo3::prelude::*;
use touchup::cli::{exit_code, log_filter};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Runs the command line, with the program name first, and returns its exit code: 0 done, 1 result
/// not written, 2 wrong usage, 3 bad input file, 4 done with losses, 5 the arm stopped, 130 a
/// signal stopped it. Results go to stdout, all else to stderr.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| {
        let wanted: Option<Targets> = std::env::var("RUST_LOG")
            .ok()
            .and_then(|levels| levels.parse().ok());
        let filter = wanted.unwrap_or_else(|| log_filter(&arguments));
        let lines = tracing_subscriber::fmt::layer()
            .with_writer(stderr)
            .with_ansi(stderr().is_terminal())
            .without_time();
        // a second command in one process keeps the log of the first
        let _ = tracing_subscriber::registry()
            .with(lines)
            .with(filter)
            .try_init();
        exit_code(arguments)
    })
}
