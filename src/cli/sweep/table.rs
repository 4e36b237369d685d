//! `touchup sweep table`: results of all jobs.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::super::{CliError, Losses, counted, print_report, require};
use super::places::{SweepPlaces, check_table};
use super::run::MOST_NAMED;
use touchup_session::sweep::{JobsFile, SweepTables, tables_of};

#[derive(Debug, Args)]
pub(in crate::cli) struct TableArguments {
    #[command(flatten)]
    places: SweepPlaces,
    /// Output: a row for each job with a result, .csv or .parquet
    #[arg(long, value_name = "TABLE")]
    out: PathBuf,
    /// Output: a row for each feature of each job, .csv or .parquet
    #[arg(long, value_name = "TABLE")]
    features_out: Option<PathBuf>,
    /// Prints one JSON object
    #[arg(long)]
    json: bool,
}

pub(in crate::cli) fn table(arguments: &TableArguments) -> Result<Losses, CliError> {
    let TableArguments {
        places: SweepPlaces { jobs, results },
        out,
        features_out,
        json,
    } = arguments;
    check_table("--out", out, jobs)?;
    features_out
        .iter()
        .try_for_each(|path| check_table("--features-out", path, jobs))?;
    require(
        features_out.as_ref() != Some(out),
        "--out and --features-out are the same file: choose another place",
    )?;
    let results = JobsFile::results(jobs, results.clone());
    let SweepTables {
        jobs,
        features,
        failed,
        missing,
        first_missing,
        damaged,
    } = tables_of(jobs, &results, features_out.is_some())?;
    jobs.write(out)?;
    features_out
        .iter()
        .try_for_each(|path| features.write(path))?;
    let rows = jobs.rows();
    let report = json!({ "rows": rows, "failed": failed, "missing": missing, "damaged": damaged, "features": features.rows(), "out": out });
    print_report(*json, &report, || {
        let of_features = features_out.as_ref().map_or(String::new(), |path| {
            format!(
                "\nwrote {}: {}",
                path.display(),
                counted(features.rows() as u64, "feature", "features")
            )
        });
        let rows = counted(rows as u64, "job", "jobs");
        format!(
            "wrote {}: {rows}, {failed} of them failed{of_features}",
            out.display()
        )
    })?;
    let named: Vec<_> = first_missing.iter().map(u64::to_string).collect();
    let more = if named.len() as u64 == missing {
        ""
    } else {
        ", …"
    };
    let jobs = counted(missing, "job has", "jobs have");
    let mut losses = Losses::new();
    if missing > 0 {
        losses.push(format!("{jobs} no result: {}{more}", named.join(", ")));
    }
    losses.extend(damaged.into_iter().take(MOST_NAMED));
    Ok(losses)
}
