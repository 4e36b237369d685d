//! Poses and wrenches as CDR (XCDR version 1, either byte order), fields in the order of the `.msg` files.
//!
//! Quaternions are x, y, z, w here and nowhere else.

use std::borrow::Cow;

use byteorder::{BigEndian, LittleEndian};
use nalgebra::{Isometry3, Quaternion};
use serde::{Deserialize, Serialize};

use super::{BadMessage, RecordingError, ZSTD_MAGIC};
use touchup_core::stylus::{StampedPose, StampedWrench, Wrench, measured_rotation};

/// Longest payload of a pose or wrench: 84 bytes of numbers and a frame name; more than this is no such message.
pub(super) const MAX_MESSAGE_BYTES: usize = 64 * 1024;
/// Serialized payloads are padded to four bytes by some middlewares; more left over is another type.
const MAX_PADDING_BYTES: usize = 3;
const NS_PER_S: i64 = 1_000_000_000;

#[derive(Serialize, Deserialize)]
struct TimeMsg {
    sec: i32,
    nanosec: u32,
}

#[derive(Serialize, Deserialize)]
pub(super) struct HeaderMsg<'a> {
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
    pub(super) fn new(stamp_ns: i64, frame: &'a str) -> Result<Self, RecordingError> {
        let (sec, nanosec) = (stamp_ns.div_euclid(NS_PER_S), stamp_ns.rem_euclid(NS_PER_S));
        match (i32::try_from(sec), u32::try_from(nanosec)) {
            (Ok(sec @ 0..), Ok(nanosec)) => Ok(Self { stamp: TimeMsg { sec, nanosec }, frame_id: frame.into() }),
            _ => Err(RecordingError::Stamp { stamp_ns }),
        }
    }

    pub(super) fn stamp_ns(&self) -> Result<i64, BadMessage> {
        let nanosec = i64::from(self.stamp.nanosec);
        if nanosec < NS_PER_S { Ok(i64::from(self.stamp.sec) * NS_PER_S + nanosec) } else { Err(BadMessage::Stamp) }
    }
}

/// The payload itself, or what it unpacks to when rosbag2 compressed it as a single message.
pub(super) fn unpack(payload: &[u8]) -> Result<Cow<'_, [u8]>, BadMessage> {
    if payload.starts_with(&ZSTD_MAGIC) {
        let plain = zstd::bulk::decompress(payload, MAX_MESSAGE_BYTES);
        plain.map(Cow::Owned).map_err(|_| BadMessage::Malformed)
    } else {
        Ok(Cow::Borrowed(payload))
    }
}

/// Reads a `PoseStamped`: frame and pose. The position may be anything, the rotation is a unit quaternion.
pub(super) fn decode_pose(payload: &[u8]) -> Result<(Cow<'_, str>, StampedPose), BadMessage> {
    let msg: PoseStampedMsg = decode(payload)?;
    let stamp_ns = msg.header.stamp_ns()?;
    let rotation = measured_rotation(Quaternion::from(msg.orientation)).ok_or(BadMessage::Quaternion)?;
    let pose_ot = Isometry3::from_parts(msg.position.into(), rotation);
    Ok((msg.header.frame_id, StampedPose { stamp_ns, pose_ot }))
}

/// Reads a `WrenchStamped`: frame and wrench, whatever its numbers.
pub(super) fn decode_wrench(payload: &[u8]) -> Result<(Cow<'_, str>, StampedWrench), BadMessage> {
    let msg: WrenchStampedMsg = decode(payload)?;
    let stamp_ns = msg.header.stamp_ns()?;
    let wrench = Wrench { force: msg.force.into(), torque: msg.torque.into() };
    Ok((msg.header.frame_id, StampedWrench { stamp_ns, wrench }))
}

