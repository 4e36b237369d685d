//! A line of the file of jobs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::SweepError;
use crate::scene::Scene;
use touchup_io::json_lines::JsonLines;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::{RecordingLayout, StampSource, Topics, TransformFrames};

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

/// Where in a recording the poses and wrenches are, as the flags of `touchup refine` name it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordedAs {
    /// `--pose-topic`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_topic: Option<String>,
    /// `--wrench-topic`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench_topic: Option<String>,
    /// `--markers-topic`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub markers_topic: Option<String>,
    /// `--pose-frame`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_frame: Option<String>,
    /// `--base-frame`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_frame: Option<String>,
    /// `--stamp`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp: Option<String>,
}

/// Topic of the transforms, where no other is named.
const TRANSFORMS: &str = "/tf";

impl RecordedAs {
    fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// With the columns of a table that the scene names.
    pub(super) fn layout(&self, scene: &Scene) -> RecordingLayout {
        let own = Topics::default();
        let pose = if self.pose_frame.is_some() { TRANSFORMS.to_owned() } else { own.pose };
        let topics = Topics {
            pose: self.pose_topic.clone().unwrap_or(pose),
            wrench: self.wrench_topic.clone().unwrap_or(own.wrench),
            markers: self.markers_topic.clone(),
        };
        let frames = self.pose_frame.clone().map(|moving| TransformFrames { moving, base: self.base_frame.clone() });
        RecordingLayout { topics, frames, columns: scene.table_columns() }
    }

    /// Which time of a message counts.
    ///
    /// # Errors
    /// Where it is no word for one.
    pub(super) fn stamps(&self) -> Result<StampSource, String> {
        match self.stamp.as_deref() {
            None | Some("header") => Ok(StampSource::Header),
            Some("log") => Ok(StampSource::Log),
            Some(other) => Err(format!("recorded.stamp is {other}; it must be header or log")),
        }
    }
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
        Ok(Self { lines: JsonLines::open(path)? })
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
        Err(SweepError::NoJob { path: path.to_owned(), job: wanted, count })
    }
}

impl Iterator for JobsFile {
    type Item = Result<Job, SweepError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.lines.next()?.map_err(SweepError::from))
    }
}
