//! Messages of live topics, decoded like those of recordings.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, SeqAccess, Visitor};

use super::decode::{MessageContent, decode, decode_fields};
use super::message_type::{MessageFormat, MessageType};
use super::wire::{MAX_MESSAGE_BYTES, SequenceFields, WireFormat};
use crate::recording::error::BadMessage;
use crate::recording::layout::TopicKind;
use crate::recording::record::{LiveMessage, Record};

/// Content of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// poses of the stylus
    Pose,
    /// wrenches on it
    Wrench,
}

impl SampleKind {
    fn topic_kind(self) -> TopicKind {
        match self {
            Self::Pose => TopicKind::Pose,
            Self::Wrench => TopicKind::Wrench,
        }
    }
}

/// A type of messages that gives poses or wrenches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LiveType {
    kind: SampleKind,
    message_type: MessageType,
}

impl LiveType {
    /// The type of that name, in ROS 2 form (`nav_msgs/msg/Odometry`); empty: PoseStamped or
    /// WrenchStamped.
    ///
    /// # Errors
    /// In words, the actual type and the readable ones.
    pub fn of(kind: SampleKind, type_name: &str) -> Result<Self, String> {
        let usual = kind.topic_kind().type_name();
        let type_name = if type_name.is_empty() {
            usual
        } else {
            type_name
        };
        let topic = match kind {
            SampleKind::Pose => "another pose, or remap its topic (-r)",
            SampleKind::Wrench => "another wrench, or remap its topic (-r)",
        };
        let message_type = MessageType::giving(
            kind.topic_kind(),
            type_name,
            "the parameter pose_frame",
            topic,
        )?;
        Ok(Self { kind, message_type })
    }

    /// Its name in ROS 2.
    pub fn name(self) -> &'static str {
        self.message_type.name()
    }

    /// Whether its messages carry time and frame of the measurement.
    pub fn has_header(self) -> bool {
        self.message_type.has_header()
    }

    /// Reads a message of ROS 2 in wire format, CDR with its four bytes of encapsulation.
    ///
    /// - `received_ns`: stamp for types without one.
    ///
    /// # Errors
    /// [`BadMessage`]
    pub fn decode(self, payload: &[u8], received_ns: i64) -> Result<LiveMessage, BadMessage> {
        self.sample(decode(self.format(), payload, received_ns)?)
    }

    /// The same for a library that unpacks the numbers itself.
    pub fn seed(self, received_ns: i64) -> LiveSeed {
        LiveSeed {
            of: self,
            received_ns,
        }
    }

    fn format(self) -> MessageFormat {
        MessageFormat {
            message_type: self.message_type,
            wire: WireFormat::Cdr,
        }
    }

    fn sample(self, decoded: MessageContent) -> Result<LiveMessage, BadMessage> {
        match (decoded, self.kind) {
            (MessageContent::Record(frame, Record::Message(message)), _) => {
                Ok(LiveMessage { frame, message })
            }
            (MessageContent::State(state), kind) => {
                let [pose, wrench] = *state;
                Ok(if kind == SampleKind::Pose {
                    pose
                } else {
                    wrench
                })
            }
            (MessageContent::Record(..) | MessageContent::Transforms(_), _) => {
                Err(BadMessage::Malformed)
            }
        }
    }
}

/// Reads one message out of a deserializer of CDR.
#[derive(Clone, Copy, Debug)]
pub struct LiveSeed {
    of: LiveType,
    received_ns: i64,
}

impl<'de> DeserializeSeed<'de> for LiveSeed {
    type Value = Result<LiveMessage, BadMessage>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        // fields in sequence, like those of a tuple; their number emerges on the way
        deserializer.deserialize_tuple(MAX_MESSAGE_BYTES, self)
    }
}

impl<'de> Visitor<'de> for LiveSeed {
    type Value = Result<LiveMessage, BadMessage>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "the fields of {}", self.of.name())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, fields: A) -> Result<Self::Value, A::Error> {
        let decoded = decode_fields(
            self.of.format(),
            &mut SequenceFields(fields),
            self.received_ns,
        );
        Ok(decoded.and_then(|decoded| self.of.sample(decoded)))
    }
}
