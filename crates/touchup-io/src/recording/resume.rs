//! Replacement of a recording, and its continuation, also after a crash.

use std::fs::{create_dir_all, remove_file};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::mcap_files::writer::not_written;
use super::segments::{FileSegment, METADATA};
use crate::recording::error::RecordingError;
use crate::recording::{RecordingReader, SegmentedWriter, Topics, write_recording};
use touchup_method::stylus::Message;

impl SegmentedWriter {
    /// Begins a recording in a folder, which is made if missing, in place of an older one.
    ///
    /// # Errors
    /// [`RecordingError::NotWritten`].
    pub fn replace(folder: &Path, topics: &Topics) -> Result<Self, RecordingError> {
        let refused = |error| not_written(folder, error);
        create_dir_all(folder).map_err(refused)?;
        remove(&folder.join(METADATA)).map_err(refused)?;
        for path in segment_paths(folder) {
            remove(&path).map_err(refused)?;
        }
        Ok(Self::new(folder, topics))
    }

    /// Continues the recording in a folder.
    ///
    /// A segment without its end after a crash is rewritten as far as it is readable; an unreadable
    /// last one is removed.
    ///
    /// - `frames`: of the poses, and of the wrenches.
    /// - `each`: receives the existing messages, in their order.
    ///
    /// # Errors
    /// [`RecordingError`]
    pub fn resume(
        folder: &Path,
        topics: &Topics,
        frames: [&str; 2],
        each: &mut dyn FnMut(&Message),
    ) -> Result<Self, RecordingError> {
        let refused = |error| not_written(folder, error);
        create_dir_all(folder).map_err(refused)?;
        remove(&folder.join(METADATA)).map_err(refused)?;
        let mut writer = Self::new(folder, topics);
        let paths = segment_paths(folder);
        for path in &paths {
            let (messages, is_whole) = read_segment(path, topics)?;
            let Some(first) = messages.first() else {
                if writer.segments.len() + 1 < paths.len() {
                    let reason =
                        "nothing of it can be read, and other segments follow: go on in another folder".to_owned();
                    return Err(RecordingError::NotARecording {
                        path: path.clone(),
                        reason,
                    });
                }
                remove(path).map_err(refused)?;
                break;
            };
            let mut segment = FileSegment::begin(writer.segments.len(), first.stamp_ns());
            for message in &messages {
                segment.count(message);
                each(message);
            }
            if !is_whole {
                write_recording(path, topics, frames[0], frames[1], messages)?;
            }
            segment.is_whole = true;
            writer.segments.push(segment);
        }
        Ok(writer)
    }
}

/// The files of the segments, whose numbers have no gap.
fn segment_paths(folder: &Path) -> Vec<PathBuf> {
    (0..)
        .map(|number| folder.join(FileSegment::name_of(number)))
        .take_while(|path| path.exists())
        .collect()
}

/// The messages of a segment up to its damage, and whether it has its end.
fn read_segment(path: &Path, topics: &Topics) -> Result<(Vec<Message>, bool), RecordingError> {
    let mut reader = match RecordingReader::open(path, topics) {
        Ok(reader) => reader,
        // it ends before its first message
        Err(
            RecordingError::Damaged { .. }
            | RecordingError::MissingTopic { .. }
            | RecordingError::NotARecording { .. },
        ) => {
            return Ok((Vec::new(), false));
        }
        Err(error) => return Err(error),
    };
    let mut messages = Vec::new();
    let mut is_whole = true;
    for message in reader.by_ref() {
        match message {
            Ok(message) => messages.push(message),
            Err(RecordingError::Damaged { .. }) => is_whole = false,
            Err(error) => return Err(error),
        }
    }
    Ok((messages, is_whole && !reader.truncated()))
}

fn remove(path: &Path) -> io::Result<()> {
    match remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
