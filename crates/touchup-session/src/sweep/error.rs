//! Errors of a sweep.

use std::path::PathBuf;

use crate::scene::SceneError;
use crate::session::OutcomeError;
use touchup_io::features_file::FeaturesFileError;
use touchup_io::file_error::FileError;
use touchup_io::json_lines::JsonLineError;
use touchup_sim::SimError;

/// Error of planning a sweep or running a job.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The grid file.
    #[error("{}: {why}", path.display())]
    Grid {
        /// the file
        path: PathBuf,
        /// fault, with its line if known
        why: String,
    },
    /// The base scene of all jobs.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// More jobs than a plan may have.
    #[error(
        "{}: {jobs} jobs are too many: at most {most}; take fewer values, or sampling: {{ sobol: {{ samples: 64 }} }}", path.display()
    )]
    TooMany {
        /// the file
        path: PathBuf,
        /// number of jobs, or a text for an overflow
        jobs: String,
        /// the limit
        most: u64,
    },
    /// An unreadable or unwritable file.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line of the file of jobs.
    #[error(transparent)]
    Line(#[from] JsonLineError),
    /// No such job.
    #[error("{} has no job {job}: it has {count}, from 0 on", path.display())]
    NoJob {
        /// the file of the jobs
        path: PathBuf,
        /// number of the job
        job: u64,
        /// number of jobs
        count: u64,
    },
    /// A file has changed since the plan.
    #[error(
        "{what} is not what was planned: sha256 is {found}, and {planned} in the plan; bring the file back, or plan again (touchup sweep plan)"
    )]
    Changed {
        /// the file
        what: String,
        /// hash of the present content
        found: String,
        /// hash in the plan
        planned: String,
    },
    /// Another touchup made the plan.
    #[error(
        "job {job} was planned by touchup {planned}, and this is {own}: plan again, or run it by the same version"
    )]
    OtherVersion {
        /// number of the job
        job: u64,
        /// version of the plan
        planned: String,
        /// version that runs
        own: &'static str,
    },
    /// A line edited by hand.
    #[error(
        "job {job} is not the one that its id names: plan again (touchup sweep plan), and leave the lines as they are"
    )]
    OtherJob {
        /// number of the job
        job: u64,
    },
    /// A folder or file that no job wrote.
    #[error("{} is no result of a job: {why}", path.display())]
    NoResult {
        /// the folder or file
        path: PathBuf,
        /// the missing part
        why: String,
    },
    /// A result changed since its job wrote it.
    #[error(
        "job {job}: {} is damaged: {why}; run it anew by touchup sweep run --job {job} --again", result.display()
    )]
    Damaged {
        /// number of the job
        job: u64,
        /// folder of the result
        result: PathBuf,
        /// the file and its fault
        why: String,
    },
    /// A simulated scan or touch.
    #[error(transparent)]
    Simulated(#[from] SimError),
    /// An unwritable result.
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
