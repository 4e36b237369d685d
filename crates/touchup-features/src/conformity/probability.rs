//! The probability that a characteristic conforms.

use crate::features::InspectedQuantity;
use touchup_geometry::numeric::{circle_probability, normal_cdf};

/// Tolerance limits, both included; `None`: no limit on that side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToleranceLimits {
    /// T_L
    pub lower: Option<f64>,
    /// T_U
    pub upper: Option<f64>,
}

impl ToleranceLimits {
    /// Limits of a nominal value and its limit deviations, with the decimals of these: 6.1 and
    /// −0.03 make 6.07, even if their binary fractions add up to 6.069999999999999.
    pub fn about(nominal: f64, lower: Option<f64>, upper: Option<f64>) -> Self {
        let limit = |deviation: f64| {
            let decimals = decimals(nominal).max(decimals(deviation));
            let sum = nominal + deviation;
            format!("{sum:.decimals$}").parse().unwrap_or(sum)
        };
        Self {
            lower: lower.map(limit),
            upper: upper.map(limit),
        }
    }

    /// Whether a value is within the limits.
    pub(crate) fn hold(&self, value: f64) -> bool {
        self.lower.is_none_or(|lower| value >= lower)
            && self.upper.is_none_or(|upper| value <= upper)
    }
}

/// Number of decimals of the shortest text of a number.
fn decimals(number: f64) -> usize {
    let text = number.to_string();
    text.split_once('.')
        .map_or(0, |(_, decimals)| decimals.len())
}

/// Distribution of the measurand about its measured value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Distribution {
    /// normal
    #[default]
    Normal,
    /// normal without its part below 0: the width of a zone of form or direction
    NonNegative,
    /// the value is twice the distance of a point from its nominal place, with a round normal
    /// distribution of the point in the plane: the diameter of a zone of position. The standard
    /// uncertainty is twice that of one coordinate.
    Position,
}

impl InspectedQuantity {
    /// Distribution of the measurand about a measured value.
    pub fn distribution(self) -> Distribution {
        match self {
            Self::Position => Distribution::Position,
            _ if self.is_zone() => Distribution::NonNegative,
            _ => Distribution::Normal,
        }
    }
}

/// Probability p_c that the measurand is within the limits.
///
/// - `std`: standard uncertainty, 0 or more. 0: the measurand is the value.
pub(crate) fn conformance_probability(
    value: f64,
    std: f64,
    limits: ToleranceLimits,
    distribution: Distribution,
) -> f64 {
    if std <= 0.0 {
        return if limits.hold(value) { 1.0 } else { 0.0 };
    }
    // the distribution function without its part below `from`
    let between = |from: f64, to: f64| {
        let [from, to] = [from, to].map(|limit| (limit - value) / std);
        // for two upper tails, their mirrored lower ones have the digits
        if from > 0.0 {
            normal_cdf(-from) - normal_cdf(-to)
        } else {
            normal_cdf(to) - normal_cdf(from)
        }
    };
    let lower = limits.lower.unwrap_or(f64::NEG_INFINITY);
    let upper = limits.upper.unwrap_or(f64::INFINITY);
    let probability = match distribution {
        Distribution::Normal => between(lower, upper),
        Distribution::NonNegative => {
            between(lower.max(0.0), upper.max(0.0)) / between(0.0, f64::INFINITY)
        }
        Distribution::Position => {
            let inside = |limit: f64| {
                if limit == f64::INFINITY {
                    1.0
                } else {
                    circle_probability(value / 2.0, std / 2.0, limit / 2.0)
                }
            };
            inside(upper) - inside(lower.max(0.0))
        }
    };
    probability.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(lower: impl Into<Option<f64>>, upper: impl Into<Option<f64>>) -> ToleranceLimits {
        ToleranceLimits {
            lower: lower.into(),
            upper: upper.into(),
        }
    }

    fn normal(value: f64, std: f64, limits: ToleranceLimits) -> f64 {
        conformance_probability(value, std, limits, Distribution::Normal)
    }

    /// The example of JCGM 106:2012, 7.3: a Zener voltage of at most −5.40 V, measured as −5.47 V ±
    /// 0.05 V: 92 %.
    #[test]
    fn a_single_upper_limit_gives_the_example_of_the_guide() {
        assert!((normal(-5.47, 0.05, limits(None, -5.40)) - 0.919).abs() < 5e-4);
    }

    /// A tolerance of ±2 u about the value: erf(√2); a value on a limit far from the other: a half.
    #[test]
    fn closed_forms_of_two_limits_hold() {
        assert!((normal(5.0, 0.5, limits(4.0, 6.0)) - 0.954_499_736_103_641_6).abs() < 1e-14);
        assert!((normal(6.0, 0.1, limits(4.0, 6.0)) - 0.5).abs() < 1e-15);
        assert!((normal(7.0, 0.1, limits(4.0, 6.0)) - 7.619_853_024_160_47e-24).abs() < 1e-33);
    }

    #[test]
    fn without_uncertainty_the_value_decides() {
        for (value, expected) in [(4.0, 1.0), (6.0, 1.0), (6.000_001, 0.0), (3.9, 0.0)] {
            assert_eq!(normal(value, 0.0, limits(4.0, 6.0)), expected, "{value}");
        }
    }

    /// A form of 0 with an uncertainty: half a normal distribution remains.
    #[test]
    fn a_form_of_nothing_conforms_as_half_a_normal_distribution() {
        let of_form = |value, upper| {
            conformance_probability(value, 0.01, limits(None, upper), Distribution::NonNegative)
        };
        assert!((of_form(0.0, 0.02) - 0.954_499_736_103_641_6).abs() < 1e-14);
        assert!(
            (of_form(0.2, 0.21) - normal(0.2, 0.01, limits(None, 0.21))).abs() < 1e-15,
            "far from 0 nothing is cut off"
        );
    }

    /// On the nominal place the distance has Rayleigh's distribution: P(2 r ≤ T) = 1 − exp(−T² / 2
    /// U²), U twice the uncertainty.
    #[test]
    fn a_position_on_its_nominal_place_conforms_as_rayleigh_says() {
        let found = conformance_probability(0.0, 0.02, limits(None, 0.05), Distribution::Position);
        assert!(
            (found - (1.0 - (-0.5f64 * 2.5 * 2.5).exp())).abs() < 1e-10,
            "{found}"
        );
    }
}
