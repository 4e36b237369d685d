//! Jobs of a sweep, and changes between two of them.

use std::path::{Path, PathBuf};

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;
use touchup::cli::{plan_sweep, what_if_json};
use touchup_features::compare::Displacement;
use touchup_session::sweep::{
    COVERAGE, GivenInput, JobReport, JobResult, JobRunner, JobsFile, SweepTables, WhatIf, tables_of,
};

use crate::arrays::{CompactMesh, json as to_json};
use crate::failure::at_work;
use crate::files::set_columns;

/// Writes the jobs of a sweep, and returns their number.
#[pyfunction]
pub fn sweep_plan(
    py: Python<'_>,
    grid: PathBuf,
    recordings: Vec<PathBuf>,
    out: PathBuf,
) -> PyResult<u64> {
    at_work(py, || plan_sweep(&grid, &recordings, &out))
}

/// Runs one job like `touchup sweep run --job`; returns at once if its result exists.
///
/// - `scan`, `recording`: content of their files, if the caller holds it, in place of reading them.
///
/// Returns `job`, `id`, `result` (its folder), `was_there`, `failed` (why, or None) and `summary`,
/// a text of JSON.
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
    let JobReport {
        job,
        id,
        result,
        was_there,
        failed,
        summary,
    } = at_work(py, || {
        let line = JobsFile::job(&jobs, job)?;
        let given = GivenInput { scan, recording };
        Ok(JobRunner::new(&jobs, results).run(&line, given, again, &mut || {})?)
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

/// Results of all jobs as JSON: a row for each job, one for each feature, the number of jobs
/// without a result, and damaged results in words.
#[pyfunction]
#[pyo3(signature = (jobs, results, with_features))]
pub fn sweep_tables(
    py: Python<'_>,
    jobs: PathBuf,
    results: Option<PathBuf>,
    with_features: bool,
) -> PyResult<String> {
    at_work(py, || {
        let results = JobsFile::results(&jobs, results);
        let SweepTables {
            jobs,
            features,
            missing,
            damaged,
            ..
        } = tables_of(&jobs, &results, with_features)?;
        to_json(
            &json!({ "jobs": jobs.json_rows(), "features": features.json_rows(), "missing": missing, "damaged": damaged }),
        )
    })
}

/// Changes between the results in two folders: `report` as JSON, and for each mesh its arrays with
/// `displacement` and `plus_minus` (V,) m.
#[pyfunction]
pub fn what_if<'py>(py: Python<'py>, a: PathBuf, b: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let (results, found, report) = at_work(py, || {
        let results = [JobResult::read(&a)?, JobResult::read(&b)?];
        let found = WhatIf::of(&results[0], &results[1])?;
        let names = [shown(&a), shown(&b)];
        let report = what_if_json([&results[0], &results[1]], [&names[0], &names[1]], &found);
        Ok((results, found, to_json(&report)?))
    })?;
    let into = PyDict::new(py);
    into.set_item("report", report)?;
    into.set_item("a", moved_mesh(py, &results[0], &found.of_a)?)?;
    into.set_item(
        "b",
        moved_mesh(py, &results[1], found.of_b.as_ref().unwrap_or(&found.of_a))?,
    )?;
    Ok(into)
}

fn shown(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn moved_mesh<'py>(
    py: Python<'py>,
    result: &JobResult,
    displaced: &[Displacement],
) -> PyResult<Bound<'py, PyDict>> {
    let (into, compact) = (PyDict::new(py), CompactMesh::of(&result.mesh));
    let column = |of: fn(&Displacement) -> f64| {
        let values: Vec<f64> = displaced.iter().map(of).collect();
        compact
            .column(&values)
            .map(|values| PyArray1::from_vec(py, values))
    };
    into.set_item("displacement", column(|one| one.distance))?;
    into.set_item(
        "plus_minus",
        column(|one| one.sigma.map_or(f64::NAN, |_| one.plus_minus(COVERAGE))),
    )?;
    let mesh = PyDict::new(py);
    set_columns(&mesh, &compact, result.sigma.as_deref(), None)?;
    compact.into_dict(&mesh)?;
    into.set_item("mesh", mesh)?;
    Ok(into)
}
