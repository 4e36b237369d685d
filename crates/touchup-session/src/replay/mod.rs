//! Replays a recording from first to last message, as messages or as samples.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use touchup_geometry::numeric::counted;
use touchup_io::json_lines::JsonLineError;
use touchup_io::recording::{
    Record, RecordingError, RecordingLayout, RecordingReader, StampSource,
};
use touchup_method::stylus::{
    MarkerCounts, MarkerFilter, Message, Placement, Sample, SettingError, SyncParams, Synchroniser,
    WrenchFrame,
};

use crate::scene::Scene;

mod recorded_as;
mod recorded_surfaces;

pub use recorded_as::RecordedAs;
pub use recorded_surfaces::RecordedSurfaces;

/// Error of a replay.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The scene lacks a description of the markers.
    #[error("{0}")]
    Markers(String),
    /// The recording is damaged before its first message.
    #[error(transparent)]
    Read(#[from] RecordingError),
    /// The known surfaces beside the recording.
    #[error(transparent)]
    Known(#[from] JsonLineError),
    /// A parameter of the pairing or of the placement outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
}

/// Reasons for gaps in the recording itself; every other reason is a lost message.
const NOT_A_LOSS: [&str; 4] = ["gap", "no_pose_before", "no_pose_after", "duplicate"];

/// Findings of a replay besides its samples.
#[derive(Debug, Default)]
pub struct ReplaySummary {
    /// Wrenches of the recording, each a possible sample.
    pub wrenches: u64,
    /// Wrenches without a sample, by reason; reasons of lost poses begin with `pose_`.
    pub refused: BTreeMap<String, u64>,
    /// Losses that a better recording would avoid.
    pub losses: Vec<String>,
    /// Counts of markers, if they give the pose.
    pub markers: Option<MarkerCounts>,
}

/// Maximum number of messages kept during the search for the frames: a minute of both topics, 20
/// MB; 60 MB with markers.
const MOST_AHEAD: usize = 100_000;

/// A recording read until the frames of both topics are known, with the messages read; or messages
/// in memory.
pub struct Recording {
    reader: Option<RecordingReader>,
    ahead: VecDeque<Result<Record, RecordingError>>,
    /// Axes of the wrenches: O if their header names the frame of the pose, else the stylus' own.
    pub wrench_frame: WrenchFrame,
    /// Known surfaces beside the recording.
    pub known: RecordedSurfaces,
}

impl Recording {
    /// Opens a recording and reads up to the first message of both topics; a recording with only
    /// one topic fails in the replay.
    ///
    /// # Errors
    /// [`RecordingError`] of opening it.
    pub fn open(
        path: &Path,
        layout: impl Into<RecordingLayout>,
        stamps: StampSource,
    ) -> Result<Self, RecordingError> {
        let layout = layout.into();
        let mut reader = RecordingReader::open(path, &layout)?.stamped_by(stamps);
        let mut ahead = VecDeque::new();
        while !knows_frames(&reader) && ahead.len() < MOST_AHEAD {
            let Some(record) = reader.next_record() else {
                break;
            };
            ahead.push_back(record);
        }
        let wrench_frame = if ahead.len() < MOST_AHEAD {
            wrench_frame(&reader)
        } else {
            find_wrench_frame(path, &layout)?
        };
        Ok(Self {
            reader: Some(reader),
            ahead,
            wrench_frame,
            known: RecordedSurfaces::default(),
        })
    }

    /// A recording of messages in memory.
    ///
    /// - `messages`: each kind in order of time.
    /// - `wrench_frame`: axes of the wrenches.
    pub fn of_messages(
        messages: impl IntoIterator<Item = Message>,
        wrench_frame: WrenchFrame,
    ) -> Self {
        let ahead = messages
            .into_iter()
            .map(|message| Ok(Record::Message(message)));
        Self {
            reader: None,
            ahead: ahead.collect(),
            wrench_frame,
            known: RecordedSurfaces::default(),
        }
    }

    /// Number of messages, if the recording states it.
    pub fn message_count(&self) -> Option<u64> {
        match &self.reader {
            Some(reader) => reader.message_count(),
            None => Some(self.ahead.len() as u64),
        }
    }

    /// The next pose or wrench, skipping marker frames. After damage the error, then `None`.
    pub fn next_message(&mut self) -> Option<Result<Message, RecordingError>> {
        loop {
            match self.next()? {
                Ok(Record::Message(message)) => return Some(Ok(message)),
                Ok(Record::Markers(_)) => {}
                Err(error) => return Some(Err(error)),
            }
        }
    }

    fn next(&mut self) -> Option<Result<Record, RecordingError>> {
        self.ahead
            .pop_front()
            .or_else(|| self.reader.as_mut()?.next_record())
    }
}

fn knows_frames(reader: &RecordingReader) -> bool {
    reader.pose_frame().is_some() && reader.wrench_frame().is_some()
}

fn wrench_frame(reader: &RecordingReader) -> WrenchFrame {
    if reader.wrench_frame() == reader.pose_frame() {
        WrenchFrame::Object
    } else {
        WrenchFrame::Sensor
    }
}

/// For topics that begin far apart: reads with a reader of its own, which keeps nothing.
fn find_wrench_frame(path: &Path, layout: &RecordingLayout) -> Result<WrenchFrame, RecordingError> {
    let mut reader = RecordingReader::open(path, layout)?;
    while !knows_frames(&reader) && reader.next_record().is_some() {}
    Ok(wrench_frame(&reader))
}

const NO_MARKERS: &str =
    "--markers-topic needs a scene that says where the markers sit: add `markers:` to it";

/// The filter that computes poses of markers, if the recording has markers on `topic`.
///
/// # Errors
/// [`ReplayError::Markers`] if the scene gives no positions of the markers.
pub(crate) fn marker_filter(
    scene: &Scene,
    topic: Option<&str>,
) -> Result<Option<MarkerFilter>, ReplayError> {
    if topic.is_none() {
        return Ok(None);
    }
    let filter = scene
        .marker_filter()
        .map_err(|error| ReplayError::Markers(error.to_string()))?;
    filter
        .map(Some)
        .ok_or_else(|| ReplayError::Markers(NO_MARKERS.to_owned()))
}

/// Passes each message of `recording` to `each`, in order.
///
/// - `markers`: computes the poses of a recording of markers.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// [`ReplayError::Read`] if the recording is damaged before its first message; later damage is a
/// loss.
pub fn each_message(
    mut recording: Recording,
    mut markers: Option<MarkerFilter>,
    at_each: &mut dyn FnMut(),
    mut each: impl FnMut(Message),
) -> Result<ReplaySummary, ReplayError> {
    let mut replayed = ReplaySummary::default();
    let mut has_begun = false;
    while let Some(record) = recording.next() {
        match record {
            Ok(Record::Message(message)) => {
                replayed.wrenches += u64::from(matches!(message, Message::Wrench(_)));
                each(message);
            }
            Ok(Record::Markers(frame)) => {
                if let Some(filter) = &mut markers {
                    filter.push(&frame, |pose| each(Message::Pose(pose)));
                }
            }
            Err(damage) if !has_begun => return Err(damage.into()),
            Err(damage) => replayed.losses.push(damage.to_string()),
        }
        has_begun = true;
        at_each();
    }
    if let Some(filter) = &mut markers {
        filter.finish(|pose| each(Message::Pose(pose)));
        replayed.account_markers(filter);
    }
    recording
        .reader
        .iter()
        .for_each(|reader| replayed.account_reader(reader));
    Ok(replayed)
}

/// Passes each sample of `recording` to `each`, in order of time.
///
/// - `placement`: brings each message into the frames of the scene.
/// - `markers`: computes the poses of a recording of markers.
/// - `at_message`: takes each original message, before placement and pairing.
///
/// # Errors
/// Those of [`each_message`].
pub fn each_sample(
    recording: Recording,
    placement: Option<Placement>,
    sync: SyncParams,
    markers: Option<MarkerFilter>,
    at_each: &mut dyn FnMut(),
    at_message: &mut dyn FnMut(&Message),
    mut each: impl FnMut(&Sample),
) -> Result<ReplaySummary, ReplayError> {
    let mut sync = Synchroniser::new(sync)?;
    placement.iter().try_for_each(Placement::check)?;
    let wrench_frame = recording.wrench_frame;
    let mut replayed = each_message(recording, markers, at_each, |message| {
        at_message(&message);
        let placed = placement
            .as_ref()
            .map_or(message, |placement| placement.place(message, wrench_frame));
        sync.push(placed);
        std::iter::from_fn(|| sync.next_sample()).for_each(|sample| each(&sample));
    })?;
    sync.finish();
    std::iter::from_fn(|| sync.next_sample()).for_each(|sample| each(&sample));
    replayed.account_sync(&sync);
    Ok(replayed)
}

impl ReplaySummary {
    /// Adds the counts of the marker filter.
    fn account_markers(&mut self, filter: &MarkerFilter) {
        for (reason, count) in filter
            .frame_counts()
            .reasons()
            .into_iter()
            .filter(|(_, count)| *count > 0)
        {
            if !NOT_A_LOSS.contains(&reason) {
                self.losses.push(format!(
                    "{} {reason}",
                    counted(count, "marker frame", "marker frames")
                ));
            }
            self.refused.insert(format!("markers_{reason}"), count);
        }
        self.markers = Some(*filter.counts());
    }

    /// Adds the counts of the synchroniser.
    fn account_sync(&mut self, sync: &Synchroniser) {
        let of_wrenches = sync
            .counts()
            .reasons()
            .map(|(reason, count)| (reason, reason.to_owned(), count));
        let of_poses = sync
            .pose_counts()
            .reasons()
            .map(|(reason, count)| (reason, format!("pose_{reason}"), count));
        for (reason, name, count) in of_wrenches
            .into_iter()
            .chain(of_poses)
            .filter(|(.., count)| *count > 0)
        {
            if !NOT_A_LOSS.contains(&reason) {
                self.losses
                    .push(format!("{} {name}", counted(count, "message", "messages")));
            }
            self.refused.insert(name, count);
        }
    }

    /// Adds the counts of the reader.
    fn account_reader(&mut self, recording: &RecordingReader) {
        self.losses.extend(recording.losses());
        for (reason, bad) in recording.bad_messages() {
            self.wrenches += bad.wrenches;
            for (name, count) in [
                (reason.to_string(), bad.wrenches),
                (format!("pose_{reason}"), bad.poses),
            ] {
                if count > 0 {
                    *self.refused.entry(name).or_default() += count;
                }
            }
        }
    }
}
