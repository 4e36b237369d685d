//! Starts logging and runs the command line.

use std::ffi::OsString;
use std::io::{IsTerminal, stderr};
use std::process::ExitCode;

use touchup::cli::{log_filter, run};
use touchup::log_lines::LogLines;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().collect();
    // RUST_LOG=touchup=debug shows more; results go to stdout, all else to stderr
    let wanted: Option<Targets> = std::env::var("RUST_LOG")
        .ok()
        .and_then(|levels| levels.parse().ok());
    let filter = wanted.unwrap_or_else(|| log_filter(&arguments));
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(stderr)
        .with_ansi(stderr().is_terminal())
        .without_time();
    tracing_subscriber::registry()
        .with(lines)
        .with(LogLines::default())
        .with(filter)
        .init();
    run(arguments)
}
