//! What can be wrong with a recording, and where.

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
        /// what was found instead and what to do
        reason: String,
    },
    /// `metadata.yaml` of a recording folder cannot be used.
    #[error("{}: {reason}; the .mcap or .db3 file itself can be given instead", path.display())]
    Metadata {
        /// the metadata file
        path: PathBuf,
        /// what is wrong, with line and column where known
        reason: String,
    },
    /// The recording has no topic of that name.
    #[error("{}: no topic {topic:?} in the recording; choose one with {flag}. It has: {found}", path.display())]
    MissingTopic {
        /// the recording
        path: PathBuf,
        /// the name asked for
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
        /// what it is instead, and what to do
        why: String,
    },
    /// The transforms do not have the frame of the stylus, or not in the other one.
    #[error("{}: {what}. It has: {found}", path.display())]
    Frames {
        /// the recording
        path: PathBuf,
        /// what is wrong, and the flag that mends it
        what: String,
        /// frames of the tree, as `child (in parent)`
        found: String,
    },
    /// The columns of a table do not say which is what, or in what unit.
    #[error("{}: {what}", path.display())]
    Columns {
        /// the table
        path: PathBuf,
        /// what is wrong, with the columns that are there, and what to do
        what: String,
    },
    /// The file is damaged; everything before that place has been handed out.
    #[error("{}: damaged at {place}: {damage}", path.display())]
    Damaged {
        /// the file
        path: PathBuf,
        /// where reading stopped
        place: FilePlace,
        /// what is wrong there
        damage: Damage,
    },
    /// A ROS 2 stamp holds 0 <= s < 2^31, so this one cannot be written.
    #[error("stamp {stamp_ns} ns cannot be written: a ROS 2 recording holds 0 s to 2147483647 s")]
    Stamp {
        /// ns
        stamp_ns: i64,
    },
    /// The system did not write it.
    #[error(transparent)]
    NotWritten(#[from] FileError),
    /// The container could not be written.
    #[error("writing the recording: {0}")]
    Write(#[from] ::mcap::McapError),
    /// A message could not be encoded.
    #[error("encoding a message: {0}")]
    Encode(#[from] cdr_encoding::Error),
}

/// What is wrong at a place of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Damage {
    /// The stream cannot be read on: the disk, or a broken zstd frame.
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
    /// A length that no sane recording has.
    #[error("{what} of {bytes} bytes, over the limit of {limit} bytes")]
    TooLong {
        /// of what
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
        /// of what
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
    /// A message of a channel, or a channel with a schema, that was not described before.
    #[error("{what} {id} is used but not described")]
    Undescribed {
        /// channel or schema
        what: &'static str,
        /// its number
        id: u16,
    },
    /// The index at the end of the file promises another number of messages on the topics that are
    /// read.
    #[error(
        "the file's index promises {promised} messages on the topics of the touch, {found} were found"
    )]
    MessageCount {
        /// by the index
        promised: u64,
        /// handed out or counted as bad
        found: u64,
    },
    /// SQLite's own words.
    #[error("SQLite: {0}")]
    Sqlite(#[from] rusqlite::Error),
    /// The index of a SQLite file leads backwards.
    #[error("rows do not follow in time")]
    RowOrder,
}

/// Why a single message was left out, by the name that tables and JSON give it. Reading goes on.
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
    /// The header names another frame than the first message of the topic did.
    #[error("frame_changed")]
    FrameChanged,
    /// A transform whose stamp the other links between the two frames never had.
    #[error("transforms_apart")]
    TransformsApart,
}

/// How many messages were left out for one reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadCount {
    /// on the topic of poses or markers
    pub poses: u64,
    /// on the wrench topic
    pub wrenches: u64,
    /// file of the first
    pub path: PathBuf,
    /// where in that file the first is
    pub place: FilePlace,
}
