//! The numbers, names and poses of a ROS message, in sequence, in either wire format of ROS.
//!
//! ROS 2: CDR, XCDR version 1, in either byte order, each number at a multiple of its size, strings
//! with a final zero. ROS 1: little endian, nothing between the fields. Each length is compared
//! with the available bytes before use.

use nalgebra::{Isometry3, Quaternion};
use serde::Deserialize;
use serde::de::SeqAccess;

use crate::recording::error::BadMessage;
use touchup_method::stylus::{Wrench, measured_rotation};

/// Longest payload of a message: 84 bytes of numbers and a frame name for a pose, some hundred
/// transforms for a tree of frames.
pub(in crate::recording) const MAX_MESSAGE_BYTES: usize = 64 * 1024;
/// Maximum padding of CDR payloads, to four bytes by some middlewares; more means another type.
const MAX_PADDING_BYTES: usize = 3;
/// Longest name of a frame: the reader keeps those of a tree.
const MAX_FRAME_NAME_BYTES: usize = 1024;
const NS_PER_S: i64 = 1_000_000_000;

/// Wire format of the messages of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::recording) enum WireFormat {
    /// of ROS 2, with its four bytes of encapsulation
    Cdr,
    /// of ROS 1
    Ros1,
}

impl WireFormat {
    /// By the encoding's name in a recording.
    pub fn of(encoding: &str) -> Option<Self> {
        match encoding {
            "cdr" => Some(Self::Cdr),
            "ros1" => Some(Self::Ros1),
            _ => None,
        }
    }
}

/// Stamp and frame of a message.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::recording) struct RosHeader {
    pub stamp_ns: i64,
    pub frame: String,
}

/// The fields of a message, one after another.
pub(in crate::recording) trait MessageFields {
    fn u32(&mut self) -> Result<u32, BadMessage>;

    fn f64(&mut self) -> Result<f64, BadMessage>;

    /// The name of a frame, or of a joint.
    fn name(&mut self) -> Result<String, BadMessage>;

    /// Number of remaining bytes, up to the maximum of a message. Ends the reading.
    fn rest(&mut self) -> usize;

    /// A `std_msgs/Header`.
    fn header(&mut self) -> Result<RosHeader, BadMessage> {
        let [sec, nanosec] = [self.u32()?, self.u32()?];
        // the bits of an int32
        header_of(i64::from(sec.cast_signed()), nanosec, &self.name()?)
    }

    /// Count of a sequence with entries of at least `least_bytes`.
    fn count(&mut self, _least_bytes: usize) -> Result<usize, BadMessage> {
        usize::try_from(self.u32()?).map_err(|_| BadMessage::Malformed)
    }

    /// Requires the end of the message.
    fn end(&mut self) -> Result<(), BadMessage> {
        if self.rest() <= MAX_PADDING_BYTES {
            Ok(())
        } else {
            Err(BadMessage::Malformed)
        }
    }

    fn f64s<const N: usize>(&mut self) -> Result<[f64; N], BadMessage> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Ok(numbers)
    }

    /// Position and quaternion (x, y, z, w), in the same order in a pose and a transform.
    fn pose(&mut self) -> Result<Isometry3<f64>, BadMessage> {
        let position = self.f64s::<3>()?;
        let rotation =
            measured_rotation(Quaternion::from(self.f64s::<4>()?)).ok_or(BadMessage::Quaternion)?;
        Ok(Isometry3::from_parts(position.into(), rotation))
    }

    fn wrench(&mut self) -> Result<Wrench, BadMessage> {
        Ok(Wrench {
            force: self.f64s::<3>()?.into(),
            torque: self.f64s::<3>()?.into(),
        })
    }

    /// Skips numbers.
    fn skip_f64s(&mut self, count: usize) -> Result<(), BadMessage> {
        (0..count).try_for_each(|_| self.f64().map(drop))
    }
}

fn header_of(sec: i64, nanosec: u32, frame: &str) -> Result<RosHeader, BadMessage> {
    let nanosec = i64::from(nanosec);
    if nanosec >= NS_PER_S {
        return Err(BadMessage::Stamp);
    }
    // a leading slash has no meaning
    let frame = frame.strip_prefix('/').unwrap_or(frame).to_owned();
    Ok(RosHeader {
        stamp_ns: sec * NS_PER_S + nanosec,
        frame,
    })
}

/// The rest of a payload.
pub(in crate::recording) struct WireReader<'a> {
    wire: WireFormat,
    is_big: bool,
    body: &'a [u8],
    at: usize,
}

