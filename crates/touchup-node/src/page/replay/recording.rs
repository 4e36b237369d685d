//! Recording of a session, for repeated playback.

use std::path::PathBuf;

use crate::ros::playback::{PlayedTime, wrench_frame_id};
use touchup_io::recording::{RecordingError, StampSource, Topics};
use touchup_method::stylus::Message;
use touchup_session::replay::Recording;

/// Number of messages between checks for cancellation.
const ASK_EVERY: u64 = 4096;

/// A recording with known length.
#[derive(Debug)]
pub(super) struct SessionRecording {
    path: PathBuf,
    topics: Topics,
    /// frame of the headers of its wrenches
    pub wrench_frame: String,
    /// number of messages at reading: a running session goes on
    pub message_count: u64,
    /// time of the last message, ns
    pub end_ns: i64,
    /// position of damage, at which it ends
    pub damage: Option<String>,
}

impl SessionRecording {
    /// Reads the recording once, from its first message to its last.
    ///
    /// - `source`: the tool, `stylus` or `probe`.
    /// - `is_wanted`: `false` cancels the reading.
    ///
    /// # Errors
    /// [`RecordingError`] if nothing is readable.
    pub fn read(
        path: PathBuf,
        topics: Topics,
        source: &str,
        is_wanted: impl Fn() -> bool,
    ) -> Result<Self, RecordingError> {
        let mut reader = Recording::open(&path, &topics, StampSource::Header)?;
        let wrench_frame = wrench_frame_id(reader.wrench_frame, source);
        let mut recording = Self {
            path,
            topics,
            wrench_frame,
            message_count: 0,
            end_ns: 0,
            damage: None,
        };
        let mut time = PlayedTime::default();
        while let Some(message) = reader.next_message() {
            match message {
                Ok(message) => {
                    recording.end_ns = time.at_ns(message.stamp_ns());
                    recording.message_count += 1;
                }
                Err(error) if recording.message_count == 0 => return Err(error),
                Err(error) => recording.damage = Some(error.to_string()),
            }
            if recording.message_count.is_multiple_of(ASK_EVERY) && !is_wanted() {
                break;
            }
        }
        Ok(recording)
    }

    /// The messages, each with its time, ns.
    ///
    /// # Errors
    /// As [`Self::read`]: for the part readable then.
    pub fn messages(
        &self,
    ) -> Result<impl Iterator<Item = Result<(i64, Message), RecordingError>> + use<>, RecordingError>
    {
        let mut reader = Recording::open(&self.path, &self.topics, StampSource::Header)?;
        let mut time = PlayedTime::default();
        let messages = std::iter::from_fn(move || reader.next_message());
        let timed = messages
            .map(move |message| message.map(|message| (time.at_ns(message.stamp_ns()), message)));
        Ok(timed.take(usize::try_from(self.message_count).unwrap_or(usize::MAX)))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::Isometry3;

    use super::*;
    use touchup_io::recording::write_recording;
    use touchup_method::stylus::{StampedPose, StampedWrench, Wrench};

    const S: i64 = 1_000_000_000;

    fn wrench(stamp_ns: i64) -> Message {
        Message::Wrench(StampedWrench {
            stamp_ns,
            wrench: Wrench::default(),
        })
    }

    fn pose(stamp_ns: i64) -> Message {
        Message::Pose(StampedPose {
            stamp_ns,
            pose_ot: Isometry3::identity(),
        })
    }

    fn read(path: &Path) -> Result<SessionRecording, RecordingError> {
        SessionRecording::read(path.to_owned(), Topics::default(), "stylus", || true)
    }

    #[test]
    fn it_is_as_long_as_its_stamps_without_long_rests_and_what_comes_later_is_not_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("touch.mcap");
        let mut messages = vec![pose(0), wrench(S), pose(S), wrench(100 * S)];
        write_recording(
            &path,
            &Topics::default(),
            "object",
            "stylus",
            messages.clone(),
        )
        .unwrap();
        let recording = read(&path).unwrap();
        let found = (
            recording.message_count,
            recording.end_ns,
            recording.wrench_frame.as_str(),
        );
        assert_eq!(found, (4, 3 * S, "stylus_sensor"));
        assert_eq!(recording.damage, None);
        messages.push(pose(101 * S));
        write_recording(
            &path,
            &Topics::default(),
            "object",
            "stylus",
            messages.clone(),
        )
        .unwrap();
        for _ in 0..2 {
            let played: Vec<_> = recording.messages().unwrap().map(Result::unwrap).collect();
            let expected: Vec<_> = [0, S, S, 3 * S]
                .into_iter()
                .zip(messages.iter().copied())
                .collect();
            assert_eq!(played, expected);
        }
    }

    #[test]
    fn of_a_recording_that_was_cut_off_what_is_there_is_played() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("touch.mcap");
        let messages: Vec<_> = (0..20_000)
            .flat_map(|at| [pose(at * S / 1000), wrench(at * S / 1000)])
            .collect();
        write_recording(
            &path,
            &Topics::default(),
            "object",
            "object",
            messages.clone(),
        )
        .unwrap();
        let whole = read(&path).unwrap();
        assert_eq!(
            (whole.message_count, whole.wrench_frame.as_str()),
            (40_000, "cell")
        );
        let file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.set_len(file.metadata().unwrap().len() / 2).unwrap();
        let cut = read(&path).unwrap();
        assert!(
            cut.message_count > 10_000 && cut.message_count < 30_000,
            "{}",
            cut.message_count
        );
        let played: Vec<_> = cut
            .messages()
            .unwrap()
            .map(|timed| timed.unwrap().1)
            .collect();
        assert_eq!(played, messages[..cut.message_count as usize]);
        assert!(read(&folder.path().join("missing")).is_err());
    }
}
