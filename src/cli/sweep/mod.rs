//! `touchup sweep`: many refinements, each a job with the same bytes on any machine.

mod places;
mod plan;
mod run;
mod table;

use clap::Subcommand;

pub(super) use self::places::check_table;
pub use self::plan::plan_sweep;
use super::{CliError, Losses};

#[derive(Debug, Subcommand)]
pub(super) enum SweepArguments {
    /// Makes the jobs: settings of the scene times recordings, a line of JSON for each
    Plan(plan::PlanArguments),
    /// Runs one job, or all without a result, one after the other
    Run(run::RunArguments),
    /// Makes a table of the results: a row for each job, and one for each feature
    Table(table::TableArguments),
}

pub(super) fn sweep(arguments: &SweepArguments) -> Result<Losses, CliError> {
    match arguments {
        SweepArguments::Plan(arguments) => plan::plan(arguments),
        SweepArguments::Run(arguments) => run::run(arguments),
        SweepArguments::Table(arguments) => table::table(arguments),
    }
}
