//! Runs one job from its line to its folder.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::base_scene::{BaseScene, JobScene};
use super::error::SweepError;
use super::job::{Job, JobsFile};
use super::record::{JobRecord, RECORD, read_record};
use super::summary::JobSummary;
use crate::refinement::{
    InputNames, OpenedInput, RefinedScan, RefinementError, RefinementOptions, refine,
};
use crate::session::{OutcomeError, ResultFiles};
use touchup_io::content_hash::{content_hash, hash_of};
use touchup_io::features_file::read_features;
use touchup_io::file_error::FileError;
use touchup_io::machine::VERSION;
use touchup_io::result_folder::{Claim, ClaimedFolder, FileBeside, claim};
use touchup_io::text_file::{read_text, write_text};

pub(super) const SUMMARY: &str = "summary.json";
pub(super) const FAILED: &str = "failed.json";
/// Hashes of the other files, for `sha256sum --check`.
const SUMS: &str = "SHA256SUMS";

/// Content of files that a process already holds, in place of reading them.
#[derive(Clone, Copy, Debug, Default)]
pub struct GivenInput<'a> {
    /// content of the scan's file
    pub scan: Option<&'a [u8]>,
    /// content of the recording's file
    pub recording: Option<&'a [u8]>,
}

/// State of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobReport {
    /// number of the job
    pub job: u64,
    /// id of the job
    pub id: String,
    /// folder of its result
    pub result: PathBuf,
    /// whether the result existed before
    pub was_there: bool,
    /// reason of a failure
    pub failed: Option<String>,
    /// summary.json; null after a failure
    pub summary: Value,
}

/// Runs jobs of one plan into one folder.
#[derive(Debug)]
pub struct JobRunner {
    folder: PathBuf,
    results: PathBuf,
    hashes: RefCell<BTreeMap<PathBuf, String>>,
}

/// A readable input file of a job.
struct InputFile {
    path: PathBuf,
    /// removes a file made of given bytes
    _given: Option<FileBeside>,
}

impl JobRunner {
    /// - `jobs`: the file of jobs.
    /// - `results`: parent of the result folders, each named by its id; created if missing.
    pub fn new(jobs: &Path, results: Option<PathBuf>) -> Self {
        Self {
            folder: JobsFile::folder(jobs),
            results: JobsFile::results(jobs, results),
            hashes: RefCell::default(),
        }
    }

    /// Runs a job; returns at once if its result exists. A refinement that fails by its input is a
    /// result as well.
    ///
    /// - `again`: whether to replace an existing result.
    /// - `at_each`: called after each record, to show the progress.
    ///
    /// # Errors
    /// [`SweepError`] if the job cannot run or its result cannot be written: then there is none.
    pub fn run(
        &self,
        job: &Job,
        given: GivenInput<'_>,
        again: bool,
        at_each: &mut dyn FnMut(),
    ) -> Result<JobReport, SweepError> {
        if job.touchup != VERSION {
            return Err(SweepError::OtherVersion {
                job: job.job,
                planned: job.touchup.clone(),
                own: VERSION,
            });
        }
        if !is_id(&job.id) {
            return Err(SweepError::OtherJob { job: job.job });
        }
        let claimed = match claim(&self.results, &job.id, again)? {
            Claim::Done(result) => return report(job, result, true),
            Claim::Ours(claimed) => claimed,
        };
        let scan = self.input(
            "the scan",
            (&job.scan, &job.scan_sha256),
            given.scan,
            &claimed,
        )?;
        let recording = self.input(
            "the recording",
            (&job.recording, &job.recording_sha256),
            given.recording,
            &claimed,
        )?;
        let (scene, record) = self.scene(job)?;
        write_json(&claimed.path().join(RECORD), &record)?;
        let plain = |message: &str| {
            let mut named = [(&scan.path, "the scan"), (&recording.path, "the recording")];
            // a path may be a prefix of the other
            named.sort_by_key(|(path, _)| std::cmp::Reverse(path.as_os_str().len()));
            named.iter().fold(message.to_owned(), |text, (path, name)| {
                text.replace(&*path.to_string_lossy(), name)
            })
        };
        match refined(
            job,
            &scan.path,
            &recording.path,
            scene,
            &claimed,
            &plain,
            at_each,
        ) {
            Ok(summary) => write_json(&claimed.path().join(SUMMARY), &summary)?,
            Err(JobFailure::OfInput(why)) => {
                write_json(
                    &claimed.path().join(FAILED),
                    &serde_json::json!({ "error": plain(&why) }),
                )?;
            }
            Err(JobFailure::OfSystem(error)) => return Err(error),
        }
        let sums = sums_of(claimed.path())?.concat();
        write_text(&claimed.path().join(SUMS), &sums)?;
        report(job, claimed.publish(again)?, false)
    }

