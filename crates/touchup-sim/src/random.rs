//! Random numbers, and drift: slow, smooth random change of a hand-held stylus or of a sensor's
//! bias.

use nalgebra::{Point3, Vector3};
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;

/// Waves in one [`Drift`]: with five the sum is close to Gaussian and does not visibly repeat.
const WAVES: usize = 5;
/// Waves in one [`SmoothField`].
const FIELD_WAVES: usize = 32;

/// A smooth random function of time with mean 0 and root mean square 1: a few waves of random
/// frequency and phase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drift {
    /// rad/s and rad
    waves: [(f64, f64); WAVES],
}

impl Drift {
    /// - `period`: of the middle wave, s; the others lie within a factor of two.
    pub(super) fn new(period: f64, rng: &mut Pcg64) -> Self {
        let mut share = || uniform(rng, [0.0, 1.0]);
        let turn = std::f64::consts::TAU;
        Self {
            waves: [(); WAVES]
                .map(|()| (turn / period * (2.0 * share() - 1.0).exp2(), turn * share())),
        }
    }

    /// Value at time `t` (s).
    pub(super) fn at(&self, t: f64) -> f64 {
        // each wave has mean square 1/2
        self.waves
            .iter()
            .map(|(rate, phase)| (rate * t + phase).sin())
            .sum::<f64>()
            * (2.0 / WAVES as f64).sqrt()
    }
}

/// A smooth random function of place with mean 0 and root mean square 1: waves with random
/// directions, so that values correlate as exp(−r²/2ℓ²).
#[derive(Clone, Debug)]
pub(super) struct SmoothField {
    /// 1/m and rad
    waves: [(Vector3<f64>, f64); FIELD_WAVES],
}

impl SmoothField {
    /// - `length`: correlation length ℓ, m.
    pub(super) fn new(length: f64, rng: &mut Pcg64) -> Self {
        let mut wave = || {
            (
                gauss_vector(rng) / length,
                std::f64::consts::TAU * uniform(rng, [0.0, 1.0]),
            )
        };
        Self {
            waves: [(); FIELD_WAVES].map(|()| wave()),
        }
    }

    /// Value at `p` (m).
    pub(super) fn at(&self, p: &Point3<f64>) -> f64 {
        // each wave has mean square 1/2
        self.waves
            .iter()
            .map(|(k, phase)| (k.dot(&p.coords) + phase).sin())
            .sum::<f64>()
            * (2.0 / FIELD_WAVES as f64).sqrt()
    }
}

/// One draw from the standard normal distribution.
pub(super) fn gauss(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// Three draws from the standard normal distribution.
pub(super) fn gauss_vector(rng: &mut Pcg64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| gauss(rng))
}

/// One draw between two numbers, all equally likely.
pub(super) fn uniform(rng: &mut Pcg64, [low, high]: [f64; 2]) -> f64 {
    let share: f64 = StandardUniform.sample(rng);
    low + (high - low) * share
}
