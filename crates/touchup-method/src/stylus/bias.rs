//! Slow drift of a force sensor, followed in free air.
//!
//! In free air a sensor reads, less weight and bias, its drift alone: d b/dt = (f − b) / T. A light
//! contact looks the same, so only lasting free motion counts, and the bias forgets the start of a
//! contact: at the end of free motion, it returns to its value before the last settling time.

use nalgebra::Vector3;

use super::{SettingError, Tip};
use crate::parameters;

parameters! {
    /// Settings of a [`BiasTracker`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct BiasParams in "bias_tracking" {
        /// Time of free motion (contact.free_n) before the tracking begins; a contact discards the
        /// drift tracked in this time before it.
        ///
        /// In ns. A hand rises to 0.3 N and falls from it within 10 ms.
        settle_ns: i64 = 60.0, "settle_ms" [MS, 0.001, 60000];
        /// Time constant of the running mean of the bias.
        ///
        /// In s. A noise of 0.05 N at 1 kHz becomes 2 mN; the bias lags a drift of 10 mN/s by 3 mN.
        time: f64 = 0.3, "time_s" [S, 1e-6, 1e6];
    }
}

/// Follows the bias of the force in the axes of the stylus, in which a sensor fixed to it drifts.
/// Never finds an initial bias beyond the limit of free motion: subtract it by
/// [`super::CompensatorParams::bias_s`].
///
/// # Example
/// ```
/// # use touchup_method::stylus::{BiasParams, BiasTracker, Tip};
/// # use nalgebra::{Isometry3, Vector3};
/// let mut tracker = BiasTracker::new(BiasParams::default())?;
/// let drift = Vector3::new(0.1, 0.0, -0.05);
/// for ms in 0..3000 {
///     let free = Tip { stamp_ns: ms * 1_000_000, pose_ot: Isometry3::identity(), force_o: drift, torque_o: Vector3::zeros() };
///     tracker.compensate(&free, |rest| rest.norm() < 0.15);
/// }
/// assert!((tracker.bias_t() - drift).norm() < 1e-4);
/// # Ok::<(), touchup_method::stylus::SettingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct BiasTracker {
    params: BiasParams,
    bias_t: Vector3<f64>,
    /// bias at the start of the current span of a settling time, and of the previous one
    began_t: [Vector3<f64>; 2],
    span_ns: i64,
    free_since_ns: Option<i64>,
    last_ns: i64,
}

impl BiasTracker {
    /// A tracker without a bias.
    ///
    /// # Errors
    /// [`SettingError`] unless all settings are more than 0.
    pub fn new(params: BiasParams) -> Result<Self, SettingError> {
        params.check()?;
        let zero = Vector3::zeros();
        Ok(Self {
            params,
            bias_t: zero,
            began_t: [zero; 2],
            span_ns: 0,
            free_since_ns: None,
            last_ns: 0,
        })
    }

    /// Force of the next tip without the bias, N, in O.
    ///
    /// - `tip`: later than the previous one.
    /// - `is_free`: whether a force without the bias, N, means free motion.
    #[inline]
    pub fn compensate(
        &mut self,
        tip: &Tip,
        is_free: impl FnOnce(&Vector3<f64>) -> bool,
    ) -> Vector3<f64> {
        let rotation = &tip.pose_ot.rotation;
        let rest_t = rotation.inverse_transform_vector(&tip.force_o) - self.bias_t;
        let since_last_ns = tip.stamp_ns.saturating_sub(self.last_ns);
        self.last_ns = tip.stamp_ns;
        if !is_free(&rest_t) {
            self.touch();
        } else {
            // events in a long pause are unknown
            let paused = since_last_ns > self.params.settle_ns;
            let since_ns = *self.free_since_ns.get_or_insert(tip.stamp_ns);
            if paused {
                self.free_since_ns = Some(tip.stamp_ns);
            } else if tip.stamp_ns.saturating_sub(since_ns) >= self.params.settle_ns {
                self.learn(tip.stamp_ns, &rest_t, since_last_ns as f64 * 1e-9);
            }
        }
        tip.force_o - rotation * self.bias_t
    }

    /// Estimated reading of the sensor in free air, in the axes of T, N.
    pub fn bias_t(&self) -> Vector3<f64> {
        self.bias_t
    }

    fn learn(&mut self, stamp_ns: i64, rest_t: &Vector3<f64>, dt: f64) {
        if stamp_ns.saturating_sub(self.span_ns) >= self.params.settle_ns {
            self.began_t = [self.began_t[1], self.bias_t];
            self.span_ns = stamp_ns;
        }
        // exact step of the first-order lag, for any length
        self.bias_t -= rest_t * (-dt / self.params.time).exp_m1();
    }

