//! All dependencies of a result: `job.json` in its folder, whose hash is the id.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::SweepError;
use crate::replay::RecordedAs;
use touchup_io::content_hash::hash_of;
use touchup_io::machine::VERSION;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::text_file::read_text;

/// Hexadecimal digits of an id: 128 bits.
const DIGITS: usize = 32;

/// Content of a job, without paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// hash of the other fields
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub id: String,
    /// version of touchup
    pub touchup: String,
    /// hash of the scan
    pub scan_sha256: String,
    /// unit of its coordinates
    pub mesh_unit: MeshUnit,
    /// hash of the recording
    pub recording_sha256: String,
    /// named location of its poses and wrenches
    pub recorded: RecordedAs,
    /// every active key with its value
    pub scene: Value,
}

impl JobRecord {
    /// - `scene`: whole, with sorted keys.
    pub(super) fn new(
        scan_sha256: &str,
        mesh_unit: MeshUnit,
        recording_sha256: &str,
        recorded: &RecordedAs,
        scene: Value,
    ) -> Self {
        let mut record = Self {
            id: String::new(),
            touchup: VERSION.to_owned(),
            scan_sha256: scan_sha256.to_owned(),
            mesh_unit,
            recording_sha256: recording_sha256.to_owned(),
            recorded: recorded.clone(),
            scene,
        };
        // texts and numbers alone cannot fail
        let text = serde_json::to_string(&record).unwrap_or_default();
        record.id = hash_of(text.as_bytes()).chars().take(DIGITS).collect();
        record
    }
}

/// Name of the file in the folder of a result.
pub(super) const RECORD: &str = "job.json";

/// The dependencies of the result in a folder.
///
/// # Errors
/// [`SweepError::NoResult`]
pub fn read_record(result: &Path) -> Result<JobRecord, SweepError> {
    let path = result.join(RECORD);
    let refused = |why: String| SweepError::NoResult {
        path: path.clone(),
        why,
    };
    let text = read_text(&path).map_err(|error| refused(error.to_string()))?;
    serde_json::from_str(&text).map_err(|error| refused(error.to_string()))
}