impl<'a> WireReader<'a> {
    /// # Errors
    /// [`BadMessage::Malformed`] for a payload that is too long, or without the encapsulation of
    /// XCDR version 1.
    pub fn new(wire: WireFormat, payload: &'a [u8]) -> Result<Self, BadMessage> {
        let (is_big, body) = match (wire, payload.split_first_chunk()) {
            (WireFormat::Ros1, _) => (false, payload),
            (WireFormat::Cdr, Some((&[0, order @ (0 | 1), _, _], body))) => (order == 0, body),
            (WireFormat::Cdr, _) => return Err(BadMessage::Malformed),
        };
        let is_short = body.len() <= MAX_MESSAGE_BYTES;
        if is_short {
            Ok(Self {
                wire,
                is_big,
                body,
                at: 0,
            })
        } else {
            Err(BadMessage::Malformed)
        }
    }

    fn bytes(&mut self, count: usize) -> Result<&'a [u8], BadMessage> {
        let end = self.at.checked_add(count).ok_or(BadMessage::Malformed)?;
        let bytes = self.body.get(self.at..end).ok_or(BadMessage::Malformed)?;
        self.at = end;
        Ok(bytes)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], BadMessage> {
        if self.wire == WireFormat::Cdr {
            self.at = self.at.next_multiple_of(N);
        }
        let mut number: [u8; N] = self
            .bytes(N)?
            .try_into()
            .map_err(|_| BadMessage::Malformed)?;
        if self.is_big {
            number.reverse();
        }
        Ok(number)
    }

    fn left(&self) -> usize {
        self.body.len().saturating_sub(self.at)
    }
}

impl MessageFields for WireReader<'_> {
    fn u32(&mut self) -> Result<u32, BadMessage> {
        self.number().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, BadMessage> {
        self.number().map(f64::from_le_bytes)
    }

    fn count(&mut self, least_bytes: usize) -> Result<usize, BadMessage> {
        let count = usize::try_from(self.u32()?).map_err(|_| BadMessage::Malformed)?;
        let is_there = count
            .checked_mul(least_bytes)
            .is_some_and(|bytes| bytes <= self.left());
        if is_there {
            Ok(count)
        } else {
            Err(BadMessage::Malformed)
        }
    }

    fn name(&mut self) -> Result<String, BadMessage> {
        let length = self.count(1)?;
        let bytes = self.bytes(length)?;
        let text = match (self.wire, bytes) {
            (WireFormat::Ros1, text) => text,
            (WireFormat::Cdr, [text @ .., 0]) => text,
            (WireFormat::Cdr, []) => &[],
            (WireFormat::Cdr, _) => return Err(BadMessage::Malformed),
        };
        let text = str::from_utf8(text).map_err(|_| BadMessage::Malformed)?;
        if text.len() <= MAX_FRAME_NAME_BYTES {
            Ok(text.to_owned())
        } else {
            Err(BadMessage::Malformed)
        }
    }

    fn header(&mut self) -> Result<RosHeader, BadMessage> {
        if self.wire == WireFormat::Ros1 {
            self.u32()?;
        }
        let [sec, nanosec] = [self.u32()?, self.u32()?];
        let sec = if self.wire == WireFormat::Ros1 {
            i64::from(sec)
        } else {
            i64::from(sec.cast_signed())
        };
        header_of(sec, nanosec, &self.name()?)
    }

    fn rest(&mut self) -> usize {
        let left = self.left();
        self.at = self.body.len();
        left
    }

    fn end(&mut self) -> Result<(), BadMessage> {
        let padding = if self.wire == WireFormat::Cdr {
            MAX_PADDING_BYTES
        } else {
            0
        };
        if self.left() <= padding {
            Ok(())
        } else {
            Err(BadMessage::Malformed)
        }
    }
}

/// The fields from a deserializer, for messages that a library receives and unpacks.
pub(in crate::recording) struct SequenceFields<A>(pub A);

impl<'de, A: SeqAccess<'de>> SequenceFields<A> {
    fn next<T: Deserialize<'de>>(&mut self) -> Result<T, BadMessage> {
        self.0
            .next_element()
            .ok()
            .flatten()
            .ok_or(BadMessage::Malformed)
    }
}

impl<'de, A: SeqAccess<'de>> MessageFields for SequenceFields<A> {
    fn u32(&mut self) -> Result<u32, BadMessage> {
        self.next()
    }

    fn f64(&mut self) -> Result<f64, BadMessage> {
        self.next()
    }

    fn name(&mut self) -> Result<String, BadMessage> {
        self.next().and_then(|text: String| {
            if text.len() <= MAX_FRAME_NAME_BYTES {
                Ok(text)
            } else {
                Err(BadMessage::Malformed)
            }
        })
    }

    fn rest(&mut self) -> usize {
        (0..MAX_MESSAGE_BYTES)
            .take_while(|_| self.next::<u8>().is_ok())
            .count()
    }
}
