//! Poses, wrenches and transforms out of the messages that hold them.
//!
//! Quaternions are x, y, z, w here and where they are encoded, and nowhere else.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, UnitQuaternion};

use super::message_type::{MessageFormat, MessageType};
use super::wire::{Header, Wire, WireReader};
use super::{BadMessage, Record, point_cloud};
use touchup_core::stylus::{Message, StampedPose, StampedWrench, Wrench, measured_rotation};

/// What a message holds.
pub(super) enum Decoded {
    /// A pose, wrench or frame of markers, and the frame that its header names.
    Record(String, Record),
    /// A pose and a wrench in the same frame.
    State(String, StampedPose, StampedWrench),
    /// Links of a tree.
    Transforms(Vec<Transform>),
}

/// One link of a tree of transforms.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Transform {
    pub stamp_ns: i64,
    pub parent: String,
    pub child: String,
    /// pose of the child in its parent
    pub pose: Isometry3<f64>,
}

/// Least bytes of a `TransformStamped`: stamp, two names without letters, seven numbers.
const TRANSFORM_BYTES: usize = 8 + 4 + 4 + 56;

/// Reads a message. The position may be anything, the rotation is a unit quaternion.
///
/// - `logged_ns`: counts where the type has no stamp of its own.
pub(super) fn decode(format: MessageFormat, payload: &[u8], logged_ns: i64) -> Result<Decoded, BadMessage> {
    let MessageFormat { message_type, wire } = format;
    if message_type == MessageType::PointCloud {
        let (frame, seen) = point_cloud::decode_markers(payload)?;
        return Ok(Decoded::Record(frame.into_owned(), Record::Markers(Box::new(seen))));
    }
    let mut reader = WireReader::new(wire, payload)?;
    let decoded = match message_type {
        MessageType::Transforms => transforms(&mut reader)?,
        MessageType::FrankaState => return franka_state(wire, &mut reader),
        MessageType::Pose => pose_in(Header { stamp_ns: logged_ns, frame: "" }, &mut reader)?,
        MessageType::Wrench => wrench_in(Header { stamp_ns: logged_ns, frame: "" }, &mut reader)?,
        MessageType::WrenchStamped | MessageType::IiwaWrench => wrench_in(reader.header()?, &mut reader)?,
        MessageType::TransformStamped => {
            let header = reader.header()?;
            reader.name()?;
            pose_in(header, &mut reader)?
        }
        MessageType::Odometry => {
            let header = reader.header()?;
            reader.name()?;
            let pose = pose_in(header, &mut reader)?;
            // covariance, twist and its covariance
            reader.skip_f64s(36 + 6 + 36)?;
            pose
        }
        MessageType::PoseWithCovarianceStamped => {
            let pose = pose_in(reader.header()?, &mut reader)?;
            reader.skip_f64s(36)?;
            pose
        }
        MessageType::IiwaPose => {
            let pose = pose_in(reader.header()?, &mut reader)?;
            // redundancy: a number, status and turn
            reader.skip_f64s(1)?;
            reader.u32()?;
            reader.u32()?;
            pose
        }
        MessageType::PoseStamped | MessageType::PointCloud => pose_in(reader.header()?, &mut reader)?,
    };
    reader.end()?;
    Ok(decoded)
}

fn pose_in(header: Header, reader: &mut WireReader) -> Result<Decoded, BadMessage> {
    let pose = StampedPose { stamp_ns: header.stamp_ns, pose_ot: pose(reader)? };
    Ok(Decoded::Record(header.frame.to_owned(), Message::Pose(pose).into()))
}

fn wrench_in(header: Header, reader: &mut WireReader) -> Result<Decoded, BadMessage> {
    let wrench = StampedWrench { stamp_ns: header.stamp_ns, wrench: wrench(reader)? };
    Ok(Decoded::Record(header.frame.to_owned(), Message::Wrench(wrench).into()))
}

