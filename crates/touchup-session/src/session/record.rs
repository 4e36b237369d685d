//! The record of a session, which reproduces its result: scene, scan, recording, and changes of
//! strokes.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use chrono::{DateTime, SecondsFormat, Utc};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::strokes::{StrokeChange, StrokeChanges};
use crate::clock::{Clock, locked};
use crate::threads::give_way;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::{RecordingError, SegmentedWriter, Topics};
use touchup_io::session_folder::{SessionFolder, fingerprint, read_text};
use touchup_method::stylus::Message;

const DESCRIPTION: &str = "session.json";
const SCENE: &str = "scene.yaml";
const STROKES: &str = "strokes.jsonl";

/// Longest time between flushes, and maximum loss in a crash.
const FLUSH_EVERY: Duration = Duration::from_millis(50);
/// Retry period after a write error.
const ASK_AGAIN: Duration = Duration::from_secs(1);
/// Maximum number of messages waiting for the disk: several seconds of both streams.
const MOST_WAITING: usize = 1 << 14;

/// Error of beginning or resuming a session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The system refused access.
    #[error("{}: {source}", path.display())]
    Io {
        /// file or folder
        path: PathBuf,
        /// its reason
        source: io::Error,
    },
    /// A file of the session has changed since the session wrote it.
    #[error("{}: {reason}; is that the folder of a session?", path.display())]
    Damaged {
        /// the file
        path: PathBuf,
        /// the fault
        reason: String,
    },
    /// The scan has changed.
    #[error("{}: it changed since the session began: restore the scan", path.display())]
    ScanChanged {
        /// the scan
        path: PathBuf,
    },
}

#[derive(Debug, Serialize, Deserialize)]
struct Description {
    scan: PathBuf,
    scan_crc32: u32,
    mesh_unit: MeshUnit,
    wrench_topic: String,
    pose_topic: String,
    /// RFC 3339, UTC; absent in older sessions
    #[serde(default, skip_serializing_if = "Option::is_none")]
    begun: Option<String>,
}

/// Description of a session, without a check of its scan.
#[derive(Clone, Debug)]
pub struct SessionFacts {
    /// day and time, UTC, RFC 3339; absent in older sessions
    pub begun: Option<String>,
    /// unit of the coordinates in its meshes
    pub mesh_unit: MeshUnit,
}

impl SessionFacts {
    /// Reads the description from the folder of a session.
    ///
    /// # Errors
    /// [`SessionError`], also for any other folder.
    pub fn read(folder: &Path) -> Result<Self, SessionError> {
        let path = folder.join(DESCRIPTION);
        let text = read_text(&path).map_err(io_error(&path))?;
        let Description {
            begun, mesh_unit, ..
        } = parsed(&text, &path)?;
        Ok(Self {
            begun: begun.filter(|begun| DateTime::parse_from_rfc3339(begun).is_ok()),
            mesh_unit,
        })
    }
}

/// A session on disk.
#[derive(Debug)]
pub struct SessionRecord {
    /// the unrefined scan
    pub scan: PathBuf,
    /// unit of its coordinates
    pub mesh_unit: MeshUnit,
    /// the scene
    pub scene: PathBuf,
    /// recording of the touches
    pub recording: PathBuf,
    /// its topics
    pub topics: Topics,
    /// undone, redone, excluded and restored strokes
    pub strokes: StrokeChanges,
}

impl SessionRecord {
    /// Name of the recording in the folder of a session.
    pub const RECORDING: &str = "recording";

    /// Writes scene, start time and reference of the scan into a new folder.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn begin(
        folder: &SessionFolder,
        scan: &Path,
        mesh_unit: MeshUnit,
        scene_yaml: &str,
        topics: &Topics,
        begun: SystemTime,
    ) -> Result<(), SessionError> {
        let begun = Some(DateTime::<Utc>::from(begun).to_rfc3339_opts(SecondsFormat::Secs, true));
        let (scan, scan_crc32) = fingerprint(scan).map_err(io_error(scan))?;
        let (wrench_topic, pose_topic) = (topics.wrench.clone(), topics.pose.clone());
        let description = Description {
            scan,
            scan_crc32,
            mesh_unit,
            wrench_topic,
            pose_topic,
            begun,
        };
        let text = serde_json::to_string_pretty(&description)
            .expect("paths that were read are text, or are refused");
        folder
            .write_text(SCENE, scene_yaml)
            .map_err(io_error(folder.path()))?;
        folder
            .write_text(DESCRIPTION, &text)
            .map_err(io_error(folder.path()))
    }

    /// Reads the folder of a session, whether ended or not.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn open(folder: &Path) -> Result<Self, SessionError> {
        let path = folder.join(DESCRIPTION);
        let text = read_text(&path).map_err(io_error(&path))?;
        let Description {
            scan,
            scan_crc32,
            mesh_unit,
            wrench_topic,
            pose_topic,
            ..
        } = parsed(&text, &path)?;
        let now = fingerprint(&scan).map_err(io_error(&scan))?;
        if now.1 != scan_crc32 {
            return Err(SessionError::ScanChanged { path: scan });
        }
        Ok(Self {
            scan,
            mesh_unit,
            scene: folder.join(SCENE),
            recording: folder.join(SessionRecord::RECORDING),
            topics: Topics {
                pose: pose_topic,
                wrench: wrench_topic,
                markers: None,
            },
            strokes: Self::strokes_of(folder)?,
        })
    }

    /// Reads the present undone, redone, excluded and restored strokes.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn strokes_of(folder: &Path) -> Result<StrokeChanges, SessionError> {
        read_strokes(&folder.join(STROKES))
    }
}