    /// Discards the last part of free air, which may have been the contact already.
    fn touch(&mut self) {
        self.free_since_ns = None;
        self.bias_t = self.began_t[0];
        self.began_t[1] = self.bias_t;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;

    const MS: i64 = 1_000_000;

    fn tip(ms: i64, rotation: UnitQuaternion<f64>, force_o: Vector3<f64>) -> Tip {
        let pose_ot = Isometry3::from_parts(Vector3::new(0.1, 0.2, 0.3).into(), rotation);
        Tip {
            stamp_ns: ms * MS,
            pose_ot,
            force_o,
            torque_o: Vector3::zeros(),
        }
    }

    fn is_below(rest: &Vector3<f64>) -> bool {
        rest.norm() < 0.3
    }

    fn tracker() -> BiasTracker {
        BiasTracker::new(BiasParams::default()).unwrap()
    }

    /// A constant force in free air: b(t) = f (1 − e^(−(t − 59 ms)/T)); the step at 60 ms already
    /// holds 1 ms.
    #[test]
    fn a_constant_drift_is_approached_exponentially() {
        let drift = Vector3::new(0.1, -0.05, 0.2);
        let mut tracker = tracker();
        for ms in 0..=1000 {
            let rest = tracker.compensate(&tip(ms, UnitQuaternion::identity(), drift), is_below);
            let share = if ms < 60 {
                0.0
            } else {
                1.0 - (-((ms - 59) as f64) * 1e-3 / 0.3).exp()
            };
            assert!((tracker.bias_t() - drift * share).norm() < 1e-12, "{ms} ms");
            assert_eq!(rest, drift - tracker.bias_t());
        }
    }

    /// The bias lags a ramp of slope s by s T: the steady state of a first-order lag.
    #[test]
    fn a_drift_in_the_axes_of_the_stylus_is_followed_while_it_turns() {
        let (slope, time) = (Vector3::new(0.01, 0.0, -0.02), 0.3);
        let mut tracker = tracker();
        for ms in 0..8000 {
            let t = ms as f64 * 1e-3;
            let rotation = UnitQuaternion::from_euler_angles(0.7 * t, -0.4 * t, 1.1 * t);
            let rest_o = tracker.compensate(&tip(ms, rotation, rotation * (slope * t)), is_below);
            if ms > 4000 {
                assert!(
                    (rest_o - rotation * (slope * time)).norm() < 1e-4,
                    "{rest_o}"
                );
            }
        }
    }

    /// Presses of 2 N that rise and fall in 10 to 40 ms. In 14 s, 6 s of free air count: e^(−20).
    #[test]
    fn contacts_leave_no_trace() {
        let drift = Vector3::new(0.03, -0.02, 0.04);
        let mut tracker = tracker();
        for ms in 0..20_000_i64 {
            let (turn, within) = (ms / 1000, ms % 1000);
            let ramp = 10 + turn * 30 / 20;
            let level = ((within - 600).min(1000 - within).clamp(0, ramp)) as f64 / ramp as f64;
            tracker.compensate(
                &tip(
                    ms,
                    UnitQuaternion::identity(),
                    drift + Vector3::z() * (2.0 * level),
                ),
                is_below,
            );
            if ms > 14_000 && level > 0.5 {
                assert!(
                    (tracker.bias_t() - drift).norm() < 1e-6,
                    "{ms} ms: {}",
                    tracker.bias_t()
                );
            }
        }
    }

    #[test]
    fn a_long_contact_and_a_large_bias_are_not_learnt() {
        for force in [2.0, 0.3] {
            let mut tracker = tracker();
            for ms in 0..5000 {
                tracker.compensate(
                    &tip(ms, UnitQuaternion::identity(), Vector3::z() * force),
                    is_below,
                );
            }
            assert_eq!(tracker.bias_t(), Vector3::zeros());
        }
    }

    #[test]
    fn one_sample_after_a_pause_does_not_count_for_all_of_it() {
        let mut tracker = tracker();
        for ms in 0..2000 {
            tracker.compensate(
                &tip(ms, UnitQuaternion::identity(), Vector3::x() * 0.1),
                is_below,
            );
        }
        let before = tracker.bias_t();
        tracker.compensate(
            &tip(60_000, UnitQuaternion::identity(), Vector3::x() * -0.15),
            is_below,
        );
        assert_eq!(tracker.bias_t(), before);
    }

    #[test]
    fn settings_without_a_meaning_are_refused() {
        let good = BiasParams::default();
        for bad in [
            BiasParams {
                settle_ns: -1,
                ..good
            },
            BiasParams {
                time: f64::NAN,
                ..good
            },
            BiasParams {
                settle_ns: 0,
                ..good
            },
            BiasParams { time: -1.0, ..good },
        ] {
            assert!(BiasTracker::new(bad).is_err(), "{bad:?}");
        }
    }
}
