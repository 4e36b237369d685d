//! `touchup sweep plan`: from a grid to the jobs.

use std::io::{ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

use clap::Args;

use super::super::common::progress::WorkProgress;
use super::super::{CliError, Losses, check_kept, check_place, counted, not_written, print_result};
use touchup_io::atomic::AtomicFile;
use touchup_session::sweep::{JobsFile, SweepPlan};

#[derive(Debug, Args)]
pub(in crate::cli) struct PlanArguments {
    /// Grid of the sweep, YAML: scan, scene, recordings, the keys with their values, and the
    /// sampling (docs/sweep.md)
    #[arg(value_name = "GRID.yaml")]
    grid: PathBuf,
    /// Further recordings beside the grid's, of any kind that `touchup refine` reads
    #[arg(value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Output: the jobs, a line of JSON for each; default: stdout. Paths in them are relative to
    /// its folder
    #[arg(long, value_name = "JSONL")]
    out: Option<PathBuf>,
}

pub(in crate::cli) fn plan(arguments: &PlanArguments) -> Result<Losses, CliError> {
    let PlanArguments {
        grid,
        recordings,
        out,
    } = arguments;
    match out {
        Some(path) => {
            let jobs = counted(plan_sweep(grid, recordings, path)?, "job", "jobs");
            print_result(&format!(
                "wrote {0}: {jobs}; touchup sweep run {0}",
                path.display()
            ))?;
        }
        None => {
            let plan = checked(grid, recordings, Path::new(""))?;
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

/// Writes the jobs of a sweep into a file, as a whole or not at all, and returns their number.
///
/// - `grid`: file of the sweep; `recordings`: further ones, relative to the present folder.
///
/// # Errors
/// As on the command line.
pub fn plan_sweep(grid: &Path, recordings: &[PathBuf], out: &Path) -> Result<u64, CliError> {
    check_kept("GRID.yaml", grid, out)?;
    recordings
        .iter()
        .try_for_each(|recording| check_kept("RECORDING", recording, out))?;
    check_place(out)?;
    let plan = checked(grid, recordings, &JobsFile::folder(out))?;
    let mut file = AtomicFile::create(out).map_err(not_written(out))?;
    write_jobs(&plan, &mut file, out)?;
    file.commit().map_err(not_written(out))?;
    Ok(plan.count())
}

/// Reads a plan and checks every setting, with a progress stage for many.
fn checked(grid: &Path, recordings: &[PathBuf], folder: &Path) -> Result<SweepPlan, CliError> {
    let _checking = WorkProgress::stage("check");
    Ok(SweepPlan::read(grid, recordings, folder)?)
}

/// Writes the jobs; stops at a closed pipe.
fn write_jobs(plan: &SweepPlan, out: &mut impl Write, path: &Path) -> Result<(), CliError> {
    let mut progress = WorkProgress::new("plan", Some(plan.count()));
    for job in plan.jobs() {
        let line = serde_json::to_string(&job?).expect("numbers and names alone cannot fail");
        match writeln!(out, "{line}") {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
            written => written.map_err(not_written(path))?,
        }
        progress.step();
    }
    Ok(())
}
