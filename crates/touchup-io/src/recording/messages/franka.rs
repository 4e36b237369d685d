//! The states of a Franka arm: the pose of its tool and the wrench on it, among much else.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion};

use super::wire::{MessageFields, RosHeader, WireFormat};
use crate::recording::BadMessage;
use crate::recording::record::LiveMessage;
use touchup_method::stylus::{Message, StampedPose, StampedWrench, Wrench};

/// Pose and wrench of one instant, each in its frame.
fn sample_of(
    stamp_ns: i64,
    (pose_frame, pose_ot): (String, Isometry3<f64>),
    (wrench_frame, wrench): (String, Wrench),
) -> [LiveMessage; 2] {
    [
        (pose_frame, Message::Pose(StampedPose { stamp_ns, pose_ot })),
        (
            wrench_frame,
            Message::Wrench(StampedWrench { stamp_ns, wrench }),
        ),
    ]
    .map(|(frame, message)| LiveMessage { frame, message })
}

/// Numbers of a `franka_msgs/FrankaState` before `O_F_ext_hat_K`, from there to `O_T_EE`, and
/// behind that.
const fn franka_numbers(wire: WireFormat) -> [usize; 3] {
    match wire {
        WireFormat::Ros1 => [2 * 6 + 9 * 7 + 6 + 2 * 2 + 2 * 7, 7 + 3 * 13, 3 * 16 + 2],
        WireFormat::Cdr => [
            2 * 6 + 10 * 7 + 6 + 5 * 2 + 2 * 7,
            3 * 6 + 7 + 3 * 13,
            4 * 16 + 2,
        ],
    }
}

/// Bytes behind the last number of a `FrankaState`: the mode, and twice the error flags, whose
/// number grows with releases.
const FRANKA_FLAGS: std::ops::RangeInclusive<usize> = 1 + 2 * 30..=1 + 2 * 64;

/// `O_T_EE` and `O_F_ext_hat_K`, both in the axes of the base.
pub(in crate::recording) fn franka_state(
    wire: WireFormat,
    fields: &mut impl MessageFields,
) -> Result<[LiveMessage; 2], BadMessage> {
    let header = fields.header()?;
    let [before, between, behind] = franka_numbers(wire);
    fields.skip_f64s(before)?;
    let wrench = fields.wrench()?;
    fields.skip_f64s(between)?;
    let matrix = fields.f64s::<16>()?;
    fields.skip_f64s(behind)?;
    flags(fields)?;
    let pose_ot = from_columns(&matrix).ok_or(BadMessage::Quaternion)?;
    let RosHeader { stamp_ns, frame } = header;
    let pose = (frame.clone(), pose_ot);
    Ok(sample_of(stamp_ns, pose, (frame, wrench)))
}

fn flags(fields: &mut impl MessageFields) -> Result<(), BadMessage> {
    if FRANKA_FLAGS.contains(&fields.rest()) {
        Ok(())
    } else {
        Err(BadMessage::Malformed)
    }
}

/// `o_t_ee` and `o_f_ext_hat_k` of a `franka_msgs/FrankaRobotState`, as in franka_ros2 up to 1.0:
/// with the stamp of the whole, in their own frames, or else in that of the whole.
pub(in crate::recording) fn franka_robot_state(
    fields: &mut impl MessageFields,
) -> Result<[LiveMessage; 2], BadMessage> {
    let whole = fields.header()?;
    // contacts and collisions in space and of the joints
    fields.skip_f64s(4 * 3 + 2 * 7)?;
    // measured and desired joints, and the motors
    (0..3).try_for_each(|_| joint_state(fields))?;
    // accelerations of the joints, and change of their torques
    fields.skip_f64s(2 * 7)?;
    joint_state(fields)?;
    // elbow
    fields.skip_f64s(5 * 2)?;
    // the wrench in the frame of stiffness
    stamped_numbers(6, fields)?;
    let wrench_header = fields.header()?;
    let wrench = fields.wrench()?;
    // inertias: mass, centre, six moments
    (0..3).try_for_each(|_| stamped_numbers(1 + 3 + 6, fields))?;
    let pose_header = fields.header()?;
    let pose_ot = fields.pose()?;
    // other poses, twists and accelerations
    (0..4).try_for_each(|_| stamped_numbers(7, fields))?;
    (0..3).try_for_each(|_| stamped_numbers(6, fields))?;
    // time and success rate
    fields.skip_f64s(2)?;
    flags(fields)?;
    let frame = |own: RosHeader| {
        if own.frame.is_empty() {
            whole.frame.clone()
        } else {
            own.frame
        }
    };
    let (pose, wrench) = (
        (frame(pose_header), pose_ot),
        (frame(wrench_header), wrench),
    );
    Ok(sample_of(whole.stamp_ns, pose, wrench))
}

/// Skips a message of a header and `count` numbers.
fn stamped_numbers(count: usize, fields: &mut impl MessageFields) -> Result<(), BadMessage> {
    fields.header()?;
    fields.skip_f64s(count)
}

/// Skips a `sensor_msgs/JointState`: names, then positions, velocities and efforts.
fn joint_state(fields: &mut impl MessageFields) -> Result<(), BadMessage> {
    fields.header()?;
    let names = fields.count(4)?;
    (0..names).try_for_each(|_| fields.name().map(drop))?;
    for _ in 0..3 {
        let numbers = fields.count(8)?;
        fields.skip_f64s(numbers)?;
    }
    Ok(())
}

/// Maximum deviation of a measured rotation's columns from orthonormal, by rounding.
const ROTATION_SLACK: f64 = 0.02;

/// The motion of a homogeneous 4 × 4 matrix, column by column; `None` for other matrices.
fn from_columns(matrix: &[f64; 16]) -> Option<Isometry3<f64>> {
    let [x, y, z, p] =
        [0, 4, 8, 12].map(|at| nalgebra::Vector3::new(matrix[at], matrix[at + 1], matrix[at + 2]));
    let rotation = Matrix3::from_columns(&[x, y, z]);
    let is_rotation = (rotation.transpose() * rotation - Matrix3::identity()).norm()
        <= ROTATION_SLACK
        && rotation.determinant() > 0.0
        && [matrix[3], matrix[7], matrix[11], matrix[15]] == [0.0, 0.0, 0.0, 1.0];
    let turn = || UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    is_rotation.then(|| {
        Isometry3::from_parts(p.into(), UnitQuaternion::new_normalize(turn().into_inner()))
    })
}
