//! A recording as one sequence of messages, whatever it is kept in.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{self, Read};
use std::iter::FusedIterator;
use std::path::{Path, PathBuf};

use super::cdr::{decode_pose, decode_wrench, unpack};
use super::db3::{self, Db3Reader};
use super::error::{BadCount, check_topics};
use super::folder::files_of;
use super::mcap::{self, McapReader};
use super::point_cloud::decode_markers;
use super::{
    BadMessage, RawMessage, Record, RecordingError, RecordingFile, StampSource, TopicInfo, TopicKind, Topics,
    ZSTD_MAGIC,
};
use touchup_core::stylus::Message;

const ROS1_MAGIC: &[u8] = b"#ROSBAG V";

/// Poses and wrenches of a recording, one after another.
///
/// The order is that of the recording: MCAP files as written (rosbag2 writes as it receives), SQLite files by time of
/// reception and row. It is not the order of the header stamps: sort by stamp to pair the two topics, within a
/// bounded buffer.
///
/// Positions, forces and torques may be NaN or absurd; rotations are unit quaternions. A message that cannot be used is
/// left out and counted in [`Self::bad_messages`]. A file that is damaged is read up to the damage; then comes one last
/// item, the error. The iterator gives poses and wrenches; [`Self::next_record`] also markers. Memory is bounded by the largest chunk, at most 256 MiB packed and as much unpacked.
///
/// ```no_run
/// use touchup_io::recording::{RecordingReader, Topics};
/// use touchup_core::stylus::Message;
/// let mut reader = RecordingReader::open("touch.mcap".as_ref(), &Topics::default())?;
/// let poses = reader.by_ref().filter(|message| matches!(message, Ok(Message::Pose(_)))).count();
/// println!("{poses} poses in {:?}", reader.pose_frame());
/// # Ok::<(), touchup_io::recording::RecordingError>(())
/// ```
pub struct RecordingReader {
    topics: Topics,
    path: PathBuf,
    source: Option<Box<dyn RecordingFile>>,
    rest: VecDeque<PathBuf>,
    intake: Intake,
    stamps: StampSource,
    message_count: Option<u64>,
    truncated: bool,
}

