//! The command line: one file for each verb.
//!
//! Results go to stdout, everything else to stderr. Exit codes, which other tools rely on: 0 done, 1 the result could
//! not be written, 2 wrong usage, 3 bad input file, 4 done with losses, which are named.

mod latency;
mod progress;
mod refine;
mod replay;
mod step;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::io::mesh_file::MeshFileError;
use crate::io::recording::RecordingError;
use crate::refine::RefineError;
use crate::scene::SceneError;
use crate::touch::SettingError;

/// Repairs a 3D scan by touch.
#[derive(Debug, Parser)]
#[command(name = "touchup", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 result not written, 2 wrong usage, 3 bad input file, \
                          4 done with losses (named on stderr)";

#[derive(Debug, Subcommand)]
enum Verb {
    /// Refines a scan by a recording of touches
    Refine(refine::RefineArguments),
    /// Answers one held sample per JSON line on stdin, so that other implementations can be compared
    Step,
}

/// Why a verb gave up.
#[derive(Debug, thiserror::Error)]
enum CliError {
    /// A flag that is well-formed and yet cannot be.
    #[error("{0}; see --help")]
    Usage(String),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{0}")]
    ReadMesh(MeshFileError),
    #[error(transparent)]
    ReadRecording(RecordingError),
    #[error("{0}")]
    WriteMesh(MeshFileError),
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error("cannot read stdin or write stdout: {0}")]
    Stream(#[from] std::io::Error),
    #[error("the scan cannot be refined: {0}")]
    Refine(#[from] RefineError),
}

impl CliError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::WriteMesh(_) | Self::Stream(_) => 1,
            Self::Usage(_) => 2,
            // settings come from a scene file: its flags are checked before
            Self::Scene(_) | Self::ReadMesh(_) | Self::ReadRecording(_) | Self::Setting(_) | Self::Refine(_) => 3,
        }
    }
}

/// What was lost on the way of work that was done; empty: nothing.
type Losses = Vec<String>;

/// Runs the verb that `arguments` name, the program's own name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(told) => {
            // help and version come this way too, with code 0; a closed pipe leaves nobody to tell
            let _ = told.print();
            return ExitCode::from(told.exit_code() as u8);
        }
    };
    let ended = match arguments.verb {
        Verb::Refine(arguments) => refine::refine(&arguments),
        Verb::Step => {
            step::run(std::io::stdin().lock(), std::io::stdout().lock()).map(|()| Losses::new()).map_err(CliError::from)
        }
    };
    match ended {
        Ok(losses) if losses.is_empty() => ExitCode::SUCCESS,
        Ok(losses) => {
            complain(&format!("done with losses: {}", losses.join("; ")));
            ExitCode::from(4)
        }
        Err(error) => {
            complain(&error.to_string());
            ExitCode::from(error.exit_code())
        }
    }
}

/// One line on stderr.
fn complain(line: &str) {
    let _ = writeln!(std::io::stderr(), "touchup: {}", line.replace('\n', " "));
}

/// One line, or several, on stdout. A reader that has gone away is no error of ours.
fn tell(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}
