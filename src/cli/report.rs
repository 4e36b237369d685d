//! `touchup report`: runs the program `touchup-report`, to keep its code out of this one.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::Command;

use clap::Args;

use super::common::error::{CliError, Losses};

const MISSING: &str = "touchup-report is neither beside this program nor on the path: `cargo install --locked --path crates/touchup-report` in \
     touchup's folder puts it there, `cargo run --release -p touchup-report -- --out out` does without";

/// Program, beside this one or on the path.
const PROGRAM: &str = "touchup-report";

#[derive(Debug, Args)]
pub(super) struct HandedOver {
    /// Arguments of `touchup-report`; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Runs `touchup-report`, and ends with its exit code.
pub(super) fn report(arguments: &HandedOver) -> Result<Losses, CliError> {
    let beside = std::env::current_exe()
        .ok()
        .map(|this| this.with_file_name(PROGRAM))
        .filter(|path| path.is_file());
    let path = beside.unwrap_or_else(|| PROGRAM.into());
    let status = Command::new(&path)
        .args(&arguments.arguments)
        .status()
        .map_err(|source| {
            let not_started = || format!("cannot start {}: {source}", path.display());
            let is_missing = source.kind() == ErrorKind::NotFound;
            CliError::new(
                ("report", 1),
                if is_missing {
                    MISSING.to_owned()
                } else {
                    not_started()
                },
                None,
            )
        })?;
    // the program has printed its own errors
    if status.success() {
        Ok(Losses::new())
    } else {
        std::process::exit(status.code().unwrap_or(1))
    }
}
