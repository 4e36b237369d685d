//! A line of the file of jobs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::SweepError;
use crate::replay::RecordedAs;
use touchup_io::json_lines::JsonLines;
use touchup_io::mesh_file::MeshUnit;

/// One refinement of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// number in the plan, from 0
    pub job: u64,
    /// name of the result: hash of the content of scan and recording, the whole scene, and the
    /// version
    pub id: String,
    /// version of the planner
    pub touchup: String,
    /// relative to the folder of the plan
    pub scan: PathBuf,
    /// hash of the scan
    pub scan_sha256: String,
    /// unit of the coordinates in the scan's file
    pub mesh_unit: MeshUnit,
    /// relative to the folder of the plan
    pub recording: PathBuf,
    /// hash of the recording
    pub recording_sha256: String,
    /// named location of poses and wrenches in the recording
    #[serde(default, skip_serializing_if = "RecordedAs::is_usual")]
    pub recorded: RecordedAs,
    /// base scene of the keys, relative to the folder of the plan
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<PathBuf>,
    /// hash of the scene
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_sha256: Option<String>,
    /// seed of a simulated scan and touch
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// values by path in the scene
    pub keys: BTreeMap<String, Value>,
}

/// Iterator over the jobs of a file, in order.
#[derive(Debug)]
pub struct JobsFile {
    lines: JsonLines<Job>,
}

impl JobsFile {
    /// # Errors
    /// [`SweepError::File`]
    pub fn open(path: &Path) -> Result<Self, SweepError> {
        Ok(Self {
            lines: JsonLines::open(path)?,
        })
    }

    /// The base folder of its paths.
    pub fn folder(path: &Path) -> PathBuf {
        path.parent().unwrap_or(Path::new("")).to_owned()
    }

    /// The folder of the results: as named, or `results` beside the file.
    pub fn results(path: &Path, named: Option<PathBuf>) -> PathBuf {
        named.unwrap_or_else(|| Self::folder(path).join("results"))
    }

    /// One job.
    ///
    /// # Errors
    /// [`SweepError::NoJob`], [`SweepError::Line`].
    pub fn job(path: &Path, wanted: u64) -> Result<Job, SweepError> {
        let mut count = 0;
        for job in Self::open(path)? {
            let job = job?;
            if job.job == wanted {
                return Ok(job);
            }
            count += 1;
        }
        Err(SweepError::NoJob {
            path: path.to_owned(),
            job: wanted,
            count,
        })
    }
}

impl Iterator for JobsFile {
    type Item = Result<Job, SweepError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.lines.next()?.map_err(SweepError::from))
    }
}
