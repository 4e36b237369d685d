//! The normal distribution: distribution function, quantile, and share of a round one inside a
//! circle.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Start of the tail with the continued fraction: its 60 terms are exact to the last digit there,
/// and the series still is.
const TAIL: f64 = 3.5;

/// Density of the standard normal distribution.
fn normal_density(z: f64) -> f64 {
    (-0.5 * z * z).exp() * FRAC_1_SQRT_2 / PI.sqrt()
}

/// Distribution function Φ of the standard normal distribution: a series about 0, the continued
/// fraction of the tail beyond [Abramowitz and Stegun 1964, 26.2.11 and 26.2.14]. Absolute error
/// below 1e-15; in the tails as many digits.
pub fn normal_cdf(z: f64) -> f64 {
    if z.is_nan() {
        return f64::NAN;
    }
    if z < -TAIL {
        return upper_tail(-z);
    }
    if z > TAIL {
        return 1.0 - upper_tail(z);
    }
    let (mut term, mut sum, mut odd) = (z, z, 1.0);
    while term.abs() > sum.abs() * f64::EPSILON {
        odd += 2.0;
        term *= z * z / odd;
        sum += term;
    }
    0.5 + normal_density(z) * sum
}

/// 1 − Φ in the upper tail.
fn upper_tail(z: f64) -> f64 {
    if z > 40.0 {
        return 0.0;
    }
    let fraction = (1..=60).rev().fold(z, |below, k| z + f64::from(k) / below);
    normal_density(z) / fraction
}

/// The z with Φ(z) = `share`, by bisection; infinite at 0 and 1.
///
/// - `share`: 0 to 1.
pub fn normal_quantile(share: f64) -> f64 {
    if share <= 0.0 {
        return f64::NEG_INFINITY;
    }
    if share >= 1.0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (-40.0, 40.0);
    for _ in 0..80 {
        let middle = f64::midpoint(low, high);
        if normal_cdf(middle) < share {
            low = middle
        } else {
            high = middle
        }
    }
    f64::midpoint(low, high)
}

/// Probability that a point of a round normal distribution lies within a circle, by Simpson's rule
/// across the circle.
///
/// - `off`: distance between the centres of distribution and circle, 0 or more.
/// - `std`: of one coordinate, more than 0.
/// - `radius`: of the circle, in the same unit.
pub fn circle_probability(off: f64, std: f64, radius: f64) -> f64 {
    /// Range of integration, in standard deviations on either side: the rest is less than a
    /// rounding.
    const REACH: f64 = 9.0;
    /// Steps, even: 0.02 standard deviations each.
    const STEPS: u32 = 1000;
    let low = (off - REACH * std).max(-radius);
    let high = (off + REACH * std).min(radius);
    if radius <= 0.0 || low >= high {
        return 0.0;
    }
    // x = radius sin(angle): the width of the circle is smooth at its ends
    let [from, to] = [low, high].map(|x| (x / radius).asin());
    let step = (to - from) / f64::from(STEPS);
    let at = |index: u32| {
        let (sine, cosine) = (from + step * f64::from(index)).sin_cos();
        let within = 2.0 * normal_cdf(radius * cosine.max(0.0) / std) - 1.0;
        normal_density((radius * sine - off) / std) / std * within * radius * cosine.max(0.0)
    };
    let weight = |index: u32| match index {
        0 | STEPS => 1.0,
        index if index % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=STEPS).map(|index| weight(index) * at(index)).sum();
    (sum * step / 3.0).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables: NIST/SEMATECH e-Handbook 1.3.6.7.1 to its digits, and the error function rounded
    /// from 50 digits.
    #[test]
    fn the_distribution_function_has_the_digits_of_tables() {
        let table = [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_542_9),
            (1.645, 0.950_015_094_460_878_7),
            (-1.96, 0.024_997_895_148_220_43),
            (3.0, 0.998_650_101_968_369_9),
            (-6.0, 9.865_876_450_376_98e-10),
        ];
        for (z, expected) in table {
            assert!(
                (normal_cdf(z) - expected).abs() < 4e-16 + 1e-12 * expected,
                "{z}: {}",
                normal_cdf(z)
            );
        }
        assert_eq!(
            (normal_cdf(f64::INFINITY), normal_cdf(f64::NEG_INFINITY)),
            (1.0, 0.0)
        );
    }

    #[test]
    fn series_and_continued_fraction_meet() {
        let [below, above] = [TAIL, TAIL + 1e-12].map(|z| normal_cdf(-z));
        assert!((below / above - 1.0).abs() < 1e-10, "{below} {above}");
    }

    #[test]
    fn the_quantile_inverts_the_distribution_function() {
        assert!((normal_quantile(0.95) - 1.644_853_626_951_472_2).abs() < 1e-12);
        assert!((normal_quantile(0.5)).abs() < 1e-15);
        for share in [1e-12, 0.01, 0.3, 0.77, 0.999] {
            assert!(
                (normal_cdf(normal_quantile(share)) / share - 1.0).abs() < 1e-9,
                "{share}"
            );
        }
        assert_eq!(
            (normal_quantile(0.0), normal_quantile(1.0)),
            (f64::NEG_INFINITY, f64::INFINITY)
        );
    }

    /// About the middle it is Rayleigh's distribution, and for a circle much larger than the spread
    /// a half-plane.
    #[test]
    fn a_circle_holds_what_closed_forms_say() {
        for ratio in [0.01, 0.5, 1.0, 3.0, 7.0] {
            let rayleigh = 1.0 - (-0.5f64 * ratio * ratio).exp();
            assert!(
                (circle_probability(0.0, 2.0, 2.0 * ratio) - rayleigh).abs() < 1e-10,
                "{ratio}"
            );
        }
        let half_plane = normal_cdf(1.0);
        assert!((circle_probability(1e4 - 1.0, 1.0, 1e4) - half_plane).abs() < 1e-4);
        assert_eq!(circle_probability(20.0, 1.0, 5.0), 0.0);
    }
}
