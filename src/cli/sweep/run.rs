//! `touchup sweep run`: one job, or all without a result.

use std::path::Path;

use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};

use super::super::common::error::UNSOUND;
use super::super::common::progress::WorkProgress;
use super::super::{CliError, Losses, counted, print_report, print_result};
use super::places::SweepPlaces;
use touchup_session::sweep::{GivenInput, JobReport, JobRunner, JobsFile, SweepError};

#[derive(Debug, Args)]
pub(in crate::cli) struct RunArguments {
    /// Runs the job of this number alone; a job with a result ends at once
    #[arg(long, value_name = "K")]
    job: Option<u64>,
    #[command(flatten)]
    places: SweepPlaces,
    /// Also reruns jobs with a result, as failed ones, and replaces it
    #[arg(long)]
    again: bool,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

/// Maximum number of jobs in a message.
pub(super) const MOST_NAMED: usize = 20;

pub(in crate::cli) fn run(arguments: &RunArguments) -> Result<Losses, CliError> {
    let RunArguments {
        job,
        places: SweepPlaces { jobs, results },
        again,
        json,
    } = arguments;
    let runner = JobRunner::new(jobs, results.clone());
    match job {
        Some(job) => run_one(&runner, jobs, *job, *again, *json),
        None => run_all(&runner, jobs, *again, *json),
    }
}

fn run_one(
    runner: &JobRunner,
    jobs: &Path,
    job: u64,
    again: bool,
    as_json: bool,
) -> Result<Losses, CliError> {
    let job = JobsFile::job(jobs, job)?;
    let mut progress = WorkProgress::new("refine", None);
    let report = runner.run(&job, GivenInput::default(), again, &mut || progress.step())?;
    drop(progress);
    let JobReport {
        job,
        id,
        result,
        was_there,
        failed,
        summary,
    } = report;
    if let Some(why) = failed {
        return Err(CliError::new(
            UNSOUND,
            format_args!("job {job} failed: {why}"),
            None,
        ));
    }
    let losses = losses_of(&summary);
    if as_json {
        let report = json!({ "job": job, "id": id, "result": result, "was_there": was_there, "summary": summary });
        print_result(&report.to_string())?;
    } else {
        let what = if was_there { "was there" } else { "done" };
        print_result(&format!("job {job}: {what}: {}", result.display()))?;
    }
    Ok(losses)
}

fn losses_of(summary: &Value) -> Losses {
    let losses = summary
        .get("losses")
        .and_then(Value::as_array)
        .into_iter()
        .flatten();
    losses
        .filter_map(Value::as_str)
        .map(str::to_owned)
        .collect()
}

/// Output of `--json` for all jobs.
#[derive(Debug, Default, Serialize)]
struct RunSummary {
    jobs: u64,
    /// Refined now.
    ran: u64,
    /// With a result before.
    were_there: u64,
    /// Failed by their input, now or before.
    failed: u64,
    /// Refined from a damaged recording.
    with_losses: u64,
    /// With a result changed since it was written.
    damaged: u64,
}

fn run_all(
    runner: &JobRunner,
    jobs: &Path,
    again: bool,
    as_json: bool,
) -> Result<Losses, CliError> {
    let mut summary = RunSummary::default();
    // checks every line before the first run
    let count = JobsFile::open(jobs)?.try_fold(0_u64, |count, job| job.map(|_| count + 1))?;
    let mut progress = WorkProgress::new("sweep", Some(count));
    let mut named = Losses::new();
    for job in JobsFile::open(jobs)? {
        let ran = runner.run(&job?, GivenInput::default(), again, &mut || {});
        progress.step_now();
        summary.jobs += 1;
        let JobReport {
            job,
            was_there,
            failed,
            summary: numbers,
            ..
        } = match ran {
            Err(damaged @ SweepError::Damaged { .. }) => {
                summary.damaged += 1;
                named.extend(Some(damaged.to_string()).filter(|_| named.len() < MOST_NAMED));
                continue;
            }
            ran => ran?,
        };
        *(if was_there {
            &mut summary.were_there
        } else {
            &mut summary.ran
        }) += 1;
        let losses = losses_of(&numbers);
        summary.failed += u64::from(failed.is_some());
        summary.with_losses += u64::from(!losses.is_empty());
        let said = failed.map(|why| format!("job {job} failed: {why}"));
        let said = said.or_else(|| losses.first().map(|loss| format!("job {job}: {loss}")));
        named.extend(said.filter(|_| named.len() < MOST_NAMED));
    }
    drop(progress);
    let more =
        (summary.failed + summary.with_losses + summary.damaged).saturating_sub(named.len() as u64);
    if more > 0 {
        named.push(format!("and {more} more"));
    }
    print_report(as_json, &summary, || {
        let RunSummary {
            jobs,
            ran,
            were_there,
            failed,
            ..
        } = &summary;
        let jobs = counted(*jobs, "job", "jobs");
        format!("{jobs}: {ran} refined now, {were_there} had a result, {failed} of all failed")
    })?;
    Ok(named)
}
