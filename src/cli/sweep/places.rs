//! Paths of results and tables.

use std::path::{Path, PathBuf};

use clap::Args;

use super::super::{CliError, check_kept_by, check_place, require};
use touchup_io::result_table::is_table;

/// Jobs of a sweep, and their results.
#[derive(Debug, Args)]
pub(super) struct SweepPlaces {
    /// Jobs, as `touchup sweep plan` writes them
    #[arg(value_name = "JSONL")]
    pub jobs: PathBuf,
    /// Folder with a subfolder for each job, by its id [default: results, beside the jobs]
    #[arg(long, value_name = "DIR")]
    pub results: Option<PathBuf>,
}

/// Checks name and path of a table.
pub(in crate::cli) fn check_table(flag: &str, path: &Path, jobs: &Path) -> Result<(), CliError> {
    require(
        is_table(path),
        format_args!("{flag} {} must end in .csv or .parquet", path.display()),
    )?;
    check_kept_by(flag, "JSONL", jobs, path)?;
    check_place(path)
}
