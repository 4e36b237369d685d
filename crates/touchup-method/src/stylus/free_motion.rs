//! Free motion, as distinct from a light touch.
//!
//! Below the contact threshold the stylus may be free or press lightly. It counts as free only if
//! noise and zero error of the sensor explain both |F| and |F| smoothed over a short time, which
//! averages out noise but not a touch.

use nalgebra::Vector3;

use super::contact::LONGEST_HOLD;
use super::force_noise::ForceNoise;

/// Time constant of the smoothed force, s: reduces the noise to a sixth at 1 kHz.
const SMOOTHING: f64 = 0.02;
/// 99.9 % quantile of |F| of noise alone, in standard deviations of one axis: χ, three degrees.
const NOISE_SIGMAS: f64 = 4.03;

/// Nothing is free after a start or a gap until the variance of the smoothed force is within this
/// factor of its final value: 44 ms at 1 kHz.
const SETTLED: f64 = 1.5;

/// Decides whether the stylus is free, sample by sample.
#[derive(Clone, Debug)]
pub(super) struct FreeMotion {
    /// zero error of the sensor, N
    zero: f64,
    noise: ForceNoise,
    smoothed: Vector3<f64>,
    /// variance of the smoothed force for white noise of unit variance
    variance: f64,
    last: Option<Vector3<f64>>,
}

impl FreeMotion {
    pub(super) fn new(zero: f64) -> Self {
        Self {
            zero,
            noise: ForceNoise::new(),
            smoothed: Vector3::zeros(),
            variance: 1.0,
            last: None,
        }
    }

    /// Takes the next force without weight and bias, N, `dt` (s) after the previous one; returns
    /// whether the stylus is free.
    pub(super) fn update(&mut self, force: &Vector3<f64>, dt: f64) -> bool {
        let gain = match self.last {
            Some(last) if dt > 0.0 && dt <= LONGEST_HOLD => {
                self.noise.note(&last, force);
                -(-dt / SMOOTHING).exp_m1()
            }
            _ => 1.0,
        };
        self.last = Some(*force);
        // variance of the lag for white noise of unit variance: now, and its limit
        self.variance = (1.0 - gain).powi(2) * self.variance + gain * gain;
        let last_variance = gain / (2.0 - gain);
        let noise = NOISE_SIGMAS * self.noise.sigma();
        let largest = self.zero.hypot(noise);
        // capped, for a quick decay of a firm contact
        self.smoothed += (force.cap_magnitude(largest) - self.smoothed) * gain;
        let is_settled = gain < 1.0 && self.variance <= SETTLED * last_variance;
        is_settled
            && force.norm() <= largest
            && self.smoothed.norm() <= self.zero.hypot(noise * self.variance.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Number of free samples among 4000 at 1 kHz, after a second to learn the noise.
    fn free_of(force: Vector3<f64>, sigma: f64) -> usize {
        let (mut rng, mut free) = (rand_pcg::Pcg64::seed_from_u64(3), FreeMotion::new(0.15));
        let mut noise = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng)) * sigma;
        (0..5000)
            .filter(|&ms| free.update(&(force + noise()), 1e-3) && ms >= 1000)
            .count()
    }

    #[test]
    fn noise_and_a_zero_that_is_off_are_free() {
        for sigma in [0.0, 0.005, 0.05, 0.1] {
            for zero in [0.0, 0.1] {
                let free = free_of(Vector3::new(0.0, zero, 0.0), sigma);
                assert!(
                    free >= 3920,
                    "{free} of 4000 at a noise of {sigma} N and a zero of {zero} N"
                );
            }
        }
    }

    #[test]
    fn a_light_touch_in_the_noise_is_not_free() {
        for sigma in [0.0, 0.005, 0.05, 0.1] {
            let free = free_of(Vector3::new(0.05, -0.1, 0.2), sigma);
            assert_eq!(free, 0, "at a noise of {sigma} N");
        }
    }

    #[test]
    fn a_light_touch_is_told_at_its_first_sample_by_a_quiet_sensor() {
        let mut free = FreeMotion::new(0.15);
        let starts = (0..2000)
            .filter(|_| !free.update(&Vector3::zeros(), 1e-3))
            .count();
        assert!(
            (40..50).contains(&starts),
            "{starts} ms until anything is free"
        );
        assert!(!free.update(&Vector3::new(0.0, 0.0, 0.2), 1e-3));
    }
}