impl RecordingReader {
    /// Opens a recording: an `.mcap` or `.db3` file, either of them compressed by zstd as a whole, or a rosbag2 folder
    /// with its `metadata.yaml`, whose files are read in the order named there; without it the .mcap files of the folder, in
    /// the order of their names. Their content decides the format.
    ///
    /// # Errors
    /// [`RecordingError::MissingTopic`] and [`RecordingError::WrongTopic`] when the recording does not have the two topics; [`RecordingError::Damaged`] when damage hides whether it has them;
    /// [`RecordingError::NotARecording`], [`RecordingError::Metadata`], [`RecordingError::Io`].
    pub fn open(path: &Path, topics: &Topics) -> Result<Self, RecordingError> {
        let mut reader = Self {
            topics: topics.clone(),
            path: path.to_owned(),
            source: None,
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

    /// The same, each message stamped by another of its times.
    pub fn stamped_by(self, stamps: StampSource) -> Self {
        Self { stamps, ..self }
    }

    /// Messages on the two topics, for a progress bar; `None` when a file does not say (MCAP without its end).
    pub fn message_count(&self) -> Option<u64> {
        self.message_count
    }

    /// Frame of the poses, or of the markers: the object frame O. `None` before the first.
    pub fn pose_frame(&self) -> Option<&str> {
        self.intake.pose_frame.as_deref()
    }

    /// Frame in which the wrenches are expressed. `None` before the first wrench.
    pub fn wrench_frame(&self) -> Option<&str> {
        self.intake.wrench_frame.as_deref()
    }

    /// Messages left out so far, and where the first of each reason is.
    pub fn bad_messages(&self) -> &BTreeMap<BadMessage, BadCount> {
        &self.intake.bad
    }

    /// A file has lost its end (the recorder was killed, or a copy was cut); what is there is read all the same.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// Looks into every file once: topics, counts, missing ends. Returns the first, still open: it may be a packed one.
    fn survey(&mut self) -> Result<Option<Box<dyn RecordingFile>>, RecordingError> {
        let mut first = None;
        let mut found: Vec<TopicInfo> = Vec::new();
        let mut first_damage = None;
        for file in &self.rest {
            let (source, damage) = open_file(file, &self.topics)?;
            first_damage = first_damage.or(damage);
            self.truncated |= source.truncated();
            self.message_count = self.message_count.zip(source.promised()).map(|(a, b)| a.saturating_add(b));
            found.extend(source.topics());
            found.sort_unstable();
            found.dedup();
            first = first.or(Some(source));
        }
        match (check_topics(&self.path, &self.topics, &found), first_damage) {
            (Err(RecordingError::MissingTopic { .. }), Some(damage)) => Err(damage),
            (checked, _) => checked.map(|()| first),
        }
    }

    /// The next pose, wrench or frame of markers; after damage the error, then `None`.
    pub fn next_record(&mut self) -> Option<Result<Record, RecordingError>> {
        let next = self.advance();
        if next.is_err() {
            self.source = None;
            self.rest.clear();
        }
        next.transpose()
    }

    fn advance(&mut self) -> Result<Option<Record>, RecordingError> {
        loop {
            let Some(source) = &mut self.source else { return Ok(None) };
            if let Some(raw) = source.next_message()? {
                if let Some(mut record) = self.intake.accept(&raw, &self.path) {
                    if self.stamps == StampSource::Log {
                        record.set_stamp(raw.logged_ns);
                    }
                    return Ok(Some(record));
                }
                continue;
            }
            self.truncated |= source.truncated();
            self.source = None;
            let Some(path) = self.rest.pop_front() else { return Ok(None) };
            self.source = Some(open_file(&path, &self.topics)?.0);
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

/// Decodes messages, and counts frames and unusable messages.
#[derive(Default)]
struct Intake {
    pose_frame: Option<String>,
    wrench_frame: Option<String>,
    bad: BTreeMap<BadMessage, BadCount>,
}

impl Intake {
    fn accept(&mut self, raw: &RawMessage, path: &Path) -> Option<Record> {
        let decoded = self.decode(raw);
        if let Err(reason) = decoded {
            let first = BadCount { poses: 0, wrenches: 0, path: path.to_owned(), place: raw.place };
            let bad = self.bad.entry(reason).or_insert(first);
            match raw.kind {
                TopicKind::Pose | TopicKind::Markers => bad.poses += 1,
                TopicKind::Wrench => bad.wrenches += 1,
            }
        }
        decoded.ok()
    }

    fn decode(&mut self, raw: &RawMessage) -> Result<Record, BadMessage> {
        let payload = unpack(&raw.payload)?;
        let (frame, record) = match raw.kind {
            TopicKind::Pose => decode_pose(&payload).map(|(frame, pose)| (frame, Message::Pose(pose).into()))?,
            TopicKind::Wrench => {
                decode_wrench(&payload).map(|(frame, wrench)| (frame, Message::Wrench(wrench).into()))?
            }
            TopicKind::Markers => {
                decode_markers(&payload).map(|(frame, seen)| (frame, Record::Markers(Box::new(seen))))?
            }
        };
        let first = if raw.kind == TopicKind::Wrench { &mut self.wrench_frame } else { &mut self.pose_frame };
        if *first.get_or_insert_with(|| frame.clone().into_owned()) == frame {
            Ok(record)
        } else {
            Err(BadMessage::FrameChanged)
        }
    }
}

/// Opens one file of a recording; with the damage that was met on the search for its topics.
fn open_file(path: &Path, topics: &Topics) -> Result<(Box<dyn RecordingFile>, Option<RecordingError>), RecordingError> {
    let io = |source| RecordingError::Io { path: path.to_owned(), source };
    let mut front = read_front(File::open(path).map_err(io)?).map_err(io)?;
    let packed = front.starts_with(&ZSTD_MAGIC);
    if packed {
        let unpacked = zstd::Decoder::new(File::open(path).map_err(io)?).and_then(read_front);
        front = unpacked.map_err(io)?;
    }
    if front.starts_with(&mcap::MAGIC) {
        let (reader, damage) = McapReader::open(path, topics, packed)?;
        Ok((Box::new(reader), damage))
    } else if front == db3::MAGIC {
        Ok((Box::new(Db3Reader::open(path, topics, packed)?), None))
    } else {
        Err(RecordingError::NotARecording { path: path.to_owned(), reason: describe_front(&front) })
    }
}

fn read_front(input: impl Read) -> io::Result<Vec<u8>> {
    let mut front = Vec::new();
    input.take(db3::MAGIC.len() as u64).read_to_end(&mut front)?;
    Ok(front)
}

fn describe_front(front: &[u8]) -> String {
    if front.is_empty() {
        "the file is empty".to_owned()
    } else if front.starts_with(ROS1_MAGIC) {
        "it is a ROS 1 bag; convert it with `rosbags-convert`".to_owned()
    } else {
        format!("it begins with \"{}\", neither MCAP nor rosbag2's SQLite", front.escape_ascii())
    }
}
