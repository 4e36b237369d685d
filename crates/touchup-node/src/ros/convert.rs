//! Conversions between messages and the rooms' own types.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::ros::clock::{self, time};
use crate::ros::messages::{
    Header, Point, Pose, PoseStamped, Quaternion as QuaternionMsg, Time, TransformStamped,
    TriggerResponse, Vector3 as Vector3Msg, Wrench as WrenchMsg, WrenchStamped,
};
use touchup_method::stylus::{
    FrameTransform, StampedPose, StampedWrench, Wrench, measured_rotation,
};

/// Stamp, ns; `None` for an invalid one: before 1970, or nanoseconds of a second or more.
pub fn stamp_ns(time: &Time) -> Option<i64> {
    (time.sec >= 0 && time.nanosec < 1_000_000_000).then(|| clock::stamp_ns(*time))
}

/// Header of a publication in `frame`.
pub fn header(stamp_ns: i64, frame: &str) -> Header {
    Header {
        stamp: time(stamp_ns),
        frame_id: frame.to_owned(),
    }
}

/// A measured pose; `None` if its orientation is no rotation. The position is unchecked.
pub fn isometry(pose: &Pose) -> Option<Isometry3<f64>> {
    let (p, q) = (&pose.position, &pose.orientation);
    let rotation = measured_rotation(Quaternion::new(q.w, q.x, q.y, q.z))?;
    Some(Isometry3::from_parts(
        Translation3::new(p.x, p.y, p.z),
        rotation,
    ))
}

/// A link of a tree of frames; `None` if its stamp is no time, or its orientation no rotation.
pub fn frame_transform(stamped: &TransformStamped) -> Option<FrameTransform> {
    let TransformStamped {
        header,
        child_frame_id,
        transform,
    } = stamped;
    let Vector3Msg { x, y, z } = transform.translation;
    let pose = isometry(&Pose {
        position: Point { x, y, z },
        orientation: transform.rotation,
    })?;
    let (stamp_ns, parent, child) = (
        stamp_ns(&header.stamp)?,
        header.frame_id.clone(),
        child_frame_id.clone(),
    );
    Some(FrameTransform {
        stamp_ns,
        parent,
        child,
        pose,
    })
}

/// Message of a point.
pub fn point(p: &Point3<f64>) -> Point {
    Point {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// Message of a vector.
pub fn vector(v: &Vector3<f64>) -> Vector3Msg {
    Vector3Msg {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}

/// Point of a message.
pub fn point_of(p: &Point) -> Point3<f64> {
    Point3::new(p.x, p.y, p.z)
}

/// Vector of a message.
pub fn vector_of(v: &Vector3Msg) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

/// Message of a pose.
pub fn pose(position: &Point3<f64>, q: &UnitQuaternion<f64>) -> Pose {
    Pose {
        position: point(position),
        orientation: QuaternionMsg {
            x: q.i,
            y: q.j,
            z: q.k,
            w: q.w,
        },
    }
}

/// A pose of a recording as a message in `frame`.
pub fn as_pose(stamped: &StampedPose, frame: &str) -> PoseStamped {
    let Isometry3 {
        rotation,
        translation,
    } = &stamped.pose_ot;
    PoseStamped {
        header: header(stamped.stamp_ns, frame),
        pose: pose(&translation.vector.into(), rotation),
    }
}

/// A wrench of a recording as a message in the axes of `frame`.
pub fn as_wrench(wrench: &StampedWrench, frame: &str) -> WrenchStamped {
    let Wrench { force, torque } = &wrench.wrench;
    let wrench_msg = WrenchMsg {
        force: vector(force),
        torque: vector(torque),
    };
    WrenchStamped {
        header: header(wrench.stamp_ns, frame),
        wrench: wrench_msg,
    }
}

/// Response with success, and the result or reason in words.
pub fn trigger(done: Result<String, String>) -> TriggerResponse {
    TriggerResponse {
        success: done.is_ok(),
        message: done.unwrap_or_else(|why| why),
    }
}
