//! All that it takes to get a session's result again: scene, scan, what was touched, and which strokes were taken back.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::io::mesh_file::MeshUnit;
use crate::io::recording::{RecordingError, SegmentedWriter, Topics};
use crate::io::session_folder::{SessionFolder, fingerprint, read_text};
use crate::touch::Message;

const DESCRIPTION: &str = "session.json";
const SCENE: &str = "scene.yaml";
const STROKES: &str = "strokes.jsonl";
const RECORDING: &str = "recording";

/// What was written reaches the system at least so often: a crash loses no more.
const FLUSH_EVERY: Duration = Duration::from_millis(50);
/// Messages that wait for the disk at most: several seconds of both streams.
const MOST_WAITING: usize = 1 << 14;

/// Why a session was not begun, or cannot be resumed.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// file or folder
        path: PathBuf,
        /// its reason
        source: io::Error,
    },
    /// A file of the session is not as the session wrote it.
    #[error("{}: {reason}; is that the folder of a session?", path.display())]
    Damaged {
        /// the file
        path: PathBuf,
        /// what is wrong
        reason: String,
    },
    /// The scan is another one now.
    #[error("{}: it changed since the session began: bring the scan back as it was", path.display())]
    ScanChanged {
        /// the scan
        path: PathBuf,
    },
}

/// A stroke taken back, or done again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StrokeChange {
    /// after the sample of this stamp, ns
    pub after_ns: i64,
    /// taken back; else done again
    pub is_undo: bool,
}

#[derive(Debug, Serialize, Deserialize)]
struct Description {
    scan: PathBuf,
    scan_crc32: u32,
    mesh_unit: MeshUnit,
    wrench_topic: String,
    pose_topic: String,
}

/// A session as it is on the disk.
#[derive(Debug)]
pub struct SessionRecord {
    /// the scan, as it was
    pub scan: PathBuf,
    /// unit of its coordinates
    pub mesh_unit: MeshUnit,
    /// the scene
    pub scene: PathBuf,
    /// what was touched
    pub recording: PathBuf,
    /// its topics
    pub topics: Topics,
    /// in order of time
    pub strokes: Vec<StrokeChange>,
}

impl SessionRecord {
    /// Writes scene and reference of the scan into a new folder.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn begin(
        folder: &SessionFolder,
        scan: &Path,
        mesh_unit: MeshUnit,
        scene_yaml: &str,
        topics: &Topics,
    ) -> Result<(), SessionError> {
        let (scan, scan_crc32) =
            fingerprint(scan).map_err(|source| SessionError::Io { path: scan.to_owned(), source })?;
        let (wrench_topic, pose_topic) = (topics.wrench.clone(), topics.pose.clone());
        let description = Description { scan, scan_crc32, mesh_unit, wrench_topic, pose_topic };
        let text = serde_json::to_string_pretty(&description).expect("paths that were read are text, or are refused");
        let io = |source| SessionError::Io { path: folder.path().to_owned(), source };
        folder.write_text(SCENE, scene_yaml).map_err(io)?;
        folder.write_text(DESCRIPTION, &text).map_err(io)
    }

    /// Reads what the folder of a session holds, whether or not it was ended.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn open(folder: &Path) -> Result<Self, SessionError> {
        let path = folder.join(DESCRIPTION);
        let text = read_text(&path).map_err(|source| SessionError::Io { path: path.clone(), source })?;
        let description: Description = serde_json::from_str(&text)
            .map_err(|error| SessionError::Damaged { path: path.clone(), reason: error.to_string() })?;
        let Description { scan, scan_crc32, mesh_unit, wrench_topic, pose_topic } = description;
        let now = fingerprint(&scan).map_err(|source| SessionError::Io { path: scan.clone(), source })?;
        if now.1 != scan_crc32 {
            return Err(SessionError::ScanChanged { path: scan });
        }
        Ok(Self {
            scan,
            mesh_unit,
            scene: folder.join(SCENE),
            recording: folder.join(RECORDING),
            topics: Topics { pose: pose_topic, wrench: wrench_topic, markers: None },
            strokes: read_strokes(&folder.join(STROKES))?,
        })
    }
}

