//! `touchup whatif`: differences between two results of a sweep beyond their uncertainties.

mod page;
mod report;
mod tables;

use std::path::{Path, PathBuf};

use clap::Args;

use self::page::page;
use self::report::WhatIfReport;
pub use self::report::what_if_json;
use self::tables::{features_table, vertices_table, write_moved_mesh};
use super::common::progress::WorkProgress;
use super::sweep::check_table;
use super::{CliError, Losses, check_kept_by, check_outputs, not_written, print_report, require};
use touchup_session::session::ResultFiles;
use touchup_session::sweep::{JobResult, JobsFile, WhatIf};

#[derive(Debug, Args)]
pub(super) struct WhatIfArguments {
    /// Folder of a result (`touchup sweep run`), or with --jobs the number of a job
    #[arg(value_name = "A")]
    a: String,
    /// Folder or number of another result of the same scan
    #[arg(value_name = "B")]
    b: String,
    /// Jobs, as `touchup sweep plan` writes them: A and B are then their numbers
    #[arg(long, value_name = "JSONL")]
    jobs: Option<PathBuf>,
    /// With --jobs: folder with a subfolder for each, by its id [default: results, beside the jobs]
    #[arg(long, value_name = "DIR", requires = "jobs")]
    results: Option<PathBuf>,
    /// Output: a page with pictures of both, the differences, and both values of each feature
    #[arg(long, value_name = "HTML")]
    out: Option<PathBuf>,
    /// Output: a row for each vertex, .csv or .parquet
    #[arg(long, value_name = "TABLE")]
    vertices_out: Option<PathBuf>,
    /// Output: a row for each number of each feature, .csv or .parquet
    #[arg(long, value_name = "TABLE")]
    features_out: Option<PathBuf>,
    /// Output: the mesh of B, coloured, with the columns displacement_mm, plus_minus_mm and moved,
    /// in mm
    #[arg(long, value_name = "PLY")]
    mesh_out: Option<PathBuf>,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `touchup whatif`.
pub(super) fn what_if(arguments: &WhatIfArguments) -> Result<Losses, CliError> {
    arguments.check()?;
    let names = [&arguments.a, &arguments.b];
    let folders = arguments.folders()?;
    let reading = WorkProgress::stage("read");
    let [a, b] = [JobResult::read(&folders[0])?, JobResult::read(&folders[1])?];
    drop(reading);
    let comparing = WorkProgress::stage("compare");
    let found = WhatIf::of(&a, &b)?;
    let report = WhatIfReport::of([&a, &b], names.map(String::as_str), &found);
    drop(comparing);
    if let Some(path) = &arguments.out {
        let text = page(&report, [&a, &b], &found).map_err(not_written(path))?;
        touchup_io::text_file::write_text(path, &text).map_err(CliError::not_written)?;
    }
    if let Some(path) = &arguments.vertices_out {
        vertices_table([&a, &b], &found).write(path)?;
    }
    if let Some(path) = &arguments.features_out {
        features_table(&found).write(path)?;
    }
    if let Some(path) = &arguments.mesh_out {
        write_moved_mesh(path, &b, &found)?;
    }
    print_report(arguments.json, &report, || report.to_string())?;
    Ok(Losses::new())
}

impl WhatIfArguments {
    fn check(&self) -> Result<(), CliError> {
        let tables = [
            ("--vertices-out", &self.vertices_out),
            ("--features-out", &self.features_out),
        ];
        let jobs = self.jobs.as_deref().unwrap_or(Path::new(""));
        for (flag, path) in tables {
            path.iter()
                .try_for_each(|path| check_table(flag, path, jobs))?;
        }
        let outputs = [
            ("--out", ".html", &self.out),
            ("--mesh-out", ".ply", &self.mesh_out),
        ];
        check_outputs(
            &outputs,
            &[self.jobs.as_ref()],
            "the plan: choose another place",
        )?;
        let all = [
            ("--out", &self.out),
            ("--mesh-out", &self.mesh_out),
            tables[0],
            tables[1],
        ];
        let all: Vec<_> = all
            .into_iter()
            .filter_map(|(flag, path)| Some((flag, path.as_ref()?)))
            .collect();
        for (at, (flag, path)) in all.iter().enumerate() {
            if let Some((other, _)) = all[..at].iter().find(|(_, other)| other == path) {
                let why = format!(
                    "{flag} and {other} would both write {}: choose another place",
                    path.display()
                );
                return Err(CliError::usage(why));
            }
        }
        Ok(())
    }

    /// Folders of both results.
    fn folders(&self) -> Result<[PathBuf; 2], CliError> {
        let Some(jobs) = &self.jobs else {
            return self.given_folders();
        };
        let results = JobsFile::results(jobs, self.results.clone());
        let folder = |name: &String| {
            let number = name.parse::<u64>();
            let why = format!(
                "{name} is no number of a job: with --jobs give two, as `touchup whatif 0 3 --jobs {}`",
                jobs.display()
            );
            let job = JobsFile::job(jobs, number.map_err(|_| CliError::usage(why))?)?;
            let folder = results.join(&job.id);
            let why = format!(
                "job {name} has no result: touchup sweep run {} --job {name}",
                jobs.display()
            );
            if folder.is_dir() {
                Ok(folder)
            } else {
                Err(CliError::new(("sweep", 3), why, None))
            }
        };
        Ok([folder(&self.a)?, folder(&self.b)?])
    }

    fn given_folders(&self) -> Result<[PathBuf; 2], CliError> {
        let folders = [&self.a, &self.b].map(PathBuf::from);
        for folder in &folders {
            let why = format!(
                "{} is no folder of a result; numbers of jobs need --jobs JSONL",
                folder.display()
            );
            require(folder.is_dir(), why)?;
            for (flag, path) in [("--out", &self.out), ("--mesh-out", &self.mesh_out)] {
                path.iter().try_for_each(|path| {
                    check_kept_by(flag, "A or B", &folder.join(ResultFiles::MESH), path)
                })?;
            }
        }
        Ok(folders)
    }
}
