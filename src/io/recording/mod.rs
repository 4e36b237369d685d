//! ROS 2 recordings of a touch: poses (`geometry_msgs/msg/PoseStamped`) and wrenches
//! (`geometry_msgs/msg/WrenchStamped`), read from MCAP and rosbag2 SQLite files, written as MCAP.
//!
//! Both deal in [`crate::touch::Message`]s, stamped as the message headers are. [`RecordingReader`] streams: its memory
//! does not grow with the recording, and no length found in a file is believed before it is checked.
//! [`RecordingWriter`] makes a file that rosbag2, Foxglove and the Python readers open; [`write_recording`] puts one
//! under its final name only when it is whole.

mod cdr;
mod db3;
mod error;
mod framing;
mod mcap;
mod reader;
mod writer;

pub use error::{BadCount, BadMessage, Damage, Place, RecordingError, TopicList};
pub use reader::RecordingReader;
pub use writer::{RecordingWriter, write_recording};

/// What a zstd frame begins with: a file compressed as a whole, or a message (CDR begins with 0).
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Names of the two topics that make a touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// `geometry_msgs/msg/PoseStamped`: tip T in the object frame O, m.
    pub pose: String,
    /// `geometry_msgs/msg/WrenchStamped`: what the object does to the stylus, N and N·m.
    pub wrench: String,
}

impl Default for Topics {
    /// `/stylus/pose` and `/stylus/wrench`.
    fn default() -> Self {
        Self { pose: "/stylus/pose".into(), wrench: "/stylus/wrench".into() }
    }
}

impl Topics {
    fn name(&self, kind: Kind) -> &str {
        match kind {
            Kind::Pose => &self.pose,
            Kind::Wrench => &self.wrench,
        }
    }

    fn kind_of(&self, name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| self.name(*kind) == name)
    }
}

/// Which of the two topics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Pose,
    Wrench,
}

impl Kind {
    const ALL: [Self; 2] = [Self::Pose, Self::Wrench];

    fn type_name(self) -> &'static str {
        match self {
            Self::Pose => "geometry_msgs/msg/PoseStamped",
            Self::Wrench => "geometry_msgs/msg/WrenchStamped",
        }
    }

    fn flag(self) -> &'static str {
        match self {
            Self::Pose => "--pose-topic",
            Self::Wrench => "--wrench-topic",
        }
    }
}

/// A topic as a file describes it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct TopicInfo {
    name: String,
    type_name: String,
    /// `cdr` in every ROS 2 recording.
    encoding: String,
}

/// A message as it lies in the file.
struct RawMessage<'a> {
    kind: Kind,
    payload: &'a [u8],
    place: Place,
}
