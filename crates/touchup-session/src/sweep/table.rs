//! Results of all jobs as tables.

use std::path::Path;

use serde_json::Value;

use super::error::SweepError;
use super::job::{Job, JobsFile};
use super::run::JobOutcome;
use crate::session::ResultFiles;
use touchup_io::features_file::read_features;
use touchup_io::result_table::ResultTable;

/// Maximum number of missing jobs named.
const MOST_NAMED: usize = 20;

/// Jobs and features.
#[derive(Debug, Default)]
pub struct SweepTables {
    /// a row for each job with a result, in the order of the plan
    pub jobs: ResultTable,
    /// a row for each feature of these jobs
    pub features: ResultTable,
    /// jobs that failed by their input; each has a row with the reason
    pub failed: u64,
    /// number of jobs without a result
    pub missing: u64,
    /// numbers of the first missing jobs
    pub first_missing: Vec<u64>,
    /// jobs with a changed result, each in words
    pub damaged: Vec<String>,
}

/// Reads all results of a plan.
///
/// - `with_features`: whether features are read as well.
///
/// # Errors
/// [`SweepError`] for an unreadable line of the plan.
pub fn tables_of(
    jobs: &Path,
    results: &Path,
    with_features: bool,
) -> Result<SweepTables, SweepError> {
    let mut tables = SweepTables::default();
    for job in JobsFile::open(jobs)? {
        let job = job?;
        let result = results.join(&job.id);
        if !result.is_dir() {
            tables.missing += 1;
            if tables.first_missing.len() < MOST_NAMED {
                tables.first_missing.push(job.job);
            }
            continue;
        }
        let JobOutcome { failed, summary } = match JobOutcome::of_job(&job, &result) {
            Err(damaged) => {
                tables.damaged.push(damaged.to_string());
                continue;
            }
            Ok(files) => files,
        };
        tables.failed += u64::from(failed.is_some());
        let mut row = row_of(&job, failed.as_deref());
        if tables.jobs.rows() == 0 {
            // includes `seed` without simulated jobs, and `failed` without failures
            tables.jobs = ResultTable::with_columns_of(&row);
        }
        if let Value::Object(summary) = summary {
            row.extend(summary);
        }
        tables.jobs.add_json(&row);
        if with_features && failed.is_none() {
            for feature in read_features(&result.join(ResultFiles::FEATURES))?.features {
                let of_job = [("job", job.job.into()), ("job_id", job.id.clone().into())];
                tables.features.add_feature(&of_job, &feature);
            }
        }
    }
    Ok(tables)
}

/// Names and values of a job, and the reason of its failure.
fn row_of(job: &Job, failed: Option<&str>) -> Vec<(String, Value)> {
    let text = |name: &str, value: Value| (name.to_owned(), value);
    let mut row = vec![
        text("job", job.job.into()),
        text("id", job.id.clone().into()),
        text("recording", job.recording.to_string_lossy().into()),
        text("seed", job.seed.map_or(Value::Null, Value::from)),
    ];
    row.extend(
        job.keys
            .iter()
            .map(|(key, value)| (key.clone(), value.clone())),
    );
    row.push(text("failed", failed.map_or(Value::Null, Value::from)));
    row
}
