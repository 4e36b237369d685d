//! Free motion, told from a light touch.
//!
//! Below the threshold of contact a stylus may be free, or press lightly. Only a force that noise
//! and zero of the sensor explain is free motion: |F| itself, and |F| smoothed over a short time,
//! in which noise averages out and a touch does not.

use nalgebra::Vector3;

use super::contact::LONGEST_HOLD;
use super::force_noise::ForceNoise;

/// Time constant of the smoothed force, s: at 1 kHz its noise is a sixth.
const SMOOTHING: f64 = 0.02;
/// |F| of noise alone is below so many standard deviations of one axis in 999 of 1000 samples: χ with three degrees.
const NOISE_SIGMAS: f64 = 4.03;

/// After a start or a gap nothing is free until the variance of the smoothed force is so many times
/// that which it ends at: 44 ms at 1 kHz.
const SETTLED: f64 = 1.5;

/// Decides whether the stylus is free, sample by sample.
#[derive(Clone, Debug)]
pub(super) struct FreeMotion {
    /// what the zero of the sensor may be off by, N
    zero: f64,
    noise: ForceNoise,
    smoothed: Vector3<f64>,
    /// of it, of white noise of unit variance
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

    /// Takes the next force without weight and bias, N, `dt` (s) after the one before; returns
    /// whether nothing is touched.
    pub(super) fn update(&mut self, force: &Vector3<f64>, dt: f64) -> bool {
        let gain = match self.last {
            Some(last) if dt > 0.0 && dt <= LONGEST_HOLD => {
                self.noise.note(&last, force);
                -(-dt / SMOOTHING).exp_m1()
            }
            _ => 1.0,
        };
        self.last = Some(*force);
        // of the lag of white noise of unit variance: so far, and in the end
        self.variance = (1.0 - gain).powi(2) * self.variance + gain * gain;
        let last_variance = gain / (2.0 - gain);
        let noise = NOISE_SIGMAS * self.noise.sigma();
        let largest = self.zero.hypot(noise);
        // cut off there, so that a firm contact is soon forgotten
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

    /// How many of 4000 samples at 1 kHz are free, after a second to learn the noise.
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
