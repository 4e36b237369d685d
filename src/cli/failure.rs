//! Errors of the command line: one line of text, or one JSON object where `--json` is asked for.

use std::error::Error;
use std::ffi::OsString;
use std::io::{self, ErrorKind, Write, stderr};
use std::iter::successors;
use std::process::ExitCode;

use serde::Serialize;

use super::error::CliError;

/// Why a command ended with another exit code than 0.
#[derive(Debug, Serialize)]
pub(super) struct Failure {
    /// what is wrong: `usage`, `scene`, `mesh`, `recording`, `not_written`, `losses`, …
    pub kind: &'static str,
    /// in words, with values and units
    pub message: String,
    /// what to do next, where the message does not say it
    pub hint: Option<&'static str>,
    /// 1 to 4, as `touchup --help` lists them
    pub exit_code: u8,
}

/// How errors are printed.
#[derive(Clone, Copy, Debug)]
pub(super) enum ErrorForm {
    Text,
    Json,
}

impl Failure {
    /// The failure that an error is.
    pub fn of(error: &CliError) -> Self {
        let (kind, exit_code) = error.kind_and_exit_code();
        let hint = match kind {
            "not_written" => Some("check that the folder exists, may be written to and has space left"),
            _ if is_missing(error) => {
                Some("check the path: no file is there; a relative path begins at the present folder")
            }
            "scene" => Some("config/touchup.yaml lists every parameter with its unit and range"),
            _ => None,
        };
        Self { kind, message: one_line(&error.to_string()), hint, exit_code }
    }
}

/// Whether a file that should be read is not there.
fn is_missing(error: &CliError) -> bool {
    successors(error.source(), |&cause| cause.source())
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|cause| cause.kind() == ErrorKind::NotFound)
}

impl ErrorForm {
    /// The form that a command line asks for, also one that cannot be parsed.
    pub fn of(arguments: &[OsString]) -> Self {
        if arguments.iter().any(|word| word == "--json") { Self::Json } else { Self::Text }
    }

    /// Prints a failure as one line on stderr.
    pub fn print(self, failure: &Failure) -> ExitCode {
        let line = match self {
            Self::Text => format!("touchup: {}", failure.message),
            Self::Json => serde_json::to_string(failure).expect("a number and texts alone cannot fail"),
        };
        // a closed pipe has no reader left
        let _ = writeln!(stderr(), "{line}");
        ExitCode::from(failure.exit_code)
    }

    /// Prints arguments that cannot be parsed, or the help or version that they ask for (exit code 0).
    pub fn print_parse_error(self, error: &clap::Error) -> ExitCode {
        let exit_code = error.exit_code() as u8;
        if exit_code == 0 || matches!(self, Self::Text) {
            let _ = error.print();
            return ExitCode::from(exit_code);
        }
        let text = error.to_string();
        let message = text.split("\n\n").next().unwrap_or(&text);
        let message = one_line(message.trim_start_matches("error: "));
        let hint = Some("`touchup COMMAND --help` lists the flags of a command");
        self.print(&Failure { kind: "usage", message, hint, exit_code })
    }
}

/// All words of `text` on one line.
fn one_line(text: &str) -> String {
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}