/// Ignores a last line cut off by a crash.
fn read_strokes(path: &Path) -> Result<StrokeChanges, SessionError> {
    let text = read_text(path).map_err(io_error(path))?;
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    whole.lines().map(|line| parsed(line, path)).collect()
}

fn parsed<T: DeserializeOwned>(json: &str, path: &Path) -> Result<T, SessionError> {
    serde_json::from_str(json).map_err(|error| SessionError::Damaged {
        path: path.to_owned(),
        reason: error.to_string(),
    })
}

/// Messages missing in the recording of a session.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingLoss {
    /// number of messages
    pub messages: u64,
    /// the last write error
    pub reason: Option<String>,
    /// whether the disk still refuses
    pub is_refused: bool,
}

/// Records messages on a thread of its own.
#[derive(Debug)]
pub struct SessionRecorder {
    folder: SessionFolder,
    sender: SyncSender<Note>,
    thread: JoinHandle<()>,
    unrecorded: Arc<Mutex<RecordingLoss>>,
    end: Arc<RecordingEnd>,
}

/// End of the recording.
#[derive(Debug, Default)]
struct RecordingEnd {
    has_come: Mutex<bool>,
    changed: Condvar,
}

impl SessionRecorder {
    /// Starts the thread, which writes in the time of `clock`.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn start(
        folder: &SessionFolder,
        topics: &Topics,
        clock: &Clock,
    ) -> Result<Self, SessionError> {
        let recording = folder
            .create_folder(SessionRecord::RECORDING)
            .map_err(io_error(folder.path()))?;
        let writer = SegmentedWriter::new(&recording, topics);
        let (sender, messages) = sync_channel(MOST_WAITING);
        let unrecorded = Arc::new(Mutex::new(RecordingLoss::default()));
        let end = Arc::new(RecordingEnd::default());
        let taker = Taker {
            writer,
            shared: Arc::clone(&unrecorded),
            refused_at: None,
            clock: clock.clone(),
            end: Arc::clone(&end),
        };
        let working = clock.begin_work();
        let work = move || {
            give_way();
            taker.take_down(&messages);
            drop(working);
        };
        let thread = Builder::new()
            .name("recorder".to_owned())
            .spawn(work)
            .map_err(io_error(folder.path()))?;
        Ok(Self {
            folder: folder.clone(),
            sender,
            thread,
            unrecorded,
            end,
        })
    }

    /// Records a message with `frame` in its header; never waits. Without room it loses and counts
    /// the message.
    pub fn write(&self, message: Message, frame: &'static str) {
        if self.sender.try_send(Note::Message(message, frame)).is_err() {
            locked(&self.unrecorded).messages += 1;
        }
    }

    /// The folder of the messages.
    pub fn recording(&self) -> PathBuf {
        self.folder.path().join(SessionRecord::RECORDING)
    }

    /// A receiver for a signal once all earlier messages are on disk; no signal comes if the disk
    /// refuses them, or without room in the queue.
    pub fn flushed(&self) -> Receiver<()> {
        let (to, flushed) = sync_channel(1);
        // without room the sender drops, which the receiver sees
        let _ = self.sender.try_send(Note::Flush(to));
        flushed
    }

    /// Records an undone, redone, excluded or restored stroke.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn write_stroke(&self, change: StrokeChange) -> Result<(), SessionError> {
        let line = serde_json::to_string(&change).expect("a name and numbers cannot fail");
        self.folder
            .append_line(STROKES, &line)
            .map_err(io_error(&self.folder.path().join(STROKES)))
    }

    /// Messages missing in the recording.
    pub fn unrecorded(&self) -> RecordingLoss {
        locked(&self.unrecorded).clone()
    }

    /// Waits for all messages and ends the recording; returns [`Self::unrecorded`].
    pub fn finish(self) -> RecordingLoss {
        let Self {
            sender,
            thread,
            unrecorded,
            end,
            ..
        } = self;
        drop(sender);
        *locked(&end.has_come) = true;
        end.changed.notify_all();
        let ended = thread.join();
        let mut unrecorded = locked(&unrecorded).clone();
        if ended.is_err() {
            unrecorded.reason = Some("the thread of the recorder ended by a fault".to_owned());
        }
        unrecorded
    }
}

