//! Poses, wrenches and transforms out of their messages.
//!
//! Quaternions are x, y, z, w here and in the encoders, and nowhere else.

use super::franka::{franka_robot_state, franka_state};
use super::message_type::{MessageFormat, MessageType};
use super::point_cloud;
use super::wire::{MessageFields, RosHeader, WireReader};
use crate::recording::error::BadMessage;
use crate::recording::record::{LiveMessage, Record};
use touchup_method::stylus::{FrameTransform, Message, StampedPose, StampedWrench};

/// Content of a message.
pub(in crate::recording) enum MessageContent {
    /// A pose, wrench or frame of markers, and the frame that its header names.
    Record(String, Record),
    /// A pose and a wrench.
    State(Box<[LiveMessage; 2]>),
    /// Links of a tree.
    Transforms(Vec<FrameTransform>),
}

/// Minimum bytes of a `TransformStamped`: stamp, two names without letters, seven numbers.
const TRANSFORM_BYTES: usize = 8 + 4 + 4 + 56;

/// Reads a message. The position may be anything, the rotation is a unit quaternion.
///
/// - `logged_ns`: stamp of types without one of their own.
pub(in crate::recording) fn decode(
    format: MessageFormat,
    payload: &[u8],
    logged_ns: i64,
) -> Result<MessageContent, BadMessage> {
    let MessageFormat { message_type, wire } = format;
    if message_type == MessageType::PointCloud {
        let (frame, seen) = point_cloud::decode_markers(payload)?;
        return Ok(MessageContent::Record(
            frame.into_owned(),
            Record::Markers(Box::new(seen)),
        ));
    }
    decode_fields(format, &mut WireReader::new(wire, payload)?, logged_ns)
}

/// The same for unpacked fields, which never are markers.
pub(in crate::recording) fn decode_fields(
    format: MessageFormat,
    fields: &mut impl MessageFields,
    logged_ns: i64,
) -> Result<MessageContent, BadMessage> {
    let MessageFormat { message_type, wire } = format;
    let unnamed = || RosHeader {
        stamp_ns: logged_ns,
        ..RosHeader::default()
    };
    let decoded = match message_type {
        MessageType::Transforms => transforms(fields)?,
        MessageType::FrankaState => {
            return franka_state(wire, fields).map(|state| MessageContent::State(Box::new(state)));
        }
        MessageType::FrankaRobotState => {
            return franka_robot_state(fields).map(|state| MessageContent::State(Box::new(state)));
        }
        MessageType::Pose => pose_in(unnamed(), fields)?,
        MessageType::Wrench => wrench_in(unnamed(), fields)?,
        MessageType::WrenchStamped | MessageType::IiwaWrench => {
            wrench_in(fields.header()?, fields)?
        }
        MessageType::TransformStamped => {
            let header = fields.header()?;
            fields.name()?;
            pose_in(header, fields)?
        }
        MessageType::Odometry => {
            let header = fields.header()?;
            fields.name()?;
            let pose = pose_in(header, fields)?;
            // covariance, twist and its covariance
            fields.skip_f64s(36 + 6 + 36)?;
            pose
        }
        MessageType::PoseWithCovarianceStamped => {
            let pose = pose_in(fields.header()?, fields)?;
            fields.skip_f64s(36)?;
            pose
        }
        MessageType::IiwaPose => {
            let pose = pose_in(fields.header()?, fields)?;
            // redundancy: a number, status and turn
            fields.skip_f64s(1)?;
            fields.u32()?;
            fields.u32()?;
            pose
        }
        MessageType::PoseStamped => pose_in(fields.header()?, fields)?,
        MessageType::PointCloud => return Err(BadMessage::Malformed),
    };
    fields.end()?;
    Ok(decoded)
}

fn pose_in(
    header: RosHeader,
    fields: &mut impl MessageFields,
) -> Result<MessageContent, BadMessage> {
    let pose = StampedPose {
        stamp_ns: header.stamp_ns,
        pose_ot: fields.pose()?,
    };
    Ok(MessageContent::Record(
        header.frame,
        Message::Pose(pose).into(),
    ))
}

fn wrench_in(
    header: RosHeader,
    fields: &mut impl MessageFields,
) -> Result<MessageContent, BadMessage> {
    let wrench = StampedWrench {
        stamp_ns: header.stamp_ns,
        wrench: fields.wrench()?,
    };
    Ok(MessageContent::Record(
        header.frame,
        Message::Wrench(wrench).into(),
    ))
}

fn transforms(fields: &mut impl MessageFields) -> Result<MessageContent, BadMessage> {
    let count = fields.count(TRANSFORM_BYTES)?;
    let mut transform = || {
        let RosHeader {
            stamp_ns,
            frame: parent,
        } = fields.header()?;
        let child = fields.name()?;
        let child = child.strip_prefix('/').unwrap_or(&child).to_owned();
        Ok(FrameTransform {
            stamp_ns,
            parent,
            child,
            pose: fields.pose()?,
        })
    };
    (0..count)
        .map(|_| transform())
        .collect::<Result<_, _>>()
        .map(MessageContent::Transforms)
}

#[cfg(test)]
mod tests;
