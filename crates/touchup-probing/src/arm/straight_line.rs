//! A straight line as velocities, one per state.

use nalgebra::Isometry3;

/// Share of the acceleration used for braking: the arm follows some milliseconds late.
const BRAKE: f64 = 0.7;
/// Maximum turn rate of the tip on a line, rad/s.
const TURN: f64 = 0.5;

/// Velocity of the tip towards a pose, m/s and rad/s in B: v = min(v_max, √(2 η a d), d/T) with d
/// the remaining distance; travel and turn end together.
///
/// - `speed`, `acceleration`: m/s and m/s².
/// - `settling`: T, s: a few times the delay from a state to the motion that answers it.
pub fn velocity_towards(
    from: &Isometry3<f64>,
    to: &Isometry3<f64>,
    [speed, acceleration]: [f64; 2],
    settling: f64,
) -> [f64; 6] {
    let left = to.translation.vector - from.translation.vector;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    let distance = left.norm();
    // share of the path in a second; at the end itself only the settling bounds it
    let share = (1.0 / settling)
        .min(speed / distance)
        .min((2.0 * BRAKE * acceleration / distance).sqrt())
        .min(TURN / turn.norm());
    let (linear, angular) = (left * share, turn * share);
    [
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn a_line_is_slower_near_its_end_and_straight() {
        let at = |x: f64, angle: f64| {
            Isometry3::from_parts(
                Vector3::new(x, 0.0, 0.0).into(),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
            )
        };
        let far = velocity_towards(&at(0.0, 0.0), &at(0.4, 0.0), [0.1, 0.5], 60e-3);
        assert_eq!(far, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
        // 10 mm before the end: from √(2 · 0.7 · 0.5 · 0.01) = 83.7 mm/s it can still stop
        let near = velocity_towards(&at(0.39, 0.0), &at(0.4, 0.0), [0.1, 0.5], 60e-3)[0];
        assert!((near - 0.083_666).abs() < 1e-6, "{near}");
        // half a millimetre: 0.5 / 60 ms
        assert!(
            (velocity_towards(&at(0.3995, 0.0), &at(0.4, 0.0), [0.1, 0.5], 60e-3)[0] - 8.333e-3)
                .abs()
                < 1e-6
        );
        assert_eq!(
            velocity_towards(&at(0.4, 0.0), &at(0.4, 0.0), [0.1, 0.5], 60e-3),
            [0.0; 6]
        );
        // one radian at 0.5 rad/s takes 2 s, as do the 20 mm
        let turning = velocity_towards(&at(0.0, 0.0), &at(0.02, 1.0), [0.1, 0.5], 60e-3);
        assert!(
            (turning[0] - 0.01).abs() < 1e-12 && (turning[5] - 0.5).abs() < 1e-12,
            "{turning:?}"
        );
    }
}
