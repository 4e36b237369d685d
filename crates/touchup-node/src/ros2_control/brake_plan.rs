//! An order as a short trajectory that ends at rest.
//!
//! joint_trajectory_controller continues the newest trajectory from its own set point, and holds
//! its last point. So each order goes to the desired velocity, keeps it for [`HOLD`], and goes to
//! rest. The next order replaces it long before that; if none comes, as this process has died, the
//! arm brakes by itself. The points have velocities but no positions, so the controller integrates
//! from its current position: it cannot jump, however late the order comes.

use nalgebra::SVector;

use crate::ros::messages::{Duration, Header, JointTrajectory, JointTrajectoryPoint};
use touchup_probing::arm::{Joints, MOST_JOINTS};

/// Duration of a velocity without a further order, s: longer than the allowed silence of states.
pub(super) const HOLD: f64 = 60e-3;

/// Joint velocities, rad/s, linear between points; at rest after the last.
#[derive(Clone, Debug)]
pub(super) struct BrakePlan {
    begin: Joints,
    /// time after the order, s, and velocities, rad/s
    points: Vec<(f64, Joints)>,
}

impl BrakePlan {
    /// Plan of an arm at rest.
    pub fn rest(count: usize) -> Option<Self> {
        Some(Self {
            begin: Joints::of(&[0.0; MOST_JOINTS][..count.min(MOST_JOINTS)])?,
            points: Vec::new(),
        })
    }

    /// Plan from a velocity to another, which lasts for [`HOLD`], and to rest.
    ///
    /// - `ramp`, `brake`: durations of the two changes, s, above zero.
    pub fn going(from: Joints, to: Joints, ramp: f64, brake: f64) -> Self {
        let still = to.mapped(|_, _| 0.0);
        Self {
            begin: from,
            points: vec![(ramp, to), (ramp + HOLD, to), (ramp + HOLD + brake, still)],
        }
    }

    /// Plan from a velocity to rest.
    pub fn stopping(from: Joints, ramp: f64) -> Self {
        Self {
            begin: from,
            points: vec![(ramp, from.mapped(|_, _| 0.0))],
        }
    }

    /// Joint velocities at a time (s) after the order, rad/s.
    pub fn velocity(&self, after: f64) -> Joints {
        let mut before = (0.0, self.begin);
        for &(at, velocity) in &self.points {
            if after < at {
                let share = ((after - before.0) / (at - before.0)).max(0.0);
                return before
                    .1
                    .mapped(|joint, rate| rate + (velocity[joint] - rate) * share);
            }
            before = (at, velocity);
        }
        if self.points.is_empty() {
            self.begin
        } else {
            before.1
        }
    }

    /// Travel of the joints between two times after the order, rad, from the velocity at their
    /// middle: near enough for short times, as the velocity is linear between points.
    pub fn way(&self, from: f64, to: f64) -> SVector<f64, MOST_JOINTS> {
        let middle = self.velocity(f64::midpoint(from, to));
        let mut way = SVector::zeros();
        middle
            .iter()
            .enumerate()
            .for_each(|(joint, rate)| way[joint] = rate * (to - from));
        way
    }

    /// The message: its trajectory begins on arrival.
    pub fn message(&self, names: &[std::sync::Arc<str>]) -> JointTrajectory {
        let point = |&(at, velocity): &(f64, Joints)| JointTrajectoryPoint {
            velocities: velocity.to_vec(),
            time_from_start: length(at),
            ..JointTrajectoryPoint::default()
        };
        JointTrajectory {
            header: Header::default(),
            joint_names: names.iter().map(ToString::to_string).collect(),
            points: self.points.iter().map(point).collect(),
        }
    }
}

fn length(seconds: f64) -> Duration {
    let ns = (seconds * 1e9).round() as i64;
    Duration {
        sec: (ns / 1_000_000_000) as i32,
        nanosec: (ns % 1_000_000_000) as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 0.2 rad/s after 0.1 s, for 60 ms, at rest 40 ms later.
    #[test]
    fn an_order_ends_at_rest_whatever_it_is() {
        let plan = BrakePlan::going([0.0; 6].into(), [0.2; 6].into(), 0.1, 0.04);
        let at = |after| plan.velocity(after)[0];
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(
            near(at(0.05), 0.1) && near(at(0.13), 0.2) && near(at(0.18), 0.1),
            "{plan:?}"
        );
        assert_eq!((at(0.2), at(9.0)), (0.0, 0.0));
        let message = plan.message(&["a".into()]);
        let last = message.points.last().unwrap();
        assert_eq!(
            (&last.velocities[..], last.time_from_start.nanosec),
            (&[0.0; 6][..], 200_000_000)
        );
        assert!(
            message
                .points
                .iter()
                .all(|point| point.positions.is_empty())
        );
        let stop = BrakePlan::stopping(plan.velocity(0.13), 0.02).message(&["a".into()]);
        assert_eq!((stop.points.len(), stop.points[0].velocities[0]), (1, 0.0));
    }
}
