//! What came of all jobs, as tables.

use std::path::Path;

use serde_json::{Map, Value};

use super::error::SweepError;
use super::job::{Job, JobsFile};
use super::run::{FEATURES, ResultFiles};
use touchup_io::features_file::read_features;
use touchup_io::result_table::ResultTable;

/// Missing jobs that are named at most.
const MOST_NAMED: usize = 20;

/// Jobs and features.
#[derive(Debug, Default)]
pub struct SweepTables {
    /// a row for each job that has a result, in the order of the plan
    pub jobs: ResultTable,
    /// a row for each feature of each of them
    pub features: ResultTable,
    /// jobs that failed by their input; each has a row that says why
    pub failed: u64,
    /// jobs without a result …
    pub missing: u64,
    /// … the first of them by their numbers
    pub first_missing: Vec<u64>,
    /// jobs whose result is no longer as it was written, each in words
    pub damaged: Vec<String>,
}

/// Reads all results of a plan.
///
/// - `with_features`: whether features are read as well.
///
/// # Errors
/// [`SweepError`]: a line of the plan that cannot be read.
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
        let ResultFiles { failed, summary } = match ResultFiles::of_job(&job, &result) {
            Err(damaged) => {
                tables.damaged.push(damaged.to_string());
                continue;
            }
            Ok(files) => files,
        };
        tables.failed += u64::from(failed.is_some());
        let mut row = row_of(&job, failed.as_deref());
        if tables.jobs.rows() == 0 {
            // `seed` and `failed` also where no job is simulated, or none failed
            tables.jobs = ResultTable::with_columns_of(&row);
        }
        if let Value::Object(summary) = summary {
            row.extend(summary);
        }
        tables.jobs.add_json(&row);
        if with_features && failed.is_none() {
            for feature in read_features(&result.join(FEATURES))?.features {
                let mut row = Map::new();
                row.insert("job".to_owned(), job.job.into());
                row.insert("job_id".to_owned(), job.id.clone().into());
                let mut row: Vec<_> = row.into_iter().collect();
                // numbers and names alone cannot fail
                if let Ok(Value::Object(of_feature)) = serde_json::to_value(&feature) {
                    row.extend(of_feature);
                }
                tables.features.add_json(&row);
            }
        }
    }
    Ok(tables)
}

/// Names and values of a job, and why it failed.
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