    /// An input file of a job with the planned content.
    fn input(
        &self,
        what: &str,
        (path, planned): (&Path, &str),
        given: Option<&[u8]>,
        claimed: &ClaimedFolder,
    ) -> Result<InputFile, SweepError> {
        let path = self.folder.join(path);
        let found = match given {
            Some(bytes) => hash_of(bytes),
            None => self.hash(&path)?,
        };
        if found != planned {
            let what = format!("{what} {}", path.display());
            return Err(SweepError::Changed {
                what,
                found,
                planned: planned.to_owned(),
            });
        }
        let Some(bytes) = given else {
            return Ok(InputFile { path, _given: None });
        };
        let file = claimed.file_beside(&path, bytes)?;
        Ok(InputFile {
            path: file.path().to_owned(),
            _given: Some(file),
        })
    }

    /// Hash of a file, read once for all jobs.
    fn hash(&self, path: &Path) -> Result<String, SweepError> {
        if let Some(known) = self.hashes.borrow().get(path) {
            return Ok(known.clone());
        }
        let hash = content_hash(path)?;
        self.hashes
            .borrow_mut()
            .insert(path.to_owned(), hash.clone());
        Ok(hash)
    }

    /// The scene with the keys of the job, and the dependencies of its result.
    fn scene(&self, job: &Job) -> Result<(JobScene, JobRecord), SweepError> {
        let text = match &job.scene {
            Some(path) => {
                let path = self.folder.join(path);
                let text = read_text(&path)?;
                let (found, planned) = (
                    hash_of(text.as_bytes()),
                    job.scene_sha256.clone().unwrap_or_default(),
                );
                if found != planned {
                    let what = format!("the scene {}", path.display());
                    return Err(SweepError::Changed {
                        what,
                        found,
                        planned,
                    });
                }
                text
            }
            None => String::new(),
        };
        let other = SweepError::OtherJob { job: job.job };
        let Ok(scene) = BaseScene::of(&text)?.with(&job.keys) else {
            return Err(other);
        };
        let Job {
            scan_sha256,
            mesh_unit,
            recording_sha256,
            recorded,
            ..
        } = job;
        let record = JobRecord::new(
            scan_sha256,
            *mesh_unit,
            recording_sha256,
            recorded,
            scene.whole.clone(),
        );
        if record.id == job.id {
            Ok((scene, record))
        } else {
            Err(other)
        }
    }
}

/// Whether the text is an id, which names a folder.
fn is_id(id: &str) -> bool {
    id.len() == 32 && id.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// Cause of a missing mesh.
enum JobFailure {
    /// the input, on any machine
    OfInput(String),
    /// the system, possibly not at another try
    OfSystem(SweepError),
}

impl From<RefinementError> for JobFailure {
    fn from(error: RefinementError) -> Self {
        match error {
            RefinementError::Outcome(error) => match *error {
                OutcomeError::Unchanged
                | OutcomeError::Contradictory(_)
                | OutcomeError::Mesh(_) => Self::OfInput(error.to_string()),
                error => Self::OfSystem(error.into()),
            },
            error => Self::OfInput(error.to_string()),
        }
    }
}

fn refined(
    job: &Job,
    scan: &Path,
    recording: &Path,
    JobScene { scene, .. }: JobScene,
    claimed: &ClaimedFolder,
    plain: &dyn Fn(&str) -> String,
    at_each: &mut dyn FnMut(),
) -> Result<JobSummary, JobFailure> {
    let opened = OpenedInput::open(scene, (scan, job.mesh_unit), (recording, &job.recorded))?;
    let RefinedScan {
        mesh: refined,
        summary,
        losses,
    } = refine(
        opened.input,
        opened.recording,
        opened.markers,
        RefinementOptions::default(),
        InputNames { scan, recording },
        at_each,
    )?;
    let features = claimed.path().join(ResultFiles::FEATURES);
    let files = ResultFiles {
        mesh: claimed.path().join(ResultFiles::MESH),
        features: Some(features.clone()),
        touches: None,
        step: None,
    };
    files
        .write(refined, scan, job.mesh_unit)
        .map_err(|error| JobFailure::OfSystem(error.into()))?;
    let count = read_features(&features)
        .map_err(|error| JobFailure::OfSystem(error.into()))?
        .features
        .len();
    Ok(JobSummary::of(summary, &losses, count, plain))
}

fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), SweepError> {
    // finite numbers and names alone cannot fail
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    Ok(write_text(path, &(text + "\n"))?)
}

