//! From raw pose and wrench messages to samples the refiner can use.
//!
//! [`MarkerFilter`] computes the stylus pose from its markers, [`Placement`] maps it to the ball
//! centre and the scan frame, [`Synchroniser`] brings both streams to common instants.
//! [`ContactEstimator`] turns each sample into one [`ContactSample`] for all users: [`Compensator`]
//! subtracts weight and bias and rotates the force into the object frame, [`BiasTracker`] follows
//! the sensor drift, [`ContactGate`] detects contact, [`TipMotion`] and [`Friction`] estimate
//! sliding and surface normal. [`TipBody`] finds the touching point of the tip. Without a pose topic, [`MovingFrame`] derives the pose from the
//! transforms of a [`FrameBuffer`].

mod bias;
mod clocks;
mod compensate;
mod contact;
mod contact_estimator;
mod force_noise;
mod frame_buffer;
mod free_motion;
mod friction;
mod local_motion;
mod markers;
mod moving_frame;
mod placement;
mod probed;
mod stream;
mod sync;
mod sync_params;
mod tip_motion;
mod tip_shape;

pub use bias::{BiasParams, BiasTracker};
pub use clocks::clock::ClockEstimator;
pub use clocks::clock_offset::{ClockChange, ClockDrift, ClockEvidence, ClockOffset, ClockStep};
pub use compensate::{
    Compensator, CompensatorParams, Payload, SensorBias, SensorMount, Tip, WrenchFrame,
};
pub use contact::{Contact, ContactGate, ContactGateParams, TouchState};
pub(crate) use contact::{LONGEST_HOLD, STROKE_PAUSE_NS};
pub use contact_estimator::{ContactEstimator, ContactEstimatorParams, ContactSample};
pub(crate) use force_noise::ForceNoise;
pub use frame_buffer::{FrameBuffer, FrameError, FrameTransform, plain_name};
pub(crate) use friction::WIDEST_CONE_COSINE;
pub use friction::{Friction, FrictionCoefficient, NormalEstimate, Sliding};
pub(crate) use local_motion::{LocalMotion, SmoothedMotion};
pub use markers::{
    MarkerBody, MarkerCounts, MarkerFilter, MarkerFrame, MarkerObservation, MarkerParams,
    SpringParams,
};
pub use moving_frame::MovingFrame;
pub use placement::{ChangeCourse, ChangedThing, KnownChange, Placement, motion_about};
pub use probed::ProbedPoint;
pub use sync::Synchroniser;
pub use sync_params::{SyncCounts, SyncParams};
pub use tip_motion::{Ball, SlidingParams, TipMotion, TipParams};
pub(crate) use tip_shape::TipContact;
pub use tip_shape::{TipBody, TipPlace, TipShape, TipSizes};

pub use crate::parameters::SettingError;

use std::ops::{Add, Mul, Sub};

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

/// Largest coordinate of a valid pose in the object frame, m.
///
/// Parts and cells are a few metres large; a corrupted exponent is off by far more.
pub const LARGEST_POSITION: f64 = 1e3;

/// Largest component of a valid force, N: a hundred times the force of a hand-held stylus or a
/// small arm.
pub(crate) const LARGEST_FORCE: f64 = 1e5;

/// Largest component of a valid torque, N·m: [`LARGEST_FORCE`] at a lever of one metre.
pub(crate) const LARGEST_TORQUE: f64 = 1e5;

/// Tolerance on the norm of a received unit quaternion: components printed with six digits.
const UNIT_TOLERANCE: f64 = 1e-5;

/// Reason for refusing a message or a sample.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    /// NaN or infinite component.
    #[error("the {what} at {stamp_ns} ns is not finite; drop it and go on")]
    NotFinite {
        /// "position", "orientation", "force" or "torque"
        what: &'static str,
        /// its time, ns
        stamp_ns: i64,
    },
    /// A magnitude beyond any stylus.
    #[error(
        "the {what} of {magnitude:e} {unit} at {stamp_ns} ns is beyond {limit:e} {unit}; is the unit right?"
    )]
    Absurd {
        /// "position", "force" or "torque"
        what: &'static str,
        /// its magnitude, in `unit`
        magnitude: f64,
        /// the largest accepted, in `unit`
        limit: f64,
        /// "m", "N" or "N·m"
        unit: &'static str,
        /// its time, ns
        stamp_ns: i64,
    },
    /// A quaternion that is no rotation.
    #[error(
        "the orientation at {stamp_ns} ns is a quaternion of length {norm}, not 1; normalise it at its source"
    )]
    NotARotation {
        /// length of the quaternion
        norm: f64,
        /// its time, ns
        stamp_ns: i64,
    },
    /// A repeated or backward stamp.
    #[error(
        "the sample at {stamp_ns} ns is not after the one at {last_ns} ns; give samples in order of time"
    )]
    NotAfter {
        /// its time, ns
        stamp_ns: i64,
        /// time of the sample before it, ns
        last_ns: i64,
    },
}

/// Largest deviation from norm 1 of a measured quaternion due to rounding.
const QUATERNION_NORM_SLACK: f64 = 0.01;
/// Rounding of a product of three rotations: such a quaternion stays bit-identical, so writing and
/// reading again changes nothing.
const QUATERNION_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Rotation of a message, with its rounding removed; `None` for a quaternion that is no rotation,
/// or NaN.
pub fn measured_rotation(q: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    let off = (q.norm() - 1.0).abs();
    if off <= QUATERNION_ROUNDING {
        return Some(UnitQuaternion::new_unchecked(q));
    }
    (off <= QUATERNION_NORM_SLACK).then(|| UnitQuaternion::new_normalize(q))
}

