//! Noise of a force sensor, from the steps between its readings: a change from one sample to the
//! next is noise, a lasting one is not.

use nalgebra::Vector3;

use touchup_geometry::numeric::RunningMedian;

/// Median of |F₁ − F₀| of two readings of unit noise per axis: √2 times the median of χ with three
/// degrees.
const STEP_PER_SIGMA: f64 = 2.175;
/// Lower bound of the steps, N.
const LEAST_STEP: f64 = 1e-4;
/// Initial step, N.
const USUAL_STEP: f64 = 0.1;

/// Tracks the noise of a stream of forces.
#[derive(Clone, Debug)]
pub(crate) struct ForceNoise {
    step: RunningMedian,
}

impl ForceNoise {
    /// Noise of a usual sensor.
    pub(crate) fn new() -> Self {
        Self {
            step: RunningMedian {
                length: USUAL_STEP,
                least: LEAST_STEP,
            },
        }
    }

    /// Takes two successive readings, N.
    pub(crate) fn note(&mut self, before: &Vector3<f64>, now: &Vector3<f64>) {
        self.step
            .note((now - before).norm_squared() > self.step.length * self.step.length);
    }

    /// Standard deviation per axis, N.
    pub(crate) fn sigma(&self) -> f64 {
        self.step.length / STEP_PER_SIGMA
    }
}
