//! ROS 2 recordings of a touch: poses (`geometry_msgs/msg/PoseStamped` and other types that hold
//! one, or a tree of transforms) and wrenches (`geometry_msgs/msg/WrenchStamped` and others), or in
//! place of the poses the markers on the stylus (`sensor_msgs/msg/PointCloud2`), read from MCAP,
//! rosbag2 SQLite files, ROS 1 bags and tables of numbers, written as MCAP.
//!
//! Both deal in [`touchup_method::stylus::Message`]s, with the stamps of the message headers.
//! [`RecordingReader`] streams: its memory does not grow with the recording, and it checks every
//! length in a file before use. [`RecordingWriter`] makes a file that rosbag2, Foxglove and the
//! Python readers open; [`write_recording`] publishes only whole ones, [`SegmentedWriter`] writes a
//! growing one, in pieces that a crash leaves whole.

mod bags;
mod copy;
mod db3;
mod error;
mod folder;
mod intake;
mod layout;
mod mcap_files;
mod messages;
mod opening;
mod reader;
mod tables;
mod topics;

pub use crate::file_error::FilePlace;
pub use copy::{CopiedRecording, copy_recording};
pub use error::{BadCount, BadMessage, Damage, RecordingError};
pub(crate) use folder::{is_of_recording, own_files};
pub use layout::{RecordingLayout, Topics, TransformFrames};
use layout::{TopicInfo, TopicKind};
pub use mcap_files::segments::SegmentedWriter;
pub use mcap_files::writer::{RecordingWriter, write_recording};
pub use messages::live_message::{LiveMessage, LiveSeed, LiveType, SampleKind};
use messages::message_type::MessageFormat;
pub use reader::RecordingReader;
pub use tables::columns::{TableColumns, WrenchAxes};

/// Start of a zstd frame: a file compressed as a whole, or a message (CDR begins with 0).
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

use std::borrow::Cow;

use touchup_method::stylus::{MarkerFrame, Message};

/// One entry of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// A pose or a wrench.
    Message(Message),
    /// The markers seen at one instant.
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

touchup_method::names! {
    /// Source of a message's time of measurement.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
    pub enum StampSource {
        /// The stamp of its header.
        #[default]
        Header = "header",
        /// When the recorder took it: for headers without a stamp, or of clocks that have nothing
        /// in common. Both streams are as late then as their way to the recorder was long.
        Log = "log",
    }
}

/// A message as stored in the file.
struct RawMessage<'a> {
    kind: TopicKind,
    format: MessageFormat,
    payload: Cow<'a, [u8]>,
    /// time of reception by the recorder, ns
    logged_ns: i64,
    place: FilePlace,
}

/// One file of a recording: its messages on the topics of a touch, one after another.
trait RecordingFile: Send {
    /// Topics known up to now.
    fn topics(&self) -> Vec<TopicInfo>;

    /// Number of messages on these topics, if the file states it.
    fn promised(&self) -> Option<u64>;

    /// Its end is missing, or a part of it is elsewhere.
    fn truncated(&self) -> bool;

    /// The next message of these topics; `None` at the end.
    fn next_message(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError>;
}
