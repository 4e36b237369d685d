//! One entry of a recording, and the source of its time.

use touchup_method::stylus::{MarkerFrame, Message};

/// A pose or a wrench, and the frame in its header; empty without one.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveMessage {
    /// of the pose, or of the wrench's axes
    pub frame: String,
    /// stamp of its header, or else time of reception
    pub message: Message,
}

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

    pub(super) fn set_stamp(&mut self, stamp: i64) {
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
        /// Stamp of the header.
        #[default]
        Header = "header",
        /// Time of recording: for headers without a stamp, or with stamps of unrelated clocks. Each
        /// stream is then late by its delay to the recorder.
        Log = "log",
    }
}