/// Force and torque that the object exerts on the stylus, N and N·m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// N
    pub force: Vector3<f64>,
    /// N·m, about the origin of the frame the wrench is expressed in
    pub torque: Vector3<f64>,
}

impl Wrench {
    /// Rotated into other axes.
    pub fn turned(&self, rotation: &UnitQuaternion<f64>) -> Self {
        Self {
            force: rotation * self.force,
            torque: rotation * self.torque,
        }
    }

    /// About another origin, in the same axes: τ_A = τ_B + p_AB × f.
    ///
    /// - `p_ab`: the present origin from the other one, m.
    pub fn about(&self, p_ab: &Vector3<f64>) -> Self {
        Self {
            force: self.force,
            torque: self.torque + p_ab.cross(&self.force),
        }
    }

    /// In the axes of another frame about its origin: f_A = R_AB f_B, τ_A = R_AB τ_B + p_AB × f_A.
    ///
    /// - `pose_ab`: the present frame in the other one.
    pub fn moved(&self, pose_ab: &Isometry3<f64>) -> Self {
        self.turned(&pose_ab.rotation)
            .about(&pose_ab.translation.vector)
    }
}

impl Add for Wrench {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            force: self.force + other.force,
            torque: self.torque + other.torque,
        }
    }
}

impl Sub for Wrench {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            force: self.force - other.force,
            torque: self.torque - other.torque,
        }
    }
}

impl Mul<f64> for Wrench {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            force: self.force * factor,
            torque: self.torque * factor,
        }
    }
}

/// A pose message: `pose_ot` maps the tip frame T (origin: ball centre) to the object frame O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPose {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    /// Pose of T in O, m.
    pub pose_ot: Isometry3<f64>,
}

impl StampedPose {
    /// Refuses an invalid pose.
    ///
    /// # Errors
    /// [`SampleError::NotFinite`], [`SampleError::Absurd`], [`SampleError::NotARotation`].
    pub fn check(&self) -> Result<(), SampleError> {
        let stamp_ns = self.stamp_ns;
        check_vector(
            "position",
            &self.pose_ot.translation.vector,
            LARGEST_POSITION,
            "m",
            stamp_ns,
        )?;
        let norm = self.pose_ot.rotation.coords.norm();
        if !norm.is_finite() {
            return Err(SampleError::NotFinite {
                what: "orientation",
                stamp_ns,
            });
        }
        if (norm - 1.0).abs() > UNIT_TOLERANCE {
            return Err(SampleError::NotARotation { norm, stamp_ns });
        }
        Ok(())
    }
}

/// A wrench message, in the frame its header names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedWrench {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    /// As measured: not compensated, not rotated.
    pub wrench: Wrench,
}

impl StampedWrench {
    /// Refuses an invalid wrench.
    ///
    /// # Errors
    /// [`SampleError::NotFinite`], [`SampleError::Absurd`].
    pub(crate) fn check(&self) -> Result<(), SampleError> {
        check_vector(
            "force",
            &self.wrench.force,
            LARGEST_FORCE,
            "N",
            self.stamp_ns,
        )?;
        check_vector(
            "torque",
            &self.wrench.torque,
            LARGEST_TORQUE,
            "N·m",
            self.stamp_ns,
        )
    }
}

/// One message of either stream, as a recording or a topic delivers it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// Tip pose.
    Pose(StampedPose),
    /// The measured wrench.
    Wrench(StampedWrench),
}

impl Message {
    /// Time of measurement, ns.
    pub fn stamp_ns(&self) -> i64 {
        match self {
            Self::Pose(pose) => pose.stamp_ns,
            Self::Wrench(wrench) => wrench.stamp_ns,
        }
    }
}

/// Pose and wrench at one instant: input of [`crate::haptic::Refiner::push`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time of measurement of the wrench, ns, to which the pose is interpolated.
    pub stamp_ns: i64,
    /// Pose of T in O, m.
    pub pose_ot: Isometry3<f64>,
    /// As measured: not compensated, in the axes that [`WrenchFrame`] names.
    pub wrench: Wrench,
}

impl Sample {
    /// Refuses an invalid measurement.
    ///
    /// # Errors
    /// As `StampedPose::check` and `StampedWrench::check`.
    pub fn check(&self) -> Result<(), SampleError> {
        StampedPose {
            stamp_ns: self.stamp_ns,
            pose_ot: self.pose_ot,
        }
        .check()?;
        StampedWrench {
            stamp_ns: self.stamp_ns,
            wrench: self.wrench,
        }
        .check()
    }

    /// Time since the previous sample, s; 0 for the first.
    ///
    /// # Errors
    /// [`SampleError::NotAfter`] for a repeated or older stamp.
    pub fn seconds_since(&self, last_ns: Option<i64>) -> Result<f64, SampleError> {
        match last_ns {
            Some(last_ns) if self.stamp_ns <= last_ns => Err(SampleError::NotAfter {
                stamp_ns: self.stamp_ns,
                last_ns,
            }),
            Some(last_ns) => Ok(self.stamp_ns.abs_diff(last_ns) as f64 * 1e-9),
            None => Ok(0.0),
        }
    }
}

fn check_vector(
    what: &'static str,
    vector: &Vector3<f64>,
    limit: f64,
    unit: &'static str,
    stamp_ns: i64,
) -> Result<(), SampleError> {
    if !vector.iter().all(|x| x.is_finite()) {
        return Err(SampleError::NotFinite { what, stamp_ns });
    }
    let magnitude = vector.amax();
    if magnitude > limit {
        return Err(SampleError::Absurd {
            what,
            magnitude,
            limit,
            unit,
            stamp_ns,
        });
    }
    Ok(())
}
