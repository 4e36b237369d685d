//! Tip calibration by a pivot: the centre of the ball in the tracked stylus, from a swing about it.
//!
//! The ball rests in a cone or a divot during a swing of the stylus: p_WH + R_WH d = c for all
//! poses, with the offset d of the ball and the resting point c. Linear in both; if the stylus
//! turned about one axis alone, d along it is undetermined.

use nalgebra::{Isometry3, Vector3};

use super::fit::{CalibrationFit, Equation, UndeterminedDirection, fit, least_determined};
use super::payload::VectorEstimate;

/// A pose of the tracked stylus H in the frame W of the poses.
pub type SwingPose = Isometry3<f64>;

/// Settings of [`fit_tip`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipFitParams {
    /// Largest stray of a resting ball, rms, m. Default 1 mm.
    pub largest_rms: f64,
    /// Smallest swing to either side across any axis, rms, rad. Default 8°, that is ±12° each way:
    /// a smaller one amplifies the noise of the tracker sevenfold in the offset.
    pub smallest_swing: f64,
}

impl Default for TipFitParams {
    fn default() -> Self {
        Self {
            largest_rms: 1e-3,
            smallest_swing: 8f64.to_radians(),
        }
    }
}

/// The calibrated tip and its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct TipFit {
    /// Centre of the ball from the origin of H, in its axes, m.
    pub offset: VectorEstimate,
    /// Resting place of the ball, in W, m.
    pub rest: VectorEstimate,
    /// √(mean |residual|²) of the kept poses, m.
    pub rms: f64,
    /// Number of evaluated poses.
    pub poses: usize,
    /// Number of poses left out as outliers: the ball had slipped, or was not yet at rest.
    pub rejected: usize,
    /// Swing to either side across the axis of the smallest swing, rms, rad.
    pub swing: f64,
    /// Number of poses that carry as much information as one independent pose: 1 for uncorrelated
    /// noise.
    pub correlation: f64,
}

/// Reason why a swing does not determine the offset.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TipError {
    /// Too few poses.
    #[error(
        "{count} poses do not determine the tip: swing the stylus about its resting ball for at least ten seconds"
    )]
    TooFew {
        /// number of poses
        count: usize,
    },
    /// The swing is too small, or about one axis.
    #[error(
        "besides turning about its own axis ({:.2}, {:.2}, {:.2}) the stylus swung by {swing_deg:.1}° only, so the offset of the \
         ball along that axis is not determined: swing it by {wanted_deg:.0}° or more to either side about axes across that one",
        axis[0],
        axis[1],
        axis[2]
    )]
    TooSmall {
        /// rms to either side, degrees
        swing_deg: f64,
        /// least, degrees
        wanted_deg: f64,
        /// axis along which the offset is undetermined, in H
        axis: [f64; 3],
    },
    /// The ball did not rest.
    #[error(
        "the ball strayed by {rms_mm:.2} mm rms, {rejected} of {poses} poses left out: it must rest in one place, in a cone or a \
         divot that holds it, while the stylus is swung"
    )]
    NotAtRest {
        /// rms over the kept poses
        rms_mm: f64,
        /// number of rejected poses
        rejected: usize,
        /// number of all poses
        poses: usize,
    },
}

/// Smallest number of poses with redundancy to detect slips.
const FEWEST_POSES: usize = 10;
/// Largest share of wrong poses.
const LARGEST_REJECTED: f64 = 0.4;

/// Offset of the ball and its resting place.
///
/// - `poses`: in order of time; NaN is left out.
///
/// # Errors
/// [`TipError`]: too few poses, too small a swing (with its axis), a ball that did not rest.
pub fn fit_tip(poses: &[SwingPose], params: &TipFitParams) -> Result<TipFit, TipError> {
    let is_number = |pose: &&SwingPose| {
        pose.translation
            .vector
            .iter()
            .chain(&pose.rotation.coords)
            .all(|x| x.is_finite() && x.abs() < 1e6)
    };
    // R d − c = −p
    let equation = |pose: &SwingPose| Equation {
        a: pose.rotation.to_rotation_matrix().into_inner(),
        z: -pose.translation.vector,
    };
    let equations: Vec<_> = poses.iter().filter(is_number).map(equation).collect();
    if equations.len() < FEWEST_POSES {
        return Err(TipError::TooFew {
            count: equations.len(),
        });
    }
    let too_small = |least: UndeterminedDirection| TipError::TooSmall {
        swing_deg: least.angle().to_degrees(),
        wanted_deg: params.smallest_swing.to_degrees(),
        axis: least.axis.into(),
    };
    let found = fit(&equations, params.smallest_swing.sin().powi(2)).map_err(too_small)?;
    let (rejected, poses) = (found.rejected(), equations.len());
    if found.rms > params.largest_rms || rejected as f64 > LARGEST_REJECTED * poses as f64 {
        return Err(TipError::NotAtRest {
            rms_mm: found.rms * 1e3,
            rejected,
            poses,
        });
    }
    let correlation = correlation(&found, &equations);
    Ok(TipFit {
        offset: VectorEstimate::new(found.x, &(found.covariance_x * correlation)),
        rest: VectorEstimate::new(-found.y, &(found.covariance_y * correlation)),
        rms: found.rms,
        poses,
        rejected,
        swing: least_determined(&equations, &found.kept).angle(),
        correlation,
    })
}

/// (1 + ρ) / (1 − ρ) with ρ the correlation of neighbouring residuals: a tracker's noise is not
/// independent from pose to pose.
fn correlation(found: &CalibrationFit, equations: &[Equation]) -> f64 {
    let residuals: Vec<Vector3<f64>> = equations
        .iter()
        .zip(&found.kept)
        .filter(|(_, kept)| **kept)
        .map(|(e, _)| found.residual(e))
        .collect();
    let squares: f64 = residuals.iter().map(Vector3::norm_squared).sum();
    let products: f64 = residuals.windows(2).map(|pair| pair[0].dot(&pair[1])).sum();
    if squares <= 0.0 {
        return 1.0;
    }
    // nearly equal residuals count as one
    let rho = (products / squares).clamp(0.0, 1.0 - 1.0 / residuals.len() as f64);
    (1.0 + rho) / (1.0 - rho)
}
