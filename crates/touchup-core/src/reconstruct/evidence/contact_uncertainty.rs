//! Uncertainty of a contact, cause by cause.
//!
//! Along the normal a contact is off by noise of the pose and of the force over the stiffness, both after the smoothing
//! window, and by r (1 − cos σ) where its normal is off by σ: that much the ball reaches over the surface. These average out
//! from window to window. What the radius, the pose of the scan and the stiffness are off by does not: it is the same in
//! each.

use nalgebra::Vector3;

use crate::parameters;

parameters! {
    /// What a calibration leaves uncertain; standard deviations.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CalibrationParams in "uncertainty" {
        /// What is left after calibrating the radius of the tip and the frame of the scan, along the normal; it averages out in no
        /// number of touches.
        ///
        /// In m. A ball of ruby is round within 0.2 µm, a gauge block gives the centre within a few.
        position: f64 = 0.002, "calibration_mm" [MM, 0, 1000];
        /// What is left after calibrating the stiffness of the tip.
        ///
        /// As a share. A weight of 1 N that bends a stylus by 50 µm, read within 1 µm.
        stiffness_share: f64 = 2.0, "stiffness_percent" [PERCENT, 0, 100];
    }
}

/// How well a contact is known; standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSigma {
    /// of the point along the normal by what averages out, m
    pub noise: f64,
    /// … by how far the ball reaches over the surface where the normal is off, m
    pub reach: f64,
    /// … by what does not average out, m
    pub calibration: f64,
    /// of the direction of the normal, rad
    pub normal: f64,
}

/// Two of three samples share a pose, so that its noise averages out more slowly than that of as many poses.
const SHARED_NOISE: f64 = 1.65;

impl ContactSigma {
    /// - `noise`: of the centre by the pose and by the force, after smoothing, m.
    /// - `bend`: deflection of the stylus along the normal, m.
    /// - `normal`: of its direction, rad.
    /// - `radius`: of the ball, m.
    pub(in crate::reconstruct) fn of(
        calibration: &CalibrationParams,
        [pose, force]: [f64; 2],
        bend: f64,
        normal: f64,
        radius: f64,
    ) -> Self {
        Self {
            noise: (pose * SHARED_NOISE).hypot(force),
            reach: radius * (1.0 - normal.cos()),
            calibration: calibration.position.hypot(calibration.stiffness_share * bend),
            normal,
        }
    }
}

/// Follows the noise of the force: the median step from one sample to the next.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct ForceNoise {
    /// N
    step: f64,
}

/// Step of the running median: converges within some hundred samples.
const NOISE_STEP: f64 = 0.01;
/// Where it starts, N.
const USUAL_STEP: f64 = 0.1;
/// What is never undercut, N.
const LEAST_STEP: f64 = 1e-4;
/// Median length of the difference of two vectors of unit noise per axis: √2 times that of χ with three degrees.
const STEP_PER_SIGMA: f64 = 2.175;

impl Default for ForceNoise {
    fn default() -> Self {
        Self { step: USUAL_STEP }
    }
}

impl ForceNoise {
    pub(in crate::reconstruct) fn note(&mut self, before: &Vector3<f64>, after: &Vector3<f64>) {
        let is_longer = (after - before).norm_squared() > self.step * self.step;
        self.step = (self.step * if is_longer { 1.0 + NOISE_STEP } else { 1.0 - NOISE_STEP }).max(LEAST_STEP);
    }

    /// Standard deviation of a component, N.
    pub(in crate::reconstruct) fn sigma(&self) -> f64 {
        self.step / STEP_PER_SIGMA
    }
}