/// State of a job from the folder of its result.
fn report(job: &Job, result: PathBuf, was_there: bool) -> Result<JobReport, SweepError> {
    let JobOutcome { failed, summary } = JobOutcome::of_job(job, &result)?;
    Ok(JobReport {
        job: job.job,
        id: job.id.clone(),
        result,
        was_there,
        failed,
        summary,
    })
}

/// A line for each file of a result with its hash.
fn sums_of(result: &Path) -> Result<Vec<String>, FileError> {
    let names: &[&str] = match result.join(FAILED).exists() {
        true => &[FAILED, RECORD],
        false => &[ResultFiles::FEATURES, RECORD, ResultFiles::MESH, SUMMARY],
    };
    let line = |name: &&str| Ok(format!("{}  {name}\n", content_hash(&result.join(name))?));
    names.iter().map(line).collect()
}

/// Summary or failure of a job.
pub(super) struct JobOutcome {
    pub failed: Option<String>,
    pub summary: Value,
}

impl JobOutcome {
    /// Files of a job, whose folder may have changed.
    ///
    /// # Errors
    /// [`SweepError::Damaged`]
    pub fn of_job(job: &Job, result: &Path) -> Result<Self, SweepError> {
        let damaged = |why: String| SweepError::Damaged {
            job: job.job,
            result: result.to_owned(),
            why,
        };
        let files = Self::read(result).map_err(|error| damaged(error.to_string()))?;
        let record = read_record(result).map_err(|error| damaged(error.to_string()))?;
        if record.id != job.id {
            return Err(damaged(format!("{RECORD} is that of job {}", record.id)));
        }
        Ok(files)
    }

    /// # Errors
    /// [`SweepError::NoResult`] for a missing or changed file.
    pub fn read(result: &Path) -> Result<Self, SweepError> {
        let no_result = |why: String| SweepError::NoResult {
            path: result.to_owned(),
            why,
        };
        let sums = read_text(&result.join(SUMS)).map_err(|error| no_result(error.to_string()))?;
        let found = sums_of(result).map_err(|error| no_result(error.to_string()))?;
        let changed = |line: &&String| sums.split_inclusive('\n').all(|written| written != **line);
        if let Some(changed) = found.iter().find(changed) {
            let name = changed.trim_end().rsplit(' ').next().unwrap_or_default();
            return Err(no_result(format!("{name} is not as it was written")));
        }
        let read = |name: &str| {
            let path = result.join(name);
            let refused = |why: String| SweepError::NoResult {
                path: path.clone(),
                why,
            };
            let text = read_text(&path).map_err(|error| refused(error.to_string()))?;
            serde_json::from_str::<Value>(&text).map_err(|error| refused(error.to_string()))
        };
        if result.join(FAILED).exists() {
            let failed = read(FAILED)?;
            let why = failed
                .get("error")
                .and_then(Value::as_str)
                .unwrap_or("it does not say why");
            return Ok(Self {
                failed: Some(why.to_owned()),
                summary: Value::Null,
            });
        }
        Ok(Self {
            failed: None,
            summary: read(SUMMARY)?,
        })
    }
}