/// A last line that a crash cut off was not done either.
fn read_strokes(path: &Path) -> Result<Vec<StrokeChange>, SessionError> {
    let text = read_text(path).map_err(|source| SessionError::Io { path: path.to_owned(), source })?;
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let read = |line: &str| {
        serde_json::from_str(line)
            .map_err(|error| SessionError::Damaged { path: path.to_owned(), reason: error.to_string() })
    };
    whole.lines().map(read).collect()
}

/// Takes messages down on a thread of its own.
#[derive(Debug)]
pub struct SessionRecorder {
    folder: SessionFolder,
    sender: SyncSender<(Message, &'static str)>,
    thread: JoinHandle<()>,
    lost: Arc<AtomicU64>,
    fault: Arc<Mutex<Option<String>>>,
}

impl SessionRecorder {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn start(folder: &SessionFolder, topics: &Topics) -> Result<Self, SessionError> {
        let io = |source| SessionError::Io { path: folder.path().to_owned(), source };
        let writer = SegmentedWriter::new(&folder.create_folder(RECORDING).map_err(io)?, topics);
        let (sender, messages) = sync_channel(MOST_WAITING);
        let (lost, fault) = (Arc::new(AtomicU64::new(0)), Arc::new(Mutex::new(None)));
        let told = (Arc::clone(&lost), Arc::clone(&fault));
        let work = move || {
            if let Err(error) = take_down(writer, &messages) {
                if let Ok(mut fault) = told.1.lock() {
                    *fault = Some(error.to_string());
                }
                // what comes now is lost, and counted
                let lost = messages.iter().count() as u64;
                told.0.fetch_add(lost, Ordering::Relaxed);
            }
        };
        let thread = Builder::new().name("recorder".to_owned()).spawn(work).map_err(io)?;
        Ok(Self { folder: folder.clone(), sender, thread, lost, fault })
    }

    /// Takes a message down whose header names `frame`; never waits. What finds no room is lost, and counted.
    pub fn write(&self, message: Message, frame: &'static str) {
        if self.sender.try_send((message, frame)).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Takes down that a stroke was taken back or done again.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn write_stroke(&self, change: StrokeChange) -> Result<(), SessionError> {
        let line = serde_json::to_string(&change).expect("a number and a truth value cannot fail");
        let io = |source| SessionError::Io { path: self.folder.path().join(STROKES), source };
        self.folder.append_line(STROKES, &line).map_err(io)
    }

    /// Messages that were not taken down, and why the disk took none, if so.
    pub fn lost(&self) -> (u64, Option<String>) {
        let fault = self.fault.lock().ok().and_then(|fault| fault.clone());
        (self.lost.load(Ordering::Relaxed), fault)
    }

    /// Waits until all is taken down and ends the recording; returns as [`Self::lost`].
    pub fn finish(self) -> (u64, Option<String>) {
        let Self { sender, thread, lost, fault, .. } = self;
        drop(sender);
        let ended = thread.join();
        let fault = fault.lock().ok().and_then(|fault| fault.clone());
        let fault = fault.or_else(|| ended.is_err().then(|| "the thread of the recorder ended by a fault".to_owned()));
        (lost.load(Ordering::Relaxed), fault)
    }
}

fn take_down(mut writer: SegmentedWriter, messages: &Receiver<(Message, &'static str)>) -> Result<(), RecordingError> {
    let mut flushed = Instant::now();
    loop {
        match messages.recv_timeout(FLUSH_EVERY.saturating_sub(flushed.elapsed())) {
            Ok((message, frame)) => writer.write(&message, frame)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        }
        if flushed.elapsed() >= FLUSH_EVERY {
            writer.flush()?;
            flushed = Instant::now();
        }
    }
}