/// The error of a file or folder.
fn io_error(path: &Path) -> impl FnOnce(io::Error) -> SessionError {
    |source| SessionError::Io {
        path: path.to_owned(),
        source,
    }
}

/// Requests to the thread of the recorder.
enum Note {
    /// a message with this frame in its header
    Message(Message, &'static str),
    /// signal once all earlier messages are on disk
    Flush(SyncSender<()>),
}

struct Taker {
    writer: SegmentedWriter,
    shared: Arc<Mutex<RecordingLoss>>,
    refused_at: Option<Instant>,
    clock: Clock,
    end: Arc<RecordingEnd>,
}

impl Taker {
    /// Polls the queue: a wake-up for each message would cost the sender more than the message.
    ///
    /// Messages of a failed write are lost; later writes try again, as space may become free.
    fn take_down(mut self, messages: &Receiver<Note>) {
        loop {
            drop(self.clock.wait_while(
                &self.end.changed,
                locked(&self.end.has_come),
                FLUSH_EVERY,
                |has_come| !*has_come,
            ));
            let mut waiting = Vec::new();
            let is_over = loop {
                match messages.try_recv() {
                    Ok(Note::Message(message, frame)) => self.take(&message, frame),
                    Ok(Note::Flush(to)) => waiting.push(to),
                    Err(why) => break why == TryRecvError::Disconnected,
                }
            };
            match self.writer.flush() {
                Ok(count) => {
                    if count > 0 {
                        self.accept();
                    }
                    // the receiver may be gone
                    for to in waiting {
                        let _ = to.send(());
                    }
                }
                Err(error) => self.refuse(0, &error),
            }
            if is_over {
                break;
            }
        }
        let Self { writer, shared, .. } = self;
        if let Err(error) = writer.finish() {
            locked(&shared).reason = Some(error.to_string());
        }
    }

    fn take(&mut self, message: &Message, frame: &str) {
        // writes unless the disk refused recently
        if self
            .refused_at
            .is_some_and(|at| self.clock.since(at) < ASK_AGAIN)
        {
            locked(&self.shared).messages += 1;
        } else if let Err(error) = self.writer.write(message, frame) {
            self.refuse(1, &error);
        }
    }

    fn accept(&mut self) {
        if self.refused_at.take().is_some() {
            locked(&self.shared).is_refused = false;
        }
    }

    fn refuse(&mut self, messages: u64, error: &RecordingError) {
        self.refused_at = Some(self.clock.now());
        let messages = messages + self.writer.give_up_segment();
        let mut shared = locked(&self.shared);
        shared.messages += messages;
        (shared.reason, shared.is_refused) = (Some(error.to_string()), true);
    }
}

#[cfg(test)]
mod tests {
    use std::fs::remove_dir;

    use nalgebra::Vector3;
    use tempfile::{TempDir, tempdir};

    use super::*;
    use touchup_io::recording::RecordingReader;
    use touchup_method::stylus::{StampedWrench, Wrench};

    fn wrench(number: u32) -> Message {
        let wrench = Wrench {
            force: Vector3::z() * f64::from(number),
            torque: Vector3::zeros(),
        };
        Message::Wrench(StampedWrench {
            stamp_ns: i64::from(number) * 1_000_000,
            wrench,
        })
    }

    fn folder() -> (TempDir, SessionFolder) {
        let parent = tempdir().unwrap();
        let folder = SessionFolder::create(parent.path(), "session").unwrap();
        (parent, folder)
    }

    fn on_disk(folder: &SessionFolder) -> Vec<Message> {
        let reader = RecordingReader::open(
            &folder.path().join(SessionRecord::RECORDING),
            &Topics::default(),
        )
        .unwrap();
        reader.map_while(Result::ok).collect()
    }

