//! Observations and parameters of a fit.

use nalgebra::Point3;

use super::{FitError, TouchNoise};

/// One measured point and its nominal distance from the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The point in O, m: the centre of the touching ball, or a vertex of the mesh.
    pub point: Point3<f64>,
    /// Nominal signed distance from the surface, m, positive in the air: the ball's radius, or 0
    /// for a vertex.
    pub offset: f64,
    /// Standard deviation along the normal, m, > 0; assumed the same across it.
    pub sigma: f64,
    /// Observations of one group share their error: one pass of the stylus over about 0.1 s. Those
    /// of different groups share a wander, by the difference of the group numbers.
    pub group: u32,
}

/// Input of a fit beside its observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitParams {
    /// Standard deviation of a common error of all observations along their normals, m: the
    /// calibration of the ball's radius. It enters radii and widths in full, a diameter twice, and
    /// an axis not at all.
    pub common_sigma: f64,
    /// Standard deviation of a common displacement of all observations, along each axis, m: the
    /// position of the scan. It enters the position of the surface in full, but no size and no
    /// direction.
    pub shift_sigma: f64,
    /// Prior standard deviation of the axis of the first guess, rad in each of two directions;
    /// `None`: no prior. A hole in thin metal has its axis from the plane around it.
    pub axis_sigma: Option<f64>,
    /// Errors that the stated deviations of the observations lack.
    pub noise: TouchNoise,
    /// Limit of outliers in standard deviations of the residual. 4 rejects one in 16000 good ones.
    pub rejection: f64,
}

impl Default for FitParams {
    fn default() -> Self {
        Self {
            common_sigma: 0.0,
            shift_sigma: 0.0,
            axis_sigma: None,
            noise: TouchNoise::default(),
            rejection: 4.0,
        }
    }
}

fn positive(what: &'static str, sigma: f64) -> Result<(), FitError> {
    if sigma > 0.0 && sigma.is_finite() {
        Ok(())
    } else {
        Err(FitError::BadSigma { what, sigma })
    }
}

impl FitParams {
    pub(super) fn check(&self) -> Result<(), FitError> {
        for (what, sigma) in [
            ("common_sigma", self.common_sigma),
            ("shift_sigma", self.shift_sigma),
            ("white noise", self.noise.white),
            ("wander", self.noise.wander),
            ("memory", self.noise.memory),
        ] {
            if !(sigma >= 0.0 && sigma.is_finite()) {
                return Err(FitError::BadSigma { what, sigma });
            }
        }
        positive("rejection", self.rejection)?;
        self.axis_sigma
            .map_or(Ok(()), |sigma| positive("axis_sigma", sigma))
    }
}

impl Observation {
    pub(super) fn check_all(observations: &[Observation]) -> Result<(), FitError> {
        for (index, o) in observations.iter().enumerate() {
            if !(o.point.coords.iter().all(|x| x.is_finite()) && o.offset.is_finite()) {
                return Err(FitError::NotFinite { index });
            }
            positive("sigma of an observation", o.sigma)?;
        }
        Ok(())
    }
}
