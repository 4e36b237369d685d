//! `touchup sweep plan`: from what is swept to the jobs.

use std::io::{ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

use clap::Args;

use super::super::{CliError, Losses, check_kept, check_place, counted, not_written, print_result};
use crate::io::atomic::AtomicFile;
use crate::sweep::{JobsFile, SweepPlan};

#[derive(Debug, Args)]
pub(in crate::cli) struct PlanArguments {
    /// What is swept, YAML: scan, scene, recordings, the keys with their values, and how they are sampled (docs/sweep.md)
    #[arg(value_name = "GRID.yaml")]
    grid: PathBuf,
    /// Recordings beside those that the file names: of any kind that `touchup refine` reads
    #[arg(value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Output: the jobs, a line of JSON for each; by default they are printed. Paths in them are relative to its folder
    #[arg(long, value_name = "JSONL")]
    out: Option<PathBuf>,
}

pub(in crate::cli) fn plan(arguments: &PlanArguments) -> Result<Losses, CliError> {
    let PlanArguments { grid, recordings, out } = arguments;
    let folder = out.as_deref().map_or_else(PathBuf::new, JobsFile::folder);
    if let Some(out) = out {
        check_kept("GRID.yaml", grid, out)?;
        recordings.iter().try_for_each(|recording| check_kept("RECORDING", recording, out))?;
        check_place(out)?;
    }
    let plan = SweepPlan::read(grid, recordings, &folder)?;
    match out {
        Some(path) => {
            let mut file = AtomicFile::create(path).map_err(not_written(path))?;
            write_jobs(&plan, &mut file, path)?;
            file.commit().map_err(not_written(path))?;
            let jobs = counted(plan.count(), "job", "jobs");
            print_result(&format!("wrote {0}: {jobs}; touchup sweep run {0}", path.display()))?;
        }
        None => {
            let mut out = stdout().lock();
            write_jobs(&plan, &mut out, Path::new("stdout"))?;
            match out.flush() {
                Err(error) if error.kind() != ErrorKind::BrokenPipe => return Err(error.into()),
                _ => {}
            }
        }
    }
    Ok(Losses::new())
}

/// Stops where nobody reads any more.
fn write_jobs(plan: &SweepPlan, out: &mut impl Write, path: &Path) -> Result<(), CliError> {
    for job in plan.jobs() {
        let line = serde_json::to_string(&job?).expect("numbers and names alone cannot fail");
        match writeln!(out, "{line}") {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
            written => written.map_err(not_written(path))?,
        }
    }
    Ok(())
}