/// Position and quaternion, which a pose and a transform have in the same order.
fn pose(reader: &mut WireReader) -> Result<Isometry3<f64>, BadMessage> {
    let position = reader.f64s::<3>()?;
    let rotation = measured_rotation(Quaternion::from(reader.f64s::<4>()?)).ok_or(BadMessage::Quaternion)?;
    Ok(Isometry3::from_parts(position.into(), rotation))
}

fn wrench(reader: &mut WireReader) -> Result<Wrench, BadMessage> {
    Ok(Wrench { force: reader.f64s::<3>()?.into(), torque: reader.f64s::<3>()?.into() })
}

fn transforms(reader: &mut WireReader) -> Result<Decoded, BadMessage> {
    let count = reader.count(TRANSFORM_BYTES)?;
    let mut transform = || {
        let header = reader.header()?;
        let child = reader.name()?;
        let child = child.strip_prefix('/').unwrap_or(child).to_owned();
        Ok(Transform { stamp_ns: header.stamp_ns, parent: header.frame.to_owned(), child, pose: pose(reader)? })
    };
    (0..count).map(|_| transform()).collect::<Result<_, _>>().map(Decoded::Transforms)
}

/// Numbers of a `franka_msgs/FrankaState` before `O_F_ext_hat_K`, from there to `O_T_EE`, and behind that.
const fn franka_numbers(wire: Wire) -> [usize; 3] {
    match wire {
        Wire::Ros1 => [2 * 6 + 9 * 7 + 6 + 2 * 2 + 2 * 7, 7 + 3 * 13, 3 * 16 + 2],
        Wire::Cdr => [2 * 6 + 10 * 7 + 6 + 5 * 2 + 2 * 7, 3 * 6 + 7 + 3 * 13, 4 * 16 + 2],
    }
}

/// Bytes behind the last number of a `FrankaState`: the mode, and twice the flags of errors, of which releases have more and more.
const FRANKA_FLAGS: std::ops::RangeInclusive<usize> = 1 + 2 * 30..=1 + 2 * 64;

/// `O_T_EE` and `O_F_ext_hat_K`, both in the axes of the base.
fn franka_state(wire: Wire, reader: &mut WireReader) -> Result<Decoded, BadMessage> {
    let header = reader.header()?;
    let [before, between, behind] = franka_numbers(wire);
    reader.skip_f64s(before)?;
    let wrench = wrench(reader)?;
    reader.skip_f64s(between)?;
    let matrix = reader.f64s::<16>()?;
    reader.skip_f64s(behind)?;
    if !FRANKA_FLAGS.contains(&reader.left()) {
        return Err(BadMessage::Malformed);
    }
    let pose_ot = from_columns(&matrix).ok_or(BadMessage::Quaternion)?;
    let stamp_ns = header.stamp_ns;
    Ok(Decoded::State(header.frame.to_owned(), StampedPose { stamp_ns, pose_ot }, StampedWrench { stamp_ns, wrench }))
}

/// A measured rotation is rounded, not wrong, when its columns are this close to orthonormal.
const ROTATION_SLACK: f64 = 0.02;

/// The motion of a homogeneous 4 × 4 matrix, column by column; `None` when it is none.
fn from_columns(matrix: &[f64; 16]) -> Option<Isometry3<f64>> {
    let [x, y, z, p] = [0, 4, 8, 12].map(|at| nalgebra::Vector3::new(matrix[at], matrix[at + 1], matrix[at + 2]));
    let rotation = Matrix3::from_columns(&[x, y, z]);
    let is_rotation = (rotation.transpose() * rotation - Matrix3::identity()).norm() <= ROTATION_SLACK
        && rotation.determinant() > 0.0
        && [matrix[3], matrix[7], matrix[11], matrix[15]] == [0.0, 0.0, 0.0, 1.0];
    let turn = || UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    is_rotation.then(|| Isometry3::from_parts(p.into(), UnitQuaternion::new_normalize(turn().into_inner())))
}

#[cfg(test)]
mod tests;
