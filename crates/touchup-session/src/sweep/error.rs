//! What can be wrong with a sweep.

use std::path::PathBuf;

use crate::scene::SceneError;
use crate::session::OutcomeError;
use touchup_io::features_file::FeaturesFileError;
use touchup_io::file_error::FileError;
use touchup_io::json_lines::JsonLineError;
use touchup_sim::SimError;

/// Why a sweep was not planned, or a job not run.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// What is swept.
    #[error("{}: {why}", path.display())]
    Grid {
        /// the file
        path: PathBuf,
        /// with the line, where there is one
        why: String,
    },
    /// The scene that all jobs begin with.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// More jobs than a plan may have.
    #[error(
        "{}: {jobs} jobs are too many: at most {most}; take fewer values, or sampling: {{ sobol: {{ samples: 64 }} }}", path.display()
    )]
    TooMany {
        /// the file
        path: PathBuf,
        /// … as a number, or as more than can be counted
        jobs: String,
        /// the limit
        most: u64,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line of the jobs.
    #[error(transparent)]
    Line(#[from] JsonLineError),
    /// No such job.
    #[error("{} has no job {job}: it has {count}, from 0 on", path.display())]
    NoJob {
        /// the file of the jobs
        path: PathBuf,
        /// by its number
        job: u64,
        /// how many there are
        count: u64,
    },
    /// A file is not what it was.
    #[error(
        "{what} is not what was planned: sha256 is {found}, and {planned} in the plan; bring the file back, or plan again (touchup sweep plan)"
    )]
    Changed {
        /// which
        what: String,
        /// of the content now
        found: String,
        /// … and then
        planned: String,
    },
    /// Another touchup made the plan.
    #[error(
        "job {job} was planned by touchup {planned}, and this is {own}: plan again, or run it by the same version"
    )]
    OtherVersion {
        /// by its number
        job: u64,
        /// version of the plan
        planned: String,
        /// version that runs
        own: &'static str,
    },
    /// The line was changed by hand.
    #[error(
        "job {job} is not the one that its id names: plan again (touchup sweep plan), and leave the lines as they are"
    )]
    OtherJob {
        /// by its number
        job: u64,
    },
    /// A result that was not written by a job.
    #[error("{} is no result of a job: {why}", path.display())]
    NoResult {
        /// the folder or file
        path: PathBuf,
        /// what is missing
        why: String,
    },
    /// … that is no longer as the job wrote it.
    #[error(
        "job {job}: {} is damaged: {why}; run it anew by touchup sweep run --job {job} --again", result.display()
    )]
    Damaged {
        /// by its number
        job: u64,
        /// its folder
        result: PathBuf,
        /// which file, and what is wrong with it
        why: String,
    },
    /// A simulated scan or touch.
    #[error(transparent)]
    Simulated(#[from] SimError),
    /// A result that cannot be written.
    #[error(transparent)]
    Outcome(Box<OutcomeError>),
    /// The features of a result.
    #[error(transparent)]
    Features(#[from] FeaturesFileError),
}

impl From<OutcomeError> for SweepError {
    fn from(error: OutcomeError) -> Self {
        Self::Outcome(error.into())
    }
}
