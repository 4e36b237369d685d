//! Poses, wrenches and clouds in CDR (XCDR version 1), fields in the order of the `.msg` files,
//! quaternions x, y, z, w; the same definitions read clouds.

use std::borrow::Cow;

use byteorder::{BigEndian, LittleEndian};
use serde::{Deserialize, Serialize};

use super::wire::MAX_MESSAGE_BYTES;
use crate::recording::compression::ZSTD_MAGIC;
use crate::recording::error::BadMessage;
use crate::recording::error::RecordingError;
use touchup_method::stylus::{StampedPose, StampedWrench};

/// Maximum padding of serialized payloads, to four bytes by some middlewares; more means another
/// type.
const MAX_PADDING_BYTES: usize = 3;
const NS_PER_S: i64 = 1_000_000_000;

#[derive(Serialize, Deserialize)]
struct TimeMsg {
    sec: i32,
    nanosec: u32,
}

#[derive(Serialize, Deserialize)]
pub(in crate::recording) struct HeaderMsg<'a> {
    stamp: TimeMsg,
    pub frame_id: Cow<'a, str>,
}

#[derive(Serialize, Deserialize)]
struct PoseStampedMsg<'a> {
    header: HeaderMsg<'a>,
    position: [f64; 3],
    /// x, y, z, w
    orientation: [f64; 4],
}

#[derive(Serialize, Deserialize)]
struct WrenchStampedMsg<'a> {
    header: HeaderMsg<'a>,
    force: [f64; 3],
    torque: [f64; 3],
}

impl<'a> HeaderMsg<'a> {
    pub(in crate::recording) fn new(stamp_ns: i64, frame: &'a str) -> Result<Self, RecordingError> {
        let (sec, nanosec) = (stamp_ns.div_euclid(NS_PER_S), stamp_ns.rem_euclid(NS_PER_S));
        match (i32::try_from(sec), u32::try_from(nanosec)) {
            (Ok(sec @ 0..), Ok(nanosec)) => Ok(Self {
                stamp: TimeMsg { sec, nanosec },
                frame_id: frame.into(),
            }),
            _ => Err(RecordingError::Stamp { stamp_ns }),
        }
    }

    pub(in crate::recording) fn stamp_ns(&self) -> Result<i64, BadMessage> {
        let nanosec = i64::from(self.stamp.nanosec);
        if nanosec < NS_PER_S {
            Ok(i64::from(self.stamp.sec) * NS_PER_S + nanosec)
        } else {
            Err(BadMessage::Stamp)
        }
    }
}

/// The payload, unpacked if rosbag2 compressed it as a single message.
pub(in crate::recording) fn unpack(payload: &[u8]) -> Result<Cow<'_, [u8]>, BadMessage> {
    if payload.starts_with(&ZSTD_MAGIC) {
        let plain = zstd::bulk::decompress(payload, MAX_MESSAGE_BYTES);
        plain.map(Cow::Owned).map_err(|_| BadMessage::Malformed)
    } else {
        Ok(Cow::Borrowed(payload))
    }
}

pub(in crate::recording) fn decode<'a, T: Deserialize<'a>>(
    payload: &'a [u8],
) -> Result<T, BadMessage> {
    let Some((&[0, order, _, _], body)) = payload.split_first_chunk() else {
        return Err(BadMessage::Malformed);
    };
    if body.len() > MAX_MESSAGE_BYTES {
        return Err(BadMessage::Malformed);
    }
    let decoded = match order {
        0 => cdr_encoding::from_bytes::<T, BigEndian>(body),
        1 => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        _ => return Err(BadMessage::Malformed),
    };
    let (msg, used) = decoded.map_err(|_| BadMessage::Malformed)?;
    if body.len() - used > MAX_PADDING_BYTES {
        return Err(BadMessage::Malformed);
    }
    Ok(msg)
}

/// Writes a `PoseStamped` in little-endian CDR.
pub(in crate::recording) fn encode_pose(
    pose: &StampedPose,
    frame: &str,
) -> Result<Vec<u8>, RecordingError> {
    encode(&PoseStampedMsg {
        header: HeaderMsg::new(pose.stamp_ns, frame)?,
        position: pose.pose_ot.translation.vector.into(),
        orientation: pose.pose_ot.rotation.coords.into(),
    })
}

/// Writes a `WrenchStamped` in little-endian CDR.
pub(in crate::recording) fn encode_wrench(
    wrench: &StampedWrench,
    frame: &str,
) -> Result<Vec<u8>, RecordingError> {
    encode(&WrenchStampedMsg {
        header: HeaderMsg::new(wrench.stamp_ns, frame)?,
        force: wrench.wrench.force.into(),
        torque: wrench.wrench.torque.into(),
    })
}

pub(in crate::recording) fn encode<T: Serialize>(msg: &T) -> Result<Vec<u8>, RecordingError> {
    let mut payload = vec![0, 1, 0, 0];
    payload.extend(cdr_encoding::to_vec::<T, LittleEndian>(msg)?);
    Ok(payload)
}
