//! A recording of any format as one sequence of messages.

use std::collections::{BTreeMap, VecDeque};
use std::iter::FusedIterator;
use std::path::{Path, PathBuf};

use super::RecordingLayout;
use super::error::BadCount;
use super::folder::files_of;
use super::intake::Intake;
use super::opening::open_file;
use super::tables::columns::WrenchAxes;
use super::tables::number_table::{NumberTable, is_table};
use crate::recording::error::BadMessage;
use crate::recording::error::RecordingError;
use crate::recording::record::Record;
use crate::recording::record::StampSource;
use crate::recording::recording_file::RecordingFile;
use touchup_geometry::numeric::counted;
use touchup_method::stylus::Message;

mod survey;

/// Frames of a table, which names none.
const TABLE_FRAMES: [&str; 2] = ["object", "stylus"];

/// Poses and wrenches of a recording, one after another.
///
/// The order is that of the recording: MCAP files as written (rosbag2 writes in order of
/// reception), SQLite files by time of reception and row. It is not the order of the header stamps:
/// sort by stamp to pair the two topics, within a bounded buffer.
///
/// Positions, forces and torques may be NaN or absurd; rotations are unit quaternions. An unusable
/// message is left out and counted in [`Self::bad_messages`]. A damaged file is read up to the
/// damage; then comes one last item, the error. The iterator gives poses and wrenches;
/// [`Self::next_record`] also markers. The largest chunk bounds the memory, at most 256 MiB packed
/// and as much unpacked.
///
/// ```no_run
/// use touchup_io::recording::{RecordingReader, Topics};
/// use touchup_method::stylus::Message;
/// let mut reader = RecordingReader::open("touch.mcap".as_ref(), &Topics::default())?;
/// let poses = reader.by_ref().filter(|message| matches!(message, Ok(Message::Pose(_)))).count();
/// println!("{poses} poses in {:?}", reader.pose_frame());
/// # Ok::<(), touchup_io::recording::RecordingError>(())
/// ```
pub struct RecordingReader {
    layout: RecordingLayout,
    path: PathBuf,
    source: Option<Box<dyn RecordingFile>>,
    /// in place of the files, for a table
    table: Option<NumberTable>,
    rest: VecDeque<PathBuf>,
    intake: Intake,
    stamps: StampSource,
    message_count: Option<u64>,
    truncated: bool,
}

impl RecordingReader {
    /// Opens a recording with the topics of a [`RecordingLayout`] or [`super::Topics`]: a table by
    /// its ending, else an `.mcap` or `.db3` file, either of them compressed by zstd as a whole, a
    /// `.bag` of ROS 1, or a rosbag2 folder with its `metadata.yaml`, whose files are read in the
    /// order named there; without it the .mcap files of the folder, in the order of their names.
    /// Their content decides the format.
    ///
    /// # Errors
    /// [`RecordingError::Frames`] if the transforms lack the requested pose;
    /// [`RecordingError::MissingTopic`] and [`RecordingError::WrongTopic`] if the recording lacks
    /// the topics; [`RecordingError::Damaged`] if damage hides whether it has them;
    /// [`RecordingError::NotARecording`], [`RecordingError::Metadata`], [`RecordingError::Io`].
    pub fn open(path: &Path, layout: impl Into<RecordingLayout>) -> Result<Self, RecordingError> {
        let layout = layout.into();
        if is_table(path) {
            return Self::of_table(path, &layout);
        }
        let mut reader = Self::of_messages(path, &layout)?;
        if let Some(frames) = &layout.frames {
            let tree = Self::of_messages(path, &layout)?.read_tree(frames);
            reader.intake.take_chain(tree.into_chain(frames, path)?);
        }
        Ok(reader)
    }

    fn of_messages(path: &Path, layout: &RecordingLayout) -> Result<Self, RecordingError> {
        let mut reader = Self {
            layout: layout.clone(),
            path: path.to_owned(),
            source: None,
            table: None,
            rest: files_of(path)?,
            intake: Intake::default(),
            stamps: StampSource::default(),
            message_count: Some(0),
            truncated: false,
        };
        reader.source = reader.survey()?;
        if let Some(first) = reader.rest.pop_front() {
            reader.path = first;
        }
        Ok(reader)
    }

