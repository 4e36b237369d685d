//! Measured speeds of an arm: of its tip and of each of its joints.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::interface::ArmState;
use super::joints::Joints;
use super::limits::{LimitError, Limits};

/// Periods in a mean speed: the noise of a position is then 1 mm/s.
const WINDOW: usize = 10;
/// Allowed tip speed over its limit, as a factor and an addition, m/s: overshoot of the arm, and
/// noise.
const OVER: (f64, f64) = (1.2, 5e-3);

/// Latest states of an arm.
#[derive(Clone, Debug, Default)]
pub(super) struct MeasuredMotion {
    /// stamp in ns, position of the tip in B in m, joints in rad
    recent: VecDeque<(i64, Vector3<f64>, Joints)>,
}

impl MeasuredMotion {
    /// Takes a state, and checks its speeds.
    ///
    /// # Errors
    /// [`LimitError::Speed`], [`LimitError::JointSpeed`]; also for NaN.
    pub(crate) fn take(&mut self, state: &ArmState, limits: &Limits) -> Result<(), LimitError> {
        let place = state.pose_bt.translation.vector;
        self.recent.push_back((state.stamp_ns, place, state.joints));
        if self.recent.len() <= WINDOW {
            return Ok(());
        }
        let Some((begun_ns, from, joints)) = self.recent.pop_front() else {
            return Ok(());
        };
        let seconds = (state.stamp_ns - begun_ns) as f64 * 1e-9;
        let speed = (place - from).norm() / seconds;
        // NaN is over every limit
        if speed.is_nan() || speed > limits.speed * OVER.0 + OVER.1 {
            return Err(LimitError::Speed {
                mm_per_s: speed * 1e3,
                limit_mm_per_s: limits.speed * 1e3,
            });
        }
        for (joint, (now, before)) in (1..).zip(state.joints.iter().zip(joints.iter())) {
            let turning = (now - before).abs() / seconds;
            if turning.is_nan() || turning > limits.joint_speed {
                let (deg_per_s, limit_deg_per_s) =
                    (turning.to_degrees(), limits.joint_speed.to_degrees());
                return Err(LimitError::JointSpeed {
                    joint,
                    deg_per_s,
                    limit_deg_per_s,
                });
            }
        }
        Ok(())
    }

    /// Forgets past states: the next ones need not follow them.
    pub(crate) fn forget(&mut self) {
        self.recent.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Safety;
    use nalgebra::Isometry3;
    use touchup_method::stylus::Wrench;

    /// First verdict on states 2 ms apart, of a tip and a third joint with these speeds, m/s and
    /// rad/s, and the number of states.
    fn moving(speed: f64, turning: f64) -> (usize, Option<LimitError>) {
        let (mut motion, limits) = (
            MeasuredMotion::default(),
            Limits {
                speed: 0.1,
                joint_speed: 1.5,
                ..Limits::default()
            },
        );
        for number in 0..50 {
            let seconds = number as f64 * 2e-3;
            let nothing = Wrench {
                force: Vector3::zeros(),
                torque: Vector3::zeros(),
            };
            let state = ArmState {
                stamp_ns: number * 2_000_000,
                pose_bt: Isometry3::translation(0.3, -speed * seconds, 0.1),
                wrench_b: nothing,
                raw_wrench_f: nothing,
                joints: [0.0, -1.6, 1.6 + turning * seconds, -1.6, -1.6, 0.0].into(),
                safety: Safety::Normal,
            };
            if let Err(error) = motion.take(&state, &limits) {
                return (number as usize + 1, Some(error));
            }
        }
        (50, None)
    }

    #[test]
    fn a_tip_and_a_joint_over_their_limits_are_seen_within_22_ms_and_others_are_not() {
        assert_eq!(moving(0.1, 1.4), (50, None));
        assert_eq!(moving(0.12, 0.0), (50, None));
        let (states, error) = moving(0.2, 0.0);
        assert_eq!(states, 11);
        assert_eq!(
            error.unwrap().to_string(),
            "the tip moves with 200 mm/s, over the limit of 100 mm/s"
        );
        let (states, error) = moving(0.0, -2.0);
        assert_eq!(states, 11);
        assert_eq!(
            error.unwrap().to_string(),
            "joint 3 turns with 115°/s, over the limit of 86°/s"
        );
        assert!(moving(f64::NAN, 0.0).1.is_some() && moving(0.0, f64::NAN).1.is_some());
    }
}
