//! Uncertainty of a contact, cause by cause.
//!
//! Along the normal a contact is off by noise of the pose and of the force over the stiffness, both
//! after the smoothing window, and by r (1 − cos σ) for a normal off by σ: the reach of the ball
//! over the surface. These average out from window to window. Errors of the radius, the pose of the
//! scan and the stiffness do not: they are the same in each.

use crate::parameters;

parameters! {
    /// Residual uncertainty of the calibration; standard deviations.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CalibrationParams in "uncertainty" {
        /// Standard uncertainty of the calibrated radius of the tip; more touches do not reduce it,
        /// and each diameter and width contains it twice.
        ///
        /// In m. A ball of ruby is round within 0.2 µm, and its radius is calibrated within one.
        radius: f64 = 0.001, "radius_sigma_mm" [MM, 0, 1000];
        /// Standard uncertainty of the calibrated centre of the tip and frame of the scan, along
        /// each axis; more touches do not reduce it, and each place contains it, but no size does.
        ///
        /// In m. A gauge block gives the centre within a few µm.
        place: f64 = 0.002, "place_sigma_mm" [MM, 0, 1000];
        /// Standard uncertainty of the calibrated stiffness of the tip.
        ///
        /// As a share. A weight of 1 N that bends a stylus by 50 µm, read within 1 µm.
        stiffness_share: f64 = 2.0, "stiffness_percent" [PERCENT, 0, 100];
    }
}

parameters! {
    /// Uncertainty model.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct UncertaintyParams in "uncertainty" {
        /// Standard deviation of a vertex of the scan, m; 0: free of noise.
        scan: f64 = 0.0;
        /// Contradiction in standard deviations above which a contact is rejected as an outlier.
        gate_sigmas: f64 = 4.0, "gate_sigmas" [SIGMAS, 0.5, 1e6];
    }
    with {
        /// residual uncertainty of the calibration
        calibration: CalibrationParams,
    }
}

impl ContactSigma {
    /// Systematic part, which does not average out, m.
    pub(crate) fn systematic(&self) -> f64 {
        self.calibration.hypot(self.place)
    }
}

impl UncertaintyParams {
    /// The defaults, for a scan with points off by `noise` (m).
    pub fn new(noise: f64) -> Self {
        Self {
            scan: noise,
            ..Self::default()
        }
    }
}

/// Uncertainty of a contact; standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSigma {
    /// of the point along the normal, by random noise, which averages out, m
    pub noise: f64,
    /// of the point along the normal, by the reach of the ball over the surface due to an error of
    /// the normal, m
    pub reach: f64,
    /// of the point along the normal, by radius and stiffness, which does not average out, m
    pub calibration: f64,
    /// of the place of the scan and of what was taken off, the same displacement in each contact
    /// after it, m
    pub place: f64,
    /// of the direction of the normal, rad
    pub normal: f64,
}
