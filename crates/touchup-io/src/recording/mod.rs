//! ROS 2 recordings of a touch: poses (`geometry_msgs/msg/PoseStamped`) and wrenches
//! (`geometry_msgs/msg/WrenchStamped`), or in place of the poses the markers on the stylus
//! (`sensor_msgs/msg/PointCloud2`), read from MCAP and rosbag2 SQLite files, written as MCAP.
//!
//! Both deal in [`touchup_core::stylus::Message`]s, stamped as the message headers are. [`RecordingReader`] streams: its memory
//! does not grow with the recording, and no length found in a file is believed before it is checked.
//! [`RecordingWriter`] makes a file that rosbag2, Foxglove and the Python readers open; [`write_recording`] puts one
//! under its final name only when it is whole, [`SegmentedWriter`] writes one that grows, in pieces that a crash leaves whole.

mod cdr;
mod db3;
mod error;
mod folder;
mod framing;
mod mcap;
mod point_cloud;
mod reader;
mod resume;
mod segments;
mod writer;

pub use crate::file_error::FilePlace;
pub use error::{BadCount, BadMessage, Damage, RecordingError};
pub(crate) use folder::{is_of_recording, own_files};
pub use reader::RecordingReader;
pub use segments::SegmentedWriter;
pub use writer::{RecordingWriter, write_recording};

/// What a zstd frame begins with: a file compressed as a whole, or a message (CDR begins with 0).
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

use std::borrow::Cow;

use touchup_core::stylus::{MarkerFrame, Message};

/// One entry of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// A pose or a wrench.
    Message(Message),
    /// The markers that were seen at one instant.
    Markers(Box<MarkerFrame>),
}

impl From<Message> for Record {
    fn from(message: Message) -> Self {
        Self::Message(message)
    }
}

impl Record {
    /// Time of measurement, ns.
    pub fn stamp_ns(&self) -> i64 {
        match self {
            Self::Message(message) => message.stamp_ns(),
            Self::Markers(frame) => frame.stamp_ns,
        }
    }

    fn set_stamp(&mut self, stamp: i64) {
        match self {
            Self::Message(Message::Pose(pose)) => pose.stamp_ns = stamp,
            Self::Message(Message::Wrench(wrench)) => wrench.stamp_ns = stamp,
            Self::Markers(frame) => frame.stamp_ns = stamp,
        }
    }
}

touchup_core::names! {
    /// Which time of a message is taken as that of its measurement.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
    pub enum StampSource {
        /// The stamp of its header.
        #[default]
        Header = "header",
        /// When the recorder took it: for headers without a stamp, or of clocks that have nothing in common. Both streams are as late then
        /// as their way to the recorder was long.
        Log = "log",
    }
}

/// Names of the topics that make a touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// `geometry_msgs/msg/PoseStamped`: tip T in the object frame O, m.
    pub pose: String,
    /// `geometry_msgs/msg/WrenchStamped`: wrench of the object on the stylus, N and N·m.
    pub wrench: String,
    /// `sensor_msgs/msg/PointCloud2`: the markers on the stylus in O, m. When it is named it is read in place of the
    /// pose, and written beside it.
    pub markers: Option<String>,
}

impl Default for Topics {
    /// `/stylus/pose` and `/stylus/wrench`, no markers.
    fn default() -> Self {
        Self { pose: "/stylus/pose".into(), wrench: "/stylus/wrench".into(), markers: None }
    }
}

impl Topics {
    fn name(&self, kind: TopicKind) -> &str {
        match kind {
            TopicKind::Pose => &self.pose,
            TopicKind::Wrench => &self.wrench,
            TopicKind::Markers => self.markers.as_deref().unwrap_or_default(),
        }
    }

    /// The two that are read: the topic of the pose, and that of the wrench.
    fn kinds(&self) -> [TopicKind; 2] {
        [if self.markers.is_some() { TopicKind::Markers } else { TopicKind::Pose }, TopicKind::Wrench]
    }

    fn kind_of(&self, name: &str) -> Option<TopicKind> {
        self.kinds().into_iter().find(|kind| self.name(*kind) == name)
    }
}

/// Which of the topics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum TopicKind {
    Pose,
    Wrench,
    Markers,
}

impl TopicKind {
    fn type_name(self) -> &'static str {
        match self {
            Self::Pose => "geometry_msgs/msg/PoseStamped",
            Self::Wrench => "geometry_msgs/msg/WrenchStamped",
            Self::Markers => "sensor_msgs/msg/PointCloud2",
        }
    }

    fn flag(self) -> &'static str {
        match self {
            Self::Pose => "--pose-topic",
            Self::Wrench => "--wrench-topic",
            Self::Markers => "--markers-topic",
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

impl TopicInfo {
    /// Memory of its names, bytes.
    fn name_bytes(&self) -> usize {
        self.name.len() + self.type_name.len() + self.encoding.len()
    }
}

/// A message as it lies in the file.
struct RawMessage<'a> {
    kind: TopicKind,
    payload: Cow<'a, [u8]>,
    /// when the recorder took it, ns
    logged_ns: i64,
    place: FilePlace,
}

/// One file of a recording: its messages on the two topics, one after another.
trait RecordingFile: Send {
    /// Topics that are known so far.
    fn topics(&self) -> Vec<TopicInfo>;

    /// Messages on the two topics, where the file says how many.
    fn promised(&self) -> Option<u64>;

    /// It has lost its end, or a part of it is elsewhere.
    fn truncated(&self) -> bool;

    /// The next message of the two topics; `None` at the end.
    fn next_message(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError>;
}
