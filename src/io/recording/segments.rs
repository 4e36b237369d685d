//! A recording that grows while somebody touches, and of which a crash takes only the last moment.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use super::{Kind, RecordingError, RecordingWriter, Topics};
use crate::io::atomic::write_atomically;
use crate::touch::Message;

/// Messages of one file: a quarter of an hour of a stylus, 60 MB.
const MOST_IN_A_SEGMENT: u64 = 1_000_000;

/// Writes poses and wrenches into files `touch_0000.mcap`, `touch_0001.mcap`, … of one folder, each of which is opened by
/// what opens MCAP. What was written before [`Self::flush`] is with the system after it, whatever becomes of the process.
/// [`Self::finish`] makes the folder a recording of rosbag2.
pub struct SegmentedWriter {
    folder: PathBuf,
    topics: Topics,
    current: Option<RecordingWriter<BufWriter<File>>>,
    segments: Vec<Segment>,
}

/// What `metadata.yaml` tells of one file.
#[derive(Clone, Debug)]
struct Segment {
    name: String,
    poses: u64,
    wrenches: u64,
    first_ns: i64,
    last_ns: i64,
}

impl SegmentedWriter {
    /// Nothing is written yet.
    ///
    /// - `folder`: is there and holds no segments.
    pub fn new(folder: &Path, topics: &Topics) -> Self {
        Self { folder: folder.to_owned(), topics: topics.clone(), current: None, segments: Vec::new() }
    }

    /// Appends a message whose header names `frame`.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn write(&mut self, message: &Message, frame: &str) -> Result<(), RecordingError> {
        if self.segments.last().is_none_or(|segment| segment.poses + segment.wrenches >= MOST_IN_A_SEGMENT) {
            self.begin_segment(message.stamp_ns())?;
        }
        let (Some(writer), Some(segment)) = (&mut self.current, self.segments.last_mut()) else { return Ok(()) };
        writer.write_in(message, frame)?;
        match message {
            Message::Pose(_) => segment.poses += 1,
            Message::Wrench(_) => segment.wrenches += 1,
        }
        segment.first_ns = segment.first_ns.min(message.stamp_ns());
        segment.last_ns = segment.last_ns.max(message.stamp_ns());
        Ok(())
    }

    fn begin_segment(&mut self, stamp_ns: i64) -> Result<(), RecordingError> {
        self.end_segment()?;
        let name = format!("touch_{:04}.mcap", self.segments.len());
        let path = self.folder.join(&name);
        let file = File::create_new(&path).map_err(|source| RecordingError::Io { path, source })?;
        // each message names its own frame
        self.current = Some(RecordingWriter::new(BufWriter::new(file), &self.topics, "", "")?);
        self.segments.push(Segment { name, poses: 0, wrenches: 0, first_ns: stamp_ns, last_ns: stamp_ns });
        Ok(())
    }

    fn end_segment(&mut self) -> Result<(), RecordingError> {
        let Some(writer) = self.current.take() else { return Ok(()) };
        let io = |source| RecordingError::Io { path: self.folder.clone(), source };
        let file = writer.finish()?.into_inner().map_err(|error| io(error.into_error()))?;
        file.sync_all().map_err(io)
    }

    /// Hands all that was written to the system.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.current.as_mut().map_or(Ok(()), RecordingWriter::flush)
    }

    /// Ends the last file and writes `metadata.yaml`; nothing when nothing was written.
    ///
    /// # Errors
    /// [`RecordingError::Write`], [`RecordingError::Io`].
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.end_segment()?;
        if self.segments.is_empty() {
            return Ok(());
        }
        let (path, text) = (self.folder.join("metadata.yaml"), self.metadata());
        write_atomically(&path, |out| out.write_all(text.as_bytes()))
            .map_err(|source| RecordingError::Io { path, source })
    }

    /// As rosbag2 writes it, version 5: every release reads that.
    fn metadata(&self) -> String {
        let all = &self.segments;
        let [poses, wrenches] =
            [|s: &Segment| s.poses, |s: &Segment| s.wrenches].map(|of| all.iter().map(of).sum::<u64>());
        let first_ns = all.iter().map(|segment| segment.first_ns).min().unwrap_or(0);
        let last_ns = all.iter().map(|segment| segment.last_ns).max().unwrap_or(0);
        let mut text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  \
             starting_time:\n    nanoseconds_since_epoch: {first_ns}\n  message_count: {}\n  topics_with_message_count:\n",
            last_ns - first_ns,
            poses + wrenches
        );
        // writing to a string cannot fail
        for (kind, count) in [(Kind::Pose, poses), (Kind::Wrench, wrenches)] {
            let (name, type_name) = (self.topics.name(kind), kind.type_name());
            let _ = write!(
                text,
                "    - topic_metadata:\n        name: {name:?}\n        type: {type_name}\n        serialization_format: \
                 cdr\n        offered_qos_profiles: \"\"\n      message_count: {count}\n"
            );
        }
        text.push_str("  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n");
        for segment in all {
            let _ = writeln!(text, "    - {}", segment.name);
        }
        text.push_str("  files:\n");
        for Segment { name, poses, wrenches, first_ns, last_ns } in all {
            let _ = write!(
                text,
                "    - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: {first_ns}\n      duration:\n        \
                 nanoseconds: {}\n      message_count: {}\n",
                last_ns - first_ns,
                poses + wrenches
            );
        }
        text
    }
}

/// The segments of a folder that has no `metadata.yaml`, as a crash leaves it, in their order; one in which nothing stands
/// is left out.
pub(super) fn segments_of(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        let is_segment = path.extension().is_some_and(|ending| ending == "mcap");
        if is_segment && path.metadata()?.len() > super::mcap::MAGIC.len() as u64 {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
