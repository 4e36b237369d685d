//! All that a result depends on: `job.json` in its folder, of which the id is the hash.

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

/// What a job is made of, without paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// hash of the rest
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub id: String,
    /// version
    pub touchup: String,
    /// of the content of the scan
    pub scan_sha256: String,
    /// of its coordinates
    pub mesh_unit: MeshUnit,
    /// of the content of the recording
    pub recording_sha256: String,
    /// where in it the poses and wrenches are, as far as it is named
    pub recorded: RecordedAs,
    /// every key that is built with its value
    pub scene: Value,
}

impl JobRecord {
    /// - `scene`: whole, its keys in order.
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

/// What the result in a folder depends on.
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
