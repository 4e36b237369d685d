//! Copies any readable recording to MCAP.

use std::path::Path;

use super::mcap_files::writer::not_written;
use super::{RecordingReader, RecordingWriter, Topics};
use crate::atomic::AtomicFile;
use crate::recording::error::RecordingError;
use crate::recording::record::Record;
use touchup_method::stylus::Message;

/// Frame of messages without one; the same for poses and wrenches, which then share their axes.
const UNNAMED: &str = "unnamed";

/// Summary of the copy.
#[derive(Debug, Default)]
pub struct CopiedRecording {
    /// poses, or frames of markers
    pub poses: u64,
    /// wrenches
    pub wrenches: u64,
    /// frame of the poses
    pub pose_frame: String,
    /// frame of the wrenches
    pub wrench_frame: String,
    /// damage of the recording; everything before it is in the copy
    pub damage: Option<RecordingError>,
}

/// Copies a recording to `path`, which is never half a file ([`AtomicFile`]).
///
/// - `topics`: topics of the copy.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// As [`super::write_recording`]; [`RecordingError::NotARecording`] without a usable pose or
/// wrench, and its damage if that comes before both.
pub fn copy_recording(
    reader: &mut RecordingReader,
    path: &Path,
    topics: &Topics,
    at_each: &mut dyn FnMut(),
) -> Result<CopiedRecording, RecordingError> {
    let file_error = |error: RecordingError| error.of_file(path);
    let mut file = AtomicFile::create(path).map_err(|error| not_written(path, error))?;
    let mut writer = RecordingWriter::new(&mut file, topics).map_err(file_error)?;
    let mut copied = CopiedRecording::default();
    while let Some(record) = reader.next_record() {
        let record = match record {
            Ok(record) => record,
            Err(damage) => {
                copied.damage = Some(damage);
                continue;
            }
        };
        let is_wrench = matches!(record, Record::Message(Message::Wrench(_)));
        let (count, frame) = match is_wrench {
            true => (&mut copied.wrenches, reader.wrench_frame()),
            false => (&mut copied.poses, reader.pose_frame()),
        };
        *count += 1;
        let frame = frame.filter(|frame| !frame.is_empty()).unwrap_or(UNNAMED);
        writer.write(record, frame).map_err(file_error)?;
        at_each();
    }
    writer.finish().map_err(file_error)?;
    if copied.poses == 0 || copied.wrenches == 0 {
        let what = if copied.poses == 0 { "pose" } else { "wrench" };
        return Err(copied.damage.unwrap_or_else(|| reader.without(what)));
    }
    file.commit().map_err(|error| not_written(path, error))?;
    let own = |frame: Option<&str>| frame.unwrap_or_default().to_owned();
    (copied.pose_frame, copied.wrench_frame) =
        (own(reader.pose_frame()), own(reader.wrench_frame()));
    Ok(copied)
}

impl RecordingReader {
    /// The error of a fully read recording that lacks a kind of record.
    fn without(&self, what: &str) -> RecordingError {
        let left_out = self
            .bad_messages()
            .iter()
            .map(|(reason, bad)| format!("{} {reason}", bad.poses + bad.wrenches));
        let left_out: Vec<_> = left_out.collect();
        let left_out = if left_out.is_empty() {
            String::new()
        } else {
            format!("; left out: {}", left_out.join(", "))
        };
        let reason = format!("no {what} in it can be used{left_out}");
        RecordingError::NotARecording {
            path: self.source_path().to_owned(),
            reason,
        }
    }
}
