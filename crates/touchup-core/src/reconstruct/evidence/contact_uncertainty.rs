//! Uncertainty of a contact, cause by cause.
//!
//! Along the normal a contact is off by noise of the pose and of the force over the stiffness, both after the smoothing
//! window, and by r (1 − cos σ) where its normal is off by σ: that much the ball reaches over the surface. These average out
//! from window to window. What the radius, the pose of the scan and the stiffness are off by does not: it is the same in
//! each.

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

parameters! {
    /// Which uncertainties are estimated.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct UncertaintyParams in "uncertainty" {
        /// Standard deviation of a vertex of the scan, m; 0: free of noise.
        scan: f64 = 0.0;
        /// A contact that contradicts by more than this many standard deviations is rejected as an outlier.
        gate_sigmas: f64 = 4.0, "gate_sigmas" [SIGMAS, 0.5, 1e6];
    }
    with {
        /// What the calibration leaves.
        calibration: CalibrationParams,
    }
}

impl UncertaintyParams {
    /// The defaults, for a scan whose points are off by `noise` (m).
    pub fn new(noise: f64) -> Self {
        Self { scan: noise, ..Self::default() }
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