    /// A table with a pose and a wrench in each row.
    fn of_table(path: &Path, layout: &RecordingLayout) -> Result<Self, RecordingError> {
        let table = NumberTable::open(path, &layout.columns)?;
        let [object, stylus] = TABLE_FRAMES;
        let wrench_frame = if table.wrench_axes() == WrenchAxes::Pose {
            object
        } else {
            stylus
        };
        let intake = Intake::in_frames(object, wrench_frame);
        Ok(Self {
            layout: layout.clone(),
            path: path.to_owned(),
            source: None,
            table: Some(table),
            rest: VecDeque::new(),
            intake,
            stamps: StampSource::default(),
            message_count: None,
            truncated: false,
        })
    }

    /// The same, with stamps from another source.
    pub fn stamped_by(self, stamps: StampSource) -> Self {
        Self { stamps, ..self }
    }

    /// Number of messages on the topics of a touch, for a progress bar; `None` for a file without a
    /// count (MCAP without its end).
    pub fn message_count(&self) -> Option<u64> {
        self.message_count
    }

    /// Frame of the poses, or of the markers: the object frame O. `None` before the first.
    pub fn pose_frame(&self) -> Option<&str> {
        self.intake.pose_frame.as_deref()
    }

    /// Frame of the wrenches. `None` before the first wrench.
    pub fn wrench_frame(&self) -> Option<&str> {
        self.intake.wrench_frame.as_deref()
    }

    /// Messages left out up to now, and the place of the first for each reason.
    pub fn bad_messages(&self) -> &BTreeMap<BadMessage, BadCount> {
        &self.intake.bad
    }

    /// For poses from transforms: number of poses with an interpolated link, and of stamps without
    /// a pose before the first or behind the last transform of a link.
    pub fn transform_counts(&self) -> Option<[u64; 2]> {
        self.intake.transform_counts()
    }

    /// Defects of the recording, a line each: messages left out, and a lost end.
    pub fn losses(&self) -> Vec<String> {
        let line = |(reason, bad): (&BadMessage, &BadCount)| {
            let (path, place) = (bad.path.display(), &bad.place);
            let messages = counted(bad.poses + bad.wrenches, "message", "messages");
            format!("{messages} {reason}, the first in {path} at {place}")
        };
        let mut losses: Vec<_> = self.bad_messages().iter().map(line).collect();
        if self.truncated {
            losses.push("the recording has lost its end; what is there was read".to_owned());
        }
        losses
    }

    /// The current or last file.
    pub(super) fn source_path(&self) -> &Path {
        &self.path
    }

    /// A file has lost its end (a killed recorder, or a cut copy); the rest is read all the same.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// The next pose, wrench or frame of markers; after damage the error, then `None`.
    pub fn next_record(&mut self) -> Option<Result<Record, RecordingError>> {
        let next = self.advance();
        if next.is_err() {
            self.table = None;
            self.source = None;
            self.rest.clear();
        }
        next.transpose()
    }

    fn advance(&mut self) -> Result<Option<Record>, RecordingError> {
        loop {
            if let Some(other) = self.intake.others.pop_front() {
                return Ok(Some(other));
            }
            if let Some(table) = &mut self.table {
                let Some(row) = table.next_row()? else {
                    return Ok(None);
                };
                if let Some(record) = self.intake.accept_row(row, table.place(), &self.path) {
                    return Ok(Some(record));
                }
                continue;
            }
            let Some(source) = &mut self.source else {
                return Ok(None);
            };
            if let Some(raw) = source.next_message()? {
                if let Some(record) = self.intake.accept(&raw, &self.path, self.stamps) {
                    return Ok(Some(record));
                }
                continue;
            }
            self.truncated |= source.truncated();
            self.source = None;
            let Some(path) = self.rest.pop_front() else {
                self.intake.finish();
                return Ok(None);
            };
            self.source = Some(open_file(&path, &self.layout)?.0);
            self.path = path;
        }
    }
}

impl Iterator for RecordingReader {
    type Item = Result<Message, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        std::iter::from_fn(|| self.next_record()).find_map(|record| match record {
            Ok(Record::Message(message)) => Some(Ok(message)),
            Ok(Record::Markers(_)) => None,
            Err(error) => Some(Err(error)),
        })
    }
}

impl FusedIterator for RecordingReader {}
