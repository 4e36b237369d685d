//! Paths of results and tables.

use std::path::{Path, PathBuf};

use super::super::{CliError, check_kept_by, check_place, require};
use touchup_session::sweep::JobsFile;

/// Folder of the results: as named, or `results` beside the jobs.
pub(in crate::cli) fn results_of(jobs: &Path, named: Option<&PathBuf>) -> PathBuf {
    named
        .cloned()
        .unwrap_or_else(|| JobsFile::folder(jobs).join("results"))
}

/// Checks name and path of a table.
pub(in crate::cli) fn check_table(flag: &str, path: &Path, jobs: &Path) -> Result<(), CliError> {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    let is_table = ending.is_some_and(|ending| ending == "csv" || ending == "parquet");
    require(
        is_table,
        format_args!("{flag} {} must end in .csv or .parquet", path.display()),
    )?;
    check_kept_by(flag, "JSONL", jobs, path)?;
    check_place(path)
}
