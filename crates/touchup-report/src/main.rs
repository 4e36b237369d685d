//! `touchup-report`: error against run time, stability and cost on this machine, as a page with plots, tables and numbers.

mod arguments;
mod environment;

use std::io::{Write, stderr};
use std::process::ExitCode;

use clap::Parser;
use touchup_report::allocations::CountingAllocator;

use arguments::{ReportArguments, report};

/// Counts what is asked for memory: the report shows it.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    let arguments = match ReportArguments::try_parse() {
        Ok(arguments) => arguments,
        Err(told) => {
            // help and version come this way too, with code 0; a closed pipe leaves nobody to print for
            let _ = told.print();
            return ExitCode::from(told.exit_code() as u8);
        }
    };
    match report(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(stderr(), "touchup-report: {}", error.to_string().replace('\n', " "));
            ExitCode::from(error.exit_code())
        }
    }
}
