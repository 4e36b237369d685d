//! The files of a recording: a single one, or a rosbag2 folder.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::RecordingError;
use super::segments::{METADATA, segments_of};

/// Longest `metadata.yaml`: thousands of files and topics.
const MAX_METADATA_BYTES: u64 = 16 << 20;

/// Whether a file of this name makes a folder look like a recording of rosbag2.
pub(crate) fn is_of_recording(name: &str) -> bool {
    name == METADATA
        || Path::new(name)
            .extension()
            .is_some_and(|ending| ending == "mcap")
}

/// The files of a rosbag2 folder, each in the folder itself and none a link; `None` for other
/// folders, or for files outside.
pub(crate) fn own_files(folder: &Path) -> Option<Vec<PathBuf>> {
    let is_plain = |path: &Path| fs::symlink_metadata(path).is_ok_and(|about| about.is_file());
    let metadata = folder.join(METADATA);
    if fs::symlink_metadata(&metadata).is_ok() && !is_plain(&metadata) {
        return None;
    }
    let files = files_of(folder).ok()?;
    let is_own = |file: &PathBuf| file.parent() == Some(folder) && is_plain(file);
    files.iter().all(is_own).then(|| files.into())
}

/// Used part of rosbag2's `metadata.yaml`.
#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: BagInformation,
}

#[derive(Deserialize)]
struct BagInformation {
    relative_file_paths: Vec<String>,
}

/// The files of a recording, in order.
pub(super) fn files_of(path: &Path) -> Result<VecDeque<PathBuf>, RecordingError> {
    if !path.is_dir() {
        return Ok(VecDeque::from([path.to_owned()]));
    }
    let metadata_path = path.join(METADATA);
    if !metadata_path.exists() {
        // a killed recorder writes none
        let segments = segments_of(path).map_err(|source| RecordingError::Io {
            path: path.to_owned(),
            source,
        })?;
        if !segments.is_empty() {
            return Ok(segments.into());
        }
        let reason = "the folder has no metadata.yaml and no .mcap file with anything in it: nothing was recorded, or it is elsewhere";
        return Err(RecordingError::NotARecording {
            path: path.to_owned(),
            reason: reason.to_owned(),
        });
    }
    let bad = |reason: String| RecordingError::Metadata {
        path: metadata_path.clone(),
        reason,
    };
    let text = read_metadata(&metadata_path).map_err(|error| bad(error.to_string()))?;
    let metadata: Metadata =
        serde_saphyr::from_str(&text).map_err(|error| bad(error.to_string()))?;
    let names = metadata.rosbag2_bagfile_information.relative_file_paths;
    if names.is_empty() {
        return Err(bad("it names no files".to_owned()));
    }
    let files = names
        .iter()
        .map(|name| find_file(path, name).ok_or_else(|| bad(format!("{name:?} is not there"))))
        .collect::<Result<VecDeque<_>, _>>()?;
    if let Some(name) = not_named(path, &files).map_err(|error| bad(error.to_string()))? {
        return Err(bad(format!(
            "{name:?} lies beside the files that it names: add it to relative_file_paths, in its turn, or move it elsewhere"
        )));
    }
    Ok(files)
}

/// A recording in a folder that is none of its listed files, nor one of them unpacked.
fn not_named(folder: &Path, files: &VecDeque<PathBuf>) -> io::Result<Option<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let packed = entry.file_name().to_string_lossy().into_owned() + PACKED;
        let is_named = [entry.path(), folder.join(&packed)]
            .iter()
            .any(|path| files.contains(path));
        let name = &packed[..packed.len() - PACKED.len()];
        let plain = name.strip_suffix(PACKED).unwrap_or(name);
        let is_recording = plain.ends_with(".mcap") || plain.ends_with(".db3");
        // a killed recorder leaves empty ones
        if is_recording && !is_named && entry.metadata()?.len() > 0 {
            names.push(name.to_owned());
        }
    }
    Ok(names.into_iter().min())
}

/// Ending of a compressed file, behind its own.
const PACKED: &str = ".zstd";

fn read_metadata(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    File::open(path)?
        .take(MAX_METADATA_BYTES)
        .read_to_string(&mut text)?;
    Ok(text)
}

/// A file named in the metadata; early versions of rosbag2 put the folder's own name in front.
fn find_file(folder: &Path, name: &str) -> Option<PathBuf> {
    let in_folder = folder.join(name);
    let by_last_part = folder.join(Path::new(name).file_name()?);
    [in_folder, by_last_part]
        .into_iter()
        .find(|path| fs::metadata(path).is_ok_and(|file| file.is_file()))
}
