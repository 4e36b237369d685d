//! A growing recording that loses only the last moment in a crash.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use super::mcap_files::writer::not_written;
use crate::atomic::write_atomically;
use crate::recording::error::RecordingError;
use crate::recording::layout::TopicKind;
use crate::recording::{RecordingWriter, Topics};
use touchup_method::stylus::Message;

/// Names the files of a completed recording.
pub(super) const METADATA: &str = "metadata.yaml";

/// Messages of one file: a quarter of an hour of a stylus, 60 MB.
const MOST_IN_A_SEGMENT: u64 = 1_000_000;

/// Writes poses and wrenches into files `touch_0000.mcap`, `touch_0001.mcap`, … of one folder, each
/// readable as MCAP. After [`Self::flush`] all messages before it are with the system, whatever
/// becomes of the process. [`Self::finish`] makes the folder a recording of rosbag2.
pub struct SegmentedWriter {
    folder: PathBuf,
    topics: Topics,
    current: Option<RecordingWriter<BufWriter<File>>>,
    pub(super) segments: Vec<FileSegment>,
    /// messages since the last [`Self::flush`]
    unflushed: u64,
    /// length of the file after the last flush, bytes
    flushed_length: u64,
}

/// Entry of one file in `metadata.yaml`.
#[derive(Clone, Debug)]
pub(super) struct FileSegment {
    name: String,
    /// poses and wrenches
    counts: [u64; 2],
    first_ns: i64,
    last_ns: i64,
    /// it has its index, and a proper end
    pub is_whole: bool,
}

impl FileSegment {
    /// The name of the file with a number, from 0 on.
    pub fn name_of(number: usize) -> String {
        format!("touch_{number:04}.mcap")
    }

    /// - `stamp_ns`: of the first message.
    pub fn begin(number: usize, stamp_ns: i64) -> Self {
        let (first_ns, last_ns) = (stamp_ns, stamp_ns);
        Self {
            name: Self::name_of(number),
            counts: [0; 2],
            first_ns,
            last_ns,
            is_whole: false,
        }
    }

    pub fn count(&mut self, message: &Message) {
        self.counts[usize::from(matches!(message, Message::Wrench(_)))] += 1;
        self.first_ns = self.first_ns.min(message.stamp_ns());
        self.last_ns = self.last_ns.max(message.stamp_ns());
    }
}

impl SegmentedWriter {
    /// An empty recording.
    ///
    /// - `folder`: exists, without segments.
    pub fn new(folder: &Path, topics: &Topics) -> Self {
        let (folder, topics) = (folder.to_owned(), topics.clone());
        Self {
            folder,
            topics,
            current: None,
            segments: Vec::new(),
            unflushed: 0,
            flushed_length: 0,
        }
    }

    /// Appends a message whose header names `frame`.
    ///
    /// # Errors
    /// As [`RecordingWriter::write`].
    pub fn write(&mut self, message: &Message, frame: &str) -> Result<(), RecordingError> {
        let is_full =
            |segment: &FileSegment| segment.counts.iter().sum::<u64>() >= MOST_IN_A_SEGMENT;
        if self.current.is_none() || self.segments.last().is_none_or(is_full) {
            self.begin_segment(message.stamp_ns())?;
        }
        let (Some(writer), Some(segment)) = (&mut self.current, self.segments.last_mut()) else {
            return Ok(());
        };
        writer.write(*message, frame)?;
        self.unflushed += 1;
        segment.count(message);
        Ok(())
    }

    fn begin_segment(&mut self, stamp_ns: i64) -> Result<(), RecordingError> {
        self.end_segment()?;
        let segment = FileSegment::begin(self.segments.len(), stamp_ns);
        let path = self.folder.join(&segment.name);
        let file = File::create_new(&path).map_err(|error| not_written(&path, error))?;
        let begun = RecordingWriter::new(BufWriter::new(file), &self.topics);
        // a full disk takes a file and not its first bytes: an empty one would block the next for
        // ever
        self.current = Some(begun.inspect_err(|_| drop(std::fs::remove_file(&path)))?);
        self.segments.push(segment);
        Ok(())
    }

    fn end_segment(&mut self) -> Result<(), RecordingError> {
        self.flush()?;
        let (Some(writer), Some(segment)) = (self.current.take(), self.segments.last_mut()) else {
            return Ok(());
        };
        self.flushed_length = 0;
        let refused = |error| not_written(&self.folder, error);
        let file = writer
            .finish()?
            .into_inner()
            .map_err(|error| refused(error.into_error()))?;
        file.sync_all().map_err(refused)?;
        segment.is_whole = true;
        Ok(())
    }

