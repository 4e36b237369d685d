//! One job of a sweep.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use touchup_session::sweep::{GivenInput, JobReport, JobRunner, JobsFile};

use crate::failure::at_work;

/// Runs one job as `touchup sweep run --job` does; one that has its result returns at once.
///
/// - `scan`, `recording`: content of their files, where the caller has it already: then they are not read.
///
/// Returns `job`, `id`, `result` (its folder), `was_there`, `failed` (why, or None) and `summary`, a text of JSON.
#[pyfunction]
pub fn run_job<'py>(
    py: Python<'py>,
    jobs: PathBuf,
    job: u64,
    results: Option<PathBuf>,
    scan: Option<&[u8]>,
    recording: Option<&[u8]>,
    again: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let JobReport { job, id, result, was_there, failed, summary } = at_work(py, || {
        let folder = JobsFile::folder(&jobs);
        let results = results.unwrap_or_else(|| folder.join("results"));
        let line = JobsFile::job(&jobs, job)?;
        Ok(JobRunner::new(folder, results).run(&line, GivenInput { scan, recording }, again, &mut || {})?)
    })?;
    let into = PyDict::new(py);
    into.set_item("job", job)?;
    into.set_item("id", id)?;
    into.set_item("result", result)?;
    into.set_item("was_there", was_there)?;
    into.set_item("failed", failed)?;
    into.set_item("summary", summary.to_string())?;
    Ok(into)
}
