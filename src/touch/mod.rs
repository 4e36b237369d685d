//! From raw pose and wrench messages to samples the refiner can use.

use nalgebra::{Isometry3, Vector3};

/// Force and torque that the object exerts on the stylus, N and N·m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// N
    pub force: Vector3<f64>,
    /// N·m, about the origin of the frame the wrench is expressed in
    pub torque: Vector3<f64>,
}

/// A pose message: `pose_ot` maps the tip frame T (origin: ball centre) to the object frame O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPose {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    /// Pose of T in O, m.
    pub pose_ot: Isometry3<f64>,
}

/// A wrench message, in the frame its header names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedWrench {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    /// As measured: not compensated, not rotated.
    pub wrench: Wrench,
}

/// Pose and wrench at one instant: what [`crate::refine::Refiner::push`] takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time of measurement of the wrench, ns; the pose is interpolated to it.
    pub stamp_ns: i64,
    /// Pose of T in O, m.
    pub pose_ot: Isometry3<f64>,
    /// As measured: not compensated, expressed in the sensor's frame.
    pub wrench: Wrench,
}