pub(super) fn decode<'a, T: Deserialize<'a>>(payload: &'a [u8]) -> Result<T, BadMessage> {
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
pub(super) fn encode_pose(pose: &StampedPose, frame: &str) -> Result<Vec<u8>, RecordingError> {
    encode(&PoseStampedMsg {
        header: HeaderMsg::new(pose.stamp_ns, frame)?,
        position: pose.pose_ot.translation.vector.into(),
        orientation: pose.pose_ot.rotation.coords.into(),
    })
}

/// Writes a `WrenchStamped` in little-endian CDR.
pub(super) fn encode_wrench(wrench: &StampedWrench, frame: &str) -> Result<Vec<u8>, RecordingError> {
    encode(&WrenchStampedMsg {
        header: HeaderMsg::new(wrench.stamp_ns, frame)?,
        force: wrench.wrench.force.into(),
        torque: wrench.wrench.torque.into(),
    })
}

pub(super) fn encode<T: Serialize>(msg: &T) -> Result<Vec<u8>, RecordingError> {
    let mut payload = vec![0, 1, 0, 0];
    payload.extend(cdr_encoding::to_vec::<T, LittleEndian>(msg)?);
    Ok(payload)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    /// Assembled by hand from the CDR rules: 4-byte header, i32, u32, length 2, "O\0", 2 bytes to the next multiple of
    /// eight, doubles.
    fn pose_bytes(order: u8, numbers: [f64; 7], nanosec: u32) -> Vec<u8> {
        let u32_bytes = |v: u32| if order == 1 { v.to_le_bytes() } else { v.to_be_bytes() };
        let mut bytes = vec![0, order, 0, 0];
        bytes.extend(u32_bytes(7));
        bytes.extend(u32_bytes(nanosec));
        bytes.extend(u32_bytes(2));
        bytes.extend(b"O\0\0\0");
        for v in numbers {
            bytes.extend(if order == 1 { v.to_le_bytes() } else { v.to_be_bytes() });
        }
        bytes
    }

    #[test]
    fn both_byte_orders_give_the_pose_laid_out_by_hand() {
        for order in [0, 1] {
            let bytes = pose_bytes(order, [1.0, -2.0, 3.5, 0.5, -0.5, 0.5, 0.5], 9);
            let (frame, pose) = decode_pose(&bytes).unwrap();
            assert_eq!((frame.as_ref(), pose.stamp_ns), ("O", 7_000_000_009));
            assert_eq!(pose.pose_ot.translation.vector, Vector3::new(1.0, -2.0, 3.5));
            let q = pose.pose_ot.rotation;
            assert_eq!((q.i, q.j, q.k, q.w), (0.5, -0.5, 0.5, 0.5));
        }
    }

    #[test]
    fn encoding_gives_the_bytes_laid_out_by_hand() {
        let bytes = pose_bytes(1, [1.0, -2.0, 3.5, 0.0, 0.0, 1.0, 0.0], 9);
        let half_turn_about_z = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 1.0));
        let pose_ot = Isometry3::from_parts(Translation3::new(1.0, -2.0, 3.5), half_turn_about_z);
        assert_eq!(encode_pose(&StampedPose { stamp_ns: 7_000_000_009, pose_ot }, "O").unwrap(), bytes);
    }

    #[test]
    fn a_position_may_be_nan_but_a_rotation_is_refused_when_it_is_none() {
        let (_, pose) = decode_pose(&pose_bytes(1, [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.005], 0)).unwrap();
        assert!(pose.pose_ot.translation.x.is_nan());
        assert!((pose.pose_ot.rotation.norm() - 1.0).abs() < 1e-15);
        for q in [[0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.02], [f64::INFINITY; 4]] {
            let bytes = pose_bytes(1, [0.0, 0.0, 0.0, q[0], q[1], q[2], q[3]], 0);
            assert_eq!(decode_pose(&bytes).unwrap_err(), BadMessage::Quaternion);
        }
    }

    #[test]
    fn every_shortened_or_lengthened_payload_is_malformed() {
        let bytes = pose_bytes(1, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 0);
        for len in 0..bytes.len() {
            assert_eq!(decode_pose(&bytes[..len]).unwrap_err(), BadMessage::Malformed, "{len} bytes");
        }
        let longer = |n: usize| [bytes.clone(), vec![0; n]].concat();
        assert!(decode_pose(&longer(3)).is_ok());
        assert_eq!(decode_pose(&longer(4)).unwrap_err(), BadMessage::Malformed);
    }

    #[test]
    fn a_wrench_is_not_a_pose_and_other_encodings_are_refused() {
        let wrench = encode_wrench(&StampedWrench { stamp_ns: 0, wrench: Wrench::default() }, "O").unwrap();
        assert_eq!(decode_pose(&wrench).unwrap_err(), BadMessage::Malformed);
        for order in [2, 3, 6, 7, 255] {
            let mut bytes = wrench.clone();
            bytes[1] = order;
            assert_eq!(decode_wrench(&bytes).unwrap_err(), BadMessage::Malformed);
        }
    }

    #[test]
    fn stamps_outside_their_range_are_refused() {
        let bytes = pose_bytes(1, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 1_000_000_000);
        assert_eq!(decode_pose(&bytes).unwrap_err(), BadMessage::Stamp);
        for stamp_ns in [-1, 2_147_483_648_000_000_000, i64::MIN, i64::MAX] {
            let wrench = StampedWrench { stamp_ns, wrench: Wrench::default() };
            assert!(matches!(encode_wrench(&wrench, ""), Err(RecordingError::Stamp { .. })));
        }
    }
}
