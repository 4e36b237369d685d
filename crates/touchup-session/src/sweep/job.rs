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
    /// its number in the plan, from 0 on
    pub job: u64,
    /// names its result: of the content of scan and recording, the whole scene, and the version
    pub id: String,
    /// version that planned it
    pub touchup: String,
    /// relative to the folder of the plan
    pub scan: PathBuf,
    /// of its content
    pub scan_sha256: String,
    /// of the coordinates in the scan's file
    pub mesh_unit: MeshUnit,
    /// relative to the folder of the plan
    pub recording: PathBuf,
    /// of its content
    pub recording_sha256: String,
    /// where in the recording the poses and wrenches are, as far as it is named
    #[serde(default, skip_serializing_if = "RecordedAs::is_usual")]
    pub recorded: RecordedAs,
    /// the scene that the keys are set in, relative to the folder of the plan
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<PathBuf>,
    /// of its content
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene_sha256: Option<String>,
    /// of a simulated scan and touch
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// by path in the scene
    pub keys: BTreeMap<String, Value>,
}

/// The jobs of a file, in its order, read one at a time.
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

    /// The folder that its paths are relative to.
    pub fn folder(path: &Path) -> PathBuf {
        path.parent().unwrap_or(Path::new("")).to_owned()
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
