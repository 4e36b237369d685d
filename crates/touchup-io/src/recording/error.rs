//! Faults of a recording, and their places.

use std::io;
use std::path::PathBuf;

use crate::file_error::{FileError, FilePlace};

/// Why a recording cannot be opened, read to its end, or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// file or folder
        path: PathBuf,
        /// its reason
        source: io::Error,
    },
    /// Neither MCAP nor SQLite, plain or zstd-compressed, nor a ROS 1 bag or a table.
    #[error("{}: not a recording: {reason}", path.display())]
    NotARecording {
        /// file or folder
        path: PathBuf,
        /// actual content and remedy
        reason: String,
    },
    /// `metadata.yaml` of a recording folder is unusable.
    #[error("{}: {reason}; the .mcap or .db3 file itself can be given instead", path.display())]
    Metadata {
        /// the metadata file
        path: PathBuf,
        /// the fault, with line and column where known
        reason: String,
    },
    /// The recording has no topic of that name.
    #[error("{}: no topic {topic:?} in the recording; choose one with {flag}. It has: {found}", path.display())]
    MissingTopic {
        /// the recording
        path: PathBuf,
        /// the requested name
        topic: String,
        /// the flag that names it
        flag: &'static str,
        /// topics of the recording with their types, as `/name (type)`
        found: String,
    },
    /// The topic carries another type of message, or its messages are not CDR.
    #[error("{}: topic {topic:?} is {why}", path.display())]
    WrongTopic {
        /// the recording
        path: PathBuf,
        /// the topic
        topic: String,
        /// actual type, and remedy
        why: String,
    },
    /// The transforms lack the frame of the stylus, or its link to the other frame.
    #[error("{}: {what}. It has: {found}", path.display())]
    Frames {
        /// the recording
        path: PathBuf,
        /// the fault, and the flag that mends it
        what: String,
        /// frames of the tree, as `child (in parent)`
        found: String,
    },
    /// Columns of a table with unclear meaning or unit.
    #[error("{}: {what}", path.display())]
    Columns {
        /// the table
        path: PathBuf,
        /// the fault, with the present columns, and the remedy
        what: String,
    },
    /// The file is damaged; the reader has returned everything before that place.
    #[error("{}: damaged at {place}: {damage}", path.display())]
    Damaged {
        /// the file
        path: PathBuf,
        /// end of the readable part
        place: FilePlace,
        /// the damage there
        damage: Damage,
    },
    /// A ROS 2 stamp holds 0 <= s < 2^31, so this one cannot be written.
    #[error("stamp {stamp_ns} ns cannot be written: a ROS 2 recording holds 0 s to 2147483647 s")]
    Stamp {
        /// ns
        stamp_ns: i64,
    },
    /// A failed write.
    #[error(transparent)]
    NotWritten(#[from] FileError),
    /// A failed write of the container.
    #[error("writing the recording: {0}")]
    Write(#[from] ::mcap::McapError),
    /// A failed encoding of a message.
    #[error("encoding a message: {0}")]
    Encode(#[from] cdr_encoding::Error),
}

/// Damage at a place of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Damage {
    /// An unreadable stream: the disk, or a broken zstd frame.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// The file ends inside a record or a page.
    #[error("cut off: {wanted} bytes are announced here, {left} are there")]
    Cut {
        /// announced, bytes
        wanted: u64,
        /// present, bytes
        left: u64,
    },
    /// An implausible length.
    #[error("{what} of {bytes} bytes, over the limit of {limit} bytes")]
    TooLong {
        /// item with this length
        what: &'static str,
        /// announced, bytes
        bytes: u64,
        /// bytes
        limit: u64,
    },
    /// A field runs out of its record.
    #[error("{0} runs out of its record")]
    Field(&'static str),
    /// A checksum does not match.
    #[error("checksum of {what}: stored {stored:08x}, computed {computed:08x}")]
    Checksum {
        /// item with this checksum
        what: &'static str,
        /// in the file
        stored: u32,
        /// of the bytes read
        computed: u32,
    },
    /// Chunks are plain, `zstd` or `lz4`.
    #[error("chunk compressed as {0:?}, which is unknown")]
    Compression(String),
    /// A chunk does not unpack to its announced size.
    #[error("chunk unpacks to {found} bytes, {announced} are announced")]
    ChunkSize {
        /// bytes
        announced: u64,
        /// bytes
        found: u64,
    },
    /// A message of an undescribed channel, or a channel with an undescribed schema.
    #[error("{what} {id} is used but not described")]
    Undescribed {
        /// channel or schema
        what: &'static str,
        /// its number
        id: u16,
    },
    /// The index at the end of the file promises another number of messages on the topics in use.
    #[error(
        "the file's index promises {promised} messages on the topics of the touch, {found} were found"
    )]
    MessageCount {
        /// by the index
        promised: u64,
        /// returned or counted as bad
        found: u64,
    },
    /// An error of SQLite.
    #[error("SQLite: {0}")]
    Sqlite(#[from] rusqlite::Error),
    /// The index of a SQLite file leads backwards.
    #[error("rows do not follow in time")]
    RowOrder,
}

/// Why a single message was left out, by its name in tables and JSON. Reading continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
#[non_exhaustive]
pub enum BadMessage {
    /// Payload that is not CDR of the topic's type.
    #[error("malformed_message")]
    Malformed,
    /// Nanoseconds of the stamp reach a second.
    #[error("bad_stamp")]
    Stamp,
    /// A quaternion whose norm is not finite or not within 1 ± 0.01.
    #[error("bad_quaternion")]
    Quaternion,
    /// A point cloud without x, y and z, or whose sizes do not fit its data.
    #[error("bad_cloud")]
    Cloud,
    /// A frame in the header different from the first message's.
    #[error("frame_changed")]
    FrameChanged,
    /// A transform whose stamp the other links between the two frames never had.
    #[error("transforms_apart")]
    TransformsApart,
}

/// Number of messages left out for one reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadCount {
    /// on the topic of poses or markers
    pub poses: u64,
    /// on the wrench topic
    pub wrenches: u64,
    /// file of the first
    pub path: PathBuf,
    /// place of the first in that file
    pub place: FilePlace,
}
