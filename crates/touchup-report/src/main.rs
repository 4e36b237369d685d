//! `touchup-report`: error against run time, stability and cost on this machine, as a page with
//! plots, tables and numbers.

mod arguments;
mod environment;

use std::io::{Write, stderr};
use std::process::ExitCode;

use clap::Parser;
use touchup_report::allocations::CountingAllocator;

use arguments::{ReportArguments, report};

/// Counts allocations for the report.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    let arguments = match ReportArguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // help and version arrive as errors too, with code 0; a closed pipe is not an error
            let _ = error.print();
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    match report(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(
                stderr(),
                "touchup-report: {}",
                error.to_string().replace('\n', " ")
            );
            ExitCode::from(error.exit_code())
        }
    }
}
