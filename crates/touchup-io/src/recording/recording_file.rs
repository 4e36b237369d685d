//! The files of a recording as one sequence of stored messages.

use std::borrow::Cow;

use super::error::RecordingError;
use super::layout::{TopicInfo, TopicKind};
use super::messages::message_type::MessageFormat;
use crate::file_error::FilePlace;

/// A message as stored in the file.
pub(super) struct RawMessage<'a> {
    pub kind: TopicKind,
    pub format: MessageFormat,
    pub payload: Cow<'a, [u8]>,
    /// time of reception by the recorder, ns
    pub logged_ns: i64,
    pub place: FilePlace,
}

/// One file of a recording: its messages on the topics of a touch, one after another.
pub(super) trait RecordingFile: Send {
    /// Topics known up to now.
    fn topics(&self) -> Vec<TopicInfo>;

    /// Number of messages on these topics, if the file states it.
    fn promised(&self) -> Option<u64>;

    /// Its end is missing, or a part of it is elsewhere.
    fn truncated(&self) -> bool;

    /// The next message of these topics; `None` at the end.
    fn next_message(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError>;
}