    /// 1 795 212 850 s is 2026-11-20T22:14:10Z, by `date -u`.
    #[test]
    fn a_session_says_when_it_began_and_an_older_one_does_not() {
        let (parent, folder) = folder();
        let scan = parent.path().join("scan.stl");
        touchup_io::session_folder::write_text_file(&scan, "solid").unwrap();
        let begun = SystemTime::UNIX_EPOCH + Duration::from_secs(1_795_212_850);
        SessionRecord::begin(
            &folder,
            &scan,
            MeshUnit::Inch,
            "",
            &Topics::default(),
            begun,
        )
        .unwrap();
        let facts = SessionFacts::read(folder.path()).unwrap();
        assert_eq!(
            (facts.begun.as_deref(), facts.mesh_unit),
            (Some("2026-11-20T22:14:10Z"), MeshUnit::Inch)
        );
        let text = read_text(&folder.path().join(DESCRIPTION)).unwrap();
        let mut older: serde_json::Value = serde_json::from_str(&text).unwrap();
        older.as_object_mut().unwrap().remove("begun").unwrap();
        folder.write_text(DESCRIPTION, &older.to_string()).unwrap();
        assert_eq!(SessionFacts::read(folder.path()).unwrap().begun, None);
        older["begun"] = "yesterday".into();
        folder.write_text(DESCRIPTION, &older.to_string()).unwrap();
        assert_eq!(SessionFacts::read(folder.path()).unwrap().begun, None);
        assert!(SessionFacts::read(parent.path()).is_err());
    }

    /// Messages between two polls are on disk after the second, and not before.
    #[test]
    fn what_was_written_is_on_the_disk_50_ms_later() {
        let ((_parent, folder), (clock, hand)) = (folder(), Clock::manual());
        let recorder = SessionRecorder::start(&folder, &Topics::default(), &clock).unwrap();
        let mut written = Vec::new();
        for look in 0..40 {
            for number in 1..=look % 3 {
                written.push(wrench(10 * look + number));
                recorder.write(wrench(10 * look + number), "tip");
            }
            hand.advance(FLUSH_EVERY - Duration::from_nanos(1));
            let before = written.len() - look as usize % 3;
            assert_eq!(
                if before == 0 {
                    Vec::new()
                } else {
                    on_disk(&folder)
                },
                written[..before],
                "look {look}"
            );
            hand.advance(Duration::from_nanos(1));
            assert_eq!(
                if written.is_empty() {
                    Vec::new()
                } else {
                    on_disk(&folder)
                },
                written,
                "look {look}"
            );
        }
        assert_eq!(recorder.finish(), RecordingLoss::default());
        assert_eq!(on_disk(&folder), written);
    }

    /// The disk stalls for the capacity of the queue without loss; later messages count as lost.
    #[test]
    fn what_waits_for_the_disk_is_not_lost_and_what_finds_no_room_is_counted() {
        let ((_parent, folder), (clock, hand)) = (folder(), Clock::manual());
        let recorder = SessionRecorder::start(&folder, &Topics::default(), &clock).unwrap();
        // it waits from here on
        hand.advance(Duration::ZERO);
        let count = MOST_WAITING as u32;
        (1..=count + 7).for_each(|number| recorder.write(wrench(number), "tip"));
        assert_eq!(
            recorder.unrecorded(),
            RecordingLoss {
                messages: 7,
                ..RecordingLoss::default()
            }
        );
        hand.advance(FLUSH_EVERY);
        recorder.write(wrench(count + 8), "tip");
        assert_eq!(
            recorder.finish(),
            RecordingLoss {
                messages: 7,
                ..RecordingLoss::default()
            }
        );
        let kept: Vec<_> = (1..=count).chain([count + 8]).map(wrench).collect();
        assert!(on_disk(&folder) == kept);
    }

    /// The folder disappears and returns, like a temporarily full disk.
    #[test]
    fn it_records_on_when_the_disk_takes_again() {
        let ((_parent, folder), (clock, hand)) = (folder(), Clock::manual());
        let recorder = SessionRecorder::start(&folder, &Topics::default(), &clock).unwrap();
        remove_dir(folder.path().join(SessionRecord::RECORDING)).unwrap();
        (1..=5).for_each(|number| recorder.write(wrench(number), "tip"));
        hand.advance(FLUSH_EVERY);
        let refused = recorder.unrecorded();
        assert!(
            refused.messages == 5
                && refused.is_refused
                && refused.reason.unwrap().contains("touch_0000.mcap")
        );

        folder.create_folder(SessionRecord::RECORDING).unwrap();
        // no retry before its time
        recorder.write(wrench(6), "tip");
        hand.advance(ASK_AGAIN - FLUSH_EVERY);
        let refused = recorder.unrecorded();
        assert!(refused.messages == 6 && refused.is_refused);
        // a retry at its time
        recorder.write(wrench(7), "tip");
        hand.advance(FLUSH_EVERY);
        let accepted = recorder.unrecorded();
        assert!(accepted.messages == 6 && !accepted.is_refused);
        recorder.write(wrench(8), "tip");
        assert_eq!(recorder.finish(), accepted);
        assert_eq!(on_disk(&folder), [7, 8].map(wrench));
        assert!(
            folder
                .path()
                .join(SessionRecord::RECORDING)
                .join("metadata.yaml")
                .exists()
        );
    }
}
