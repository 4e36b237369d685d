//! Position and velocity of the ball from the positions around one instant.
//!
//! Least-squares parabola in time through the positions of a window: unlike a mean it does not cut
//! corners. The window is as long as the path fits a parabola within the noise of the positions.

use nalgebra::{Matrix3, Point3, Vector3};

/// Sums over a window about an instant, sufficient for the parabola. A longer window extends a
/// shorter one.
#[derive(Clone, Debug)]
pub(crate) struct LocalMotion {
    /// unit of time of the sums, s
    scale: f64,
    middle: Point3<f64>,
    /// Σ uⁱ
    powers: [f64; 5],
    /// Σ uⁱ (x − x₀)
    moments: [Vector3<f64>; 3],
    /// Σ |x − x₀|²
    squares: f64,
}

/// Position and velocity of the ball at the instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SmoothedMotion {
    /// m, in O
    pub centre: Point3<f64>,
    /// m/s, in O
    pub velocity: Vector3<f64>,
    /// variance of a component of the centre for position errors of 1 m, m²
    pub centre_gain: f64,
    /// standard deviation of a component of the velocity for position errors of 1 m, 1/s
    pub velocity_gain: f64,
    /// standard deviation of a position component from the parabola, m
    pub residual: f64,
}

impl LocalMotion {
    /// An empty window.
    ///
    /// - `middle`: the position at the instant, m, in O.
    /// - `scale`: a time about as long as half the longest window, s; more than 0.
    pub(crate) fn new(middle: Point3<f64>, scale: f64) -> Self {
        Self {
            scale,
            middle,
            powers: [0.0; 5],
            moments: [Vector3::zeros(); 3],
            squares: 0.0,
        }
    }

    /// Adds the position `after` (s) the instant.
    #[inline]
    pub(crate) fn add(&mut self, after: f64, position: &Point3<f64>) {
        let u = after / self.scale;
        let arm = position - self.middle;
        let mut power = 1.0;
        for (i, sum) in self.powers.iter_mut().enumerate() {
            *sum += power;
            if let Some(moment) = self.moments.get_mut(i) {
                *moment += arm * power;
            }
            power *= u;
        }
        self.squares += arm.norm_squared();
    }

    /// Parabola at the instant; for too few positions their mean, at rest and with no bound on its
    /// error.
    pub(crate) fn motion(&self) -> SmoothedMotion {
        let [n, u, u2, u3, u4] = self.powers;
        let parabola = (n > 3.0)
            .then(|| Matrix3::new(n, u, u2, u, u2, u3, u2, u3, u4).try_inverse())
            .flatten();
        let Some(inverse) = parabola else {
            let centre = self.middle + self.moments[0] / n.max(1.0);
            let velocity = Vector3::zeros();
            let (centre_gain, residual) = (1.0 / n.max(1.0), f64::INFINITY);
            return SmoothedMotion {
                centre,
                velocity,
                centre_gain,
                velocity_gain: f64::INFINITY,
                residual,
            };
        };
        let [m0, m1, m2] = &self.moments;
        let [a, b, c] = [0, 1, 2]
            .map(|row| m0 * inverse[(row, 0)] + m1 * inverse[(row, 1)] + m2 * inverse[(row, 2)]);
        let explained = a.dot(m0) + b.dot(m1) + c.dot(m2);
        SmoothedMotion {
            centre: self.middle + a,
            velocity: b / self.scale,
            centre_gain: inverse[(0, 0)].max(0.0),
            velocity_gain: inverse[(1, 1)].max(0.0).sqrt() / self.scale,
            residual: ((self.squares - explained).max(0.0) / (3.0 * (n - 3.0))).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_exactly_and_its_errors_are_those_of_least_squares() {
        let at = |t: f64| Point3::new(0.02 * t, 0.5 * t * t, 1e-3 + 0.01 * t - 0.3 * t * t);
        let mut sums = LocalMotion::new(at(0.1), 0.016);
        (-16..=16).for_each(|i| sums.add(f64::from(i) * 1e-3, &at(0.1 + f64::from(i) * 1e-3)));
        let motion = sums.motion();
        assert!((motion.centre - at(0.1)).norm() < 1e-15);
        assert!((motion.velocity - Vector3::new(0.02, 0.1, 0.01 - 0.06)).norm() < 1e-12);
        assert!(motion.residual < 1e-10);
        // in a window as long before as after, the slope varies by σ / √Σ t²
        let squares: f64 = (-16..=16).map(|i| (f64::from(i) * 1e-3).powi(2)).sum();
        assert!((motion.velocity_gain * squares.sqrt() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn three_positions_give_no_velocity() {
        let mut sums = LocalMotion::new(Point3::origin(), 0.016);
        (0..3).for_each(|i| sums.add(f64::from(i) * 1e-3, &Point3::new(f64::from(i), 0.0, 0.0)));
        let motion = sums.motion();
        assert_eq!((motion.velocity, motion.centre.x), (Vector3::zeros(), 1.0));
        assert!(motion.velocity_gain.is_infinite() && motion.residual.is_infinite());
    }
}