    /// Flushes to the operating system; returns the number of flushed messages.
    ///
    /// # Errors
    /// [`RecordingError::Write`], [`RecordingError::NotWritten`].
    pub fn flush(&mut self) -> Result<u64, RecordingError> {
        let (Some(writer), Some(segment)) = (&mut self.current, self.segments.last()) else {
            return Ok(0);
        };
        if self.unflushed == 0 {
            return Ok(0);
        }
        writer.flush()?;
        let path = self.folder.join(&segment.name);
        self.flushed_length = path
            .metadata()
            .map_err(|error| not_written(&path, error))?
            .len();
        Ok(std::mem::take(&mut self.unflushed))
    }

    /// Syncs everything to the disk, to survive a failure of the machine.
    ///
    /// # Errors
    /// As [`Self::flush`].
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        if self.flush()? == 0 {
            return Ok(());
        }
        let Some(segment) = self.segments.last() else {
            return Ok(());
        };
        let path = self.folder.join(&segment.name);
        let synced = File::options()
            .append(true)
            .open(&path)
            .and_then(|file| file.sync_data());
        synced.map_err(|error| not_written(&path, error))
    }

    /// After an error: cuts the file to its flushed part, or removes an unflushed one. The next
    /// message begins another file. Returns the number of lost messages.
    pub fn give_up_segment(&mut self) -> u64 {
        // without a current segment earlier ones stay
        let Some(writer) = self.current.take() else {
            return 0;
        };
        // tries once more to write its buffer
        drop(writer);
        let Some(segment) = self.segments.pop() else {
            return 0;
        };
        let path = self.folder.join(&segment.name);
        let flushed = std::mem::take(&mut self.flushed_length);
        // if that fails too, a reader skips the file's end
        let _ = match flushed {
            0 => std::fs::remove_file(path),
            _ => File::options()
                .write(true)
                .open(path)
                .and_then(|file| file.set_len(flushed)),
        };
        if flushed > 0 {
            self.segments.push(segment);
        }
        std::mem::take(&mut self.unflushed)
    }

    /// Ends the last file and writes `metadata.yaml`; nothing for an empty recording. A recording
    /// with a file without a proper end gets none: touchup reads its files, as after a crash.
    ///
    /// # Errors
    /// [`RecordingError::Write`], [`RecordingError::NotWritten`].
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.end_segment()?;
        if self.segments.is_empty() || !self.segments.iter().all(|segment| segment.is_whole) {
            return Ok(());
        }
        let (path, text) = (self.folder.join(METADATA), self.metadata());
        write_atomically(&path, |out| out.write_all(text.as_bytes()))
            .map_err(|error| not_written(&path, error))
    }

    /// In the form of rosbag2, version 5, which every release reads.
    fn metadata(&self) -> String {
        let all = &self.segments;
        let [poses, wrenches] =
            [0, 1].map(|at| all.iter().map(|segment| segment.counts[at]).sum::<u64>());
        let first_ns = all
            .iter()
            .map(|segment| segment.first_ns)
            .min()
            .unwrap_or(0);
        let last_ns = all.iter().map(|segment| segment.last_ns).max().unwrap_or(0);
        let mut text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  \
             starting_time:\n    nanoseconds_since_epoch: {first_ns}\n  message_count: {}\n  topics_with_message_count:\n",
            last_ns - first_ns,
            poses + wrenches
        );
        // writing to a string cannot fail
        for (kind, count) in [(TopicKind::Pose, poses), (TopicKind::Wrench, wrenches)] {
            let (name, type_name) = (self.topics.name(kind), kind.type_name());
            let _ = write!(
                text,
                "    - topic_metadata:\n        name: {name:?}\n        type: {type_name}\n        serialization_format: \
                 cdr\n        offered_qos_profiles: \"\"\n      message_count: {count}\n"
            );
        }
        text.push_str(
            "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n",
        );
        for segment in all {
            let _ = writeln!(text, "    - {}", segment.name);
        }
        text.push_str("  files:\n");
        for FileSegment {
            name,
            counts: [poses, wrenches],
            first_ns,
            last_ns,
            ..
        } in all
        {
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

/// The segments of a folder without `metadata.yaml`, as after a crash, in their order, except empty
/// ones.
pub(super) fn segments_of(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        let is_segment = path.extension().is_some_and(|ending| ending == "mcap");
        if is_segment && path.metadata()?.len() > super::mcap_files::mcap::MAGIC.len() as u64 {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
