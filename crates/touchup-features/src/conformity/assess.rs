//! The decision on one characteristic.

use super::probability::{Distribution, ToleranceLimits, conformance_probability};
use touchup_geometry::numeric::normal_quantile;
use touchup_method::names;

names! {
    /// Decision on a characteristic.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Decision {
        /// conformity is proved to the confidence of the rule
        Pass = "pass",
        /// neither is proved
        #[default]
        Undecided = "undecided",
        /// nonconformity is proved to the confidence of the rule
        Fail = "fail",
    }
}

names! {
    /// Rule of a decision.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum DecisionRule {
        /// a guard band at each tolerance limit, on either side of it
        #[default]
        GuardBands = "iso14253",
        /// the measured value alone, regardless of its uncertainty: both sides share the risk
        Simple = "simple",
    }
}

names! {
    /// Reason for an open decision.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum OpenReason {
        /// within a guard band
        GuardBand = "the measured value is in a guard band: measure it better, or agree on another rule",
        /// the guard bands leave no acceptance zone
        NoAcceptanceZone = "the uncertainty is too large for this tolerance: no measured value would pass; measure it better",
        /// no standard uncertainty
        NoUncertainty = "it has no standard uncertainty: touch it",
        /// a lower bound not beyond the limits
        LowerBound = "it is a lower bound, and its end was not touched: touch the floor",
    }
}

/// A measured value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredNumber {
    /// y
    pub value: f64,
    /// u, its standard uncertainty
    pub std: Option<f64>,
    /// whether the value is a lower bound of the measurand
    pub is_at_least: bool,
}

impl MeasuredNumber {
    /// A value other than a bound.
    pub fn new(value: f64, std: Option<f64>) -> Self {
        Self {
            value,
            std,
            is_at_least: false,
        }
    }
}

/// Settings of decisions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecisionParams {
    /// Default: guard bands, as in ISO 14253-1 unless agreed otherwise
    pub rule: DecisionRule,
    /// Least probability of conformity for a pass, and of nonconformity for a fail. Default 0.95,
    /// as in ISO 14253-1.
    pub confidence: f64,
}

impl Default for DecisionParams {
    fn default() -> Self {
        Self {
            rule: DecisionRule::GuardBands,
            confidence: 0.95,
        }
    }
}

/// A decision and its evidence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Assessment {
    /// the decision
    pub decision: Decision,
    /// reason for an open decision
    pub reason: Option<OpenReason>,
    /// p_c; `None` without an uncertainty, and for a bound
    pub conformance_probability: Option<f64>,
    /// limits of passing values; both `None` if no value passes
    pub acceptance: ToleranceLimits,
    /// limits beyond which measured values fail
    pub rejection: ToleranceLimits,
}

impl Assessment {
    /// Probability that the decision is wrong: an acceptance, or a rejection; `None` if undecided.
    pub fn risk(&self) -> Option<f64> {
        let conforms = self.conformance_probability?;
        match self.decision {
            Decision::Pass => Some(1.0 - conforms),
            Decision::Fail => Some(conforms),
            Decision::Undecided => None,
        }
    }
}

/// Decides whether a characteristic conforms.
///
/// Guard bands: it passes if p_c is at least the confidence; each guard band inside of the
/// tolerance is then z u with Φ(z) the confidence, 1.645 u for 95 %, and a little more if the
/// tolerance is not large against u [JCGM 106:2012, 8.3; ISO 14253-1:2017]. It fails beyond z u
/// outside of the tolerance: p_c is at most 1 less the confidence there. A lower bound fails beyond
/// the upper limit, and passes only without an upper limit.
///
/// - `limits`: lower below upper.
pub fn assess(
    measured: &MeasuredNumber,
    limits: ToleranceLimits,
    distribution: Distribution,
    params: &DecisionParams,
) -> Assessment {
    let open = |reason| Assessment {
        reason: Some(reason),
        ..Assessment::default()
    };
    let z = match params.rule {
        DecisionRule::GuardBands => normal_quantile(params.confidence),
        DecisionRule::Simple => 0.0,
    };
    if measured.is_at_least {
        let decision = decision_on_bound(measured, limits, z);
        return Assessment {
            decision,
            ..open_unless_decided(decision, OpenReason::LowerBound)
        };
    }
    let Some(std) = measured.std else {
        return open(OpenReason::NoUncertainty);
    };
    let probability = |value: f64| conformance_probability(value, std, limits, distribution);
    let conforms = probability(measured.value);
    let rejection = ToleranceLimits {
        lower: limits.lower.map(|lower| lower - z * std),
        upper: limits.upper.map(|upper| upper + z * std),
    };
    let acceptance = match params.rule {
        DecisionRule::Simple => Some(limits),
        DecisionRule::GuardBands => {
            acceptance_zone(limits, distribution, params.confidence, &probability)
        }
    };
    let passes = match params.rule {
        DecisionRule::Simple => limits.hold(measured.value),
        DecisionRule::GuardBands => conforms >= params.confidence,
    };
    let (decision, reason) = if passes {
        (Decision::Pass, None)
    } else if !rejection.hold(measured.value) {
        (Decision::Fail, None)
    } else if acceptance.is_none() {
        (Decision::Undecided, Some(OpenReason::NoAcceptanceZone))
    } else {
        (Decision::Undecided, Some(OpenReason::GuardBand))
    };
    let acceptance = acceptance.unwrap_or_default();
    Assessment {
        decision,
        reason,
        conformance_probability: Some(conforms),
        acceptance,
        rejection,
    }
}

fn open_unless_decided(decision: Decision, reason: OpenReason) -> Assessment {
    Assessment {
        reason: (decision == Decision::Undecided).then_some(reason),
        ..Assessment::default()
    }
}

/// - `z`: guard band over the standard uncertainty.
fn decision_on_bound(bound: &MeasuredNumber, limits: ToleranceLimits, z: f64) -> Decision {
    let guard = z * bound.std.unwrap_or(0.0);
    match (limits.lower, limits.upper) {
        (_, Some(upper)) if bound.value > upper + guard => Decision::Fail,
        (Some(lower), None) if bound.std.is_some() && bound.value >= lower + guard => {
            Decision::Pass
        }
        _ => Decision::Undecided,
    }
}

/// Measured values with a probability of conformity of at least the confidence; `None`: there are
/// none.
fn acceptance_zone(
    limits: ToleranceLimits,
    distribution: Distribution,
    confidence: f64,
    probability: &impl Fn(f64) -> f64,
) -> Option<ToleranceLimits> {
    let floor = if distribution == Distribution::Normal {
        None
    } else {
        Some(0.0)
    };
    // the most probable value: in the middle, on 0, or far from a single limit
    let best = match (limits.lower.or(floor), limits.upper) {
        (Some(_), Some(_)) if limits.lower.is_none() => 0.0,
        (Some(lower), Some(upper)) => f64::midpoint(lower, upper),
        _ => return Some(one_sided(limits, confidence, probability)),
    };
    if probability(best) < confidence {
        return None;
    }
    let end =
        |limit: Option<f64>| limit.map(|limit| crossing(best, limit, confidence, probability));
    Some(ToleranceLimits {
        lower: end(limits.lower),
        upper: end(limits.upper),
    })
}

/// The zone within a single limit; open on the other side, it always exists.
fn one_sided(
    limits: ToleranceLimits,
    confidence: f64,
    probability: &impl Fn(f64) -> f64,
) -> ToleranceLimits {
    let end = |limit: f64, inward: f64| {
        // doubles until the far end surely passes
        let mut reach = limit.abs().max(1.0) * 1e-9;
        while probability(limit + inward * reach) < confidence {
            reach *= 2.0;
        }
        crossing(limit + inward * reach, limit, confidence, probability)
    };
    ToleranceLimits {
        lower: limits.lower.map(|limit| end(limit, 1.0)),
        upper: limits.upper.map(|limit| end(limit, -1.0)),
    }
}

/// The value at which the probability crosses the confidence, by bisection.
fn crossing(inside: f64, outside: f64, confidence: f64, probability: &impl Fn(f64) -> f64) -> f64 {
    let (mut inside, mut outside) = (inside, outside);
    if probability(outside) >= confidence {
        return outside;
    }
    for _ in 0..60 {
        let middle = f64::midpoint(inside, outside);
        if probability(middle) >= confidence {
            inside = middle
        } else {
            outside = middle
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    const Z: f64 = 1.644_853_626_951_472_2;

    fn limits(lower: impl Into<Option<f64>>, upper: impl Into<Option<f64>>) -> ToleranceLimits {
        ToleranceLimits {
            lower: lower.into(),
            upper: upper.into(),
        }
    }

    fn with_std(value: f64, std: f64) -> MeasuredNumber {
        MeasuredNumber::new(value, Some(std))
    }

    fn decided(measured: &MeasuredNumber, limits: ToleranceLimits) -> Decision {
        assess(
            measured,
            limits,
            Distribution::Normal,
            &DecisionParams::default(),
        )
        .decision
    }

    /// u small against the tolerance: guard bands of 1.645 u on either side of both limits.
    #[test]
    fn guard_bands_are_1_645_u_where_u_is_small() {
        let found = assess(
            &with_std(10.0, 0.01),
            limits(9.0, 11.0),
            Distribution::Normal,
            &DecisionParams::default(),
        );
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-9;
        assert!(
            near(found.acceptance.lower, 9.0 + 0.01 * Z)
                && near(found.acceptance.upper, 11.0 - 0.01 * Z),
            "{found:?}"
        );
        assert!(
            near(found.rejection.lower, 9.0 - 0.01 * Z)
                && near(found.rejection.upper, 11.0 + 0.01 * Z),
            "{found:?}"
        );
    }

    #[test]
    fn zones_of_pass_undecided_and_fail_follow_one_another() {
        use Decision::{Fail, Pass, Undecided};
        let zones = [
            (8.983, Fail),
            (8.984, Undecided),
            (9.016, Undecided),
            (9.017, Pass),
            (10.983, Pass),
            (11.016, Undecided),
        ];
        for (value, expected) in zones {
            assert_eq!(
                decided(&with_std(value, 0.01), limits(9.0, 11.0)),
                expected,
                "{value}"
            );
        }
        assert_eq!(decided(&with_std(11.017, 0.01), limits(9.0, 11.0)), Fail);
    }

    /// On an acceptance limit p_c is the confidence itself, however narrow the tolerance is.
    #[test]
    fn a_narrow_tolerance_widens_the_guard_bands() {
        let (u, zone) = (0.25, limits(-0.6, 0.6));
        let found = assess(
            &with_std(0.0, u),
            zone,
            Distribution::Normal,
            &DecisionParams::default(),
        );
        let upper = found.acceptance.upper.unwrap();
        assert!(0.6 - upper > Z * u, "{found:?}");
        assert!(
            (conformance_probability(upper, u, zone, Distribution::Normal) - 0.95).abs() < 1e-12,
            "{found:?}"
        );
        assert!(
            (found.acceptance.lower.unwrap() + upper).abs() < 1e-15,
            "{found:?}"
        );
    }

    #[test]
    fn a_tolerance_below_the_uncertainty_has_no_acceptance_zone() {
        let found = assess(
            &with_std(0.0, 1.0),
            limits(-1.0, 1.0),
            Distribution::Normal,
            &DecisionParams::default(),
        );
        assert_eq!(
            (found.decision, found.reason),
            (Decision::Undecided, Some(OpenReason::NoAcceptanceZone))
        );
        assert_eq!(found.acceptance, ToleranceLimits::default());
        assert_eq!(
            decided(&with_std(2.7, 1.0), limits(-1.0, 1.0)),
            Decision::Fail
        );
    }

    #[test]
    fn a_single_limit_has_a_single_guard_band() {
        let found = assess(
            &with_std(5.0, 0.1),
            limits(None, 6.0),
            Distribution::Normal,
            &DecisionParams::default(),
        );
        assert!(
            (found.acceptance.upper.unwrap() - (6.0 - 0.1 * Z)).abs() < 1e-9,
            "{found:?}"
        );
        assert_eq!(
            (found.decision, found.acceptance.lower),
            (Decision::Pass, None)
        );
        assert_eq!(
            decided(&with_std(-5.47, 0.05), limits(None, -5.40)),
            Decision::Undecided,
            "92 % are not enough"
        );
    }

    #[test]
    fn the_simple_rule_decides_by_the_value_and_shows_the_risk() {
        let params = DecisionParams {
            rule: DecisionRule::Simple,
            ..DecisionParams::default()
        };
        let found = assess(
            &with_std(11.0, 0.01),
            limits(9.0, 11.0),
            Distribution::Normal,
            &params,
        );
        assert_eq!(
            (found.decision, found.acceptance),
            (Decision::Pass, limits(9.0, 11.0))
        );
        assert!((found.risk().unwrap() - 0.5).abs() < 1e-15);
        let found = assess(
            &with_std(11.01, 0.01),
            limits(9.0, 11.0),
            Distribution::Normal,
            &params,
        );
        assert_eq!(found.decision, Decision::Fail);
        assert!((found.risk().unwrap() - 0.158_655_253_931_457_05).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_decided_without_an_uncertainty() {
        let untouched = MeasuredNumber {
            value: 10.0,
            std: None,
            is_at_least: false,
        };
        for rule in DecisionRule::ALL {
            let params = DecisionParams {
                rule,
                ..DecisionParams::default()
            };
            let found = assess(&untouched, limits(9.0, 11.0), Distribution::Normal, &params);
            assert_eq!(
                (found.decision, found.reason),
                (Decision::Undecided, Some(OpenReason::NoUncertainty)),
                "{rule}"
            );
        }
    }

    #[test]
    fn a_lower_bound_decides_only_beyond_the_limits() {
        let bound = |value, std| MeasuredNumber {
            value,
            std,
            is_at_least: true,
        };
        assert_eq!(
            decided(&bound(6.0, None), limits(7.9, 8.1)),
            Decision::Undecided
        );
        assert_eq!(
            decided(&bound(8.0, None), limits(7.9, 8.1)),
            Decision::Undecided
        );
        assert_eq!(decided(&bound(8.2, None), limits(7.9, 8.1)), Decision::Fail);
        assert_eq!(
            decided(&bound(8.11, Some(0.01)), limits(7.9, 8.1)),
            Decision::Undecided,
            "in the guard band"
        );
        assert_eq!(
            decided(&bound(8.2, Some(0.01)), limits(7.9, None)),
            Decision::Pass
        );
        assert_eq!(
            decided(&bound(8.2, None), limits(7.9, None)),
            Decision::Undecided,
            "of a bound nobody knows how well"
        );
    }

    #[test]
    fn a_form_passes_by_its_upper_limit_alone() {
        let of_form = |value, std| {
            assess(
                &with_std(value, std),
                limits(None, 0.03),
                Distribution::NonNegative,
                &DecisionParams::default(),
            )
        };
        assert_eq!(of_form(0.0, 0.01).decision, Decision::Pass);
        assert_eq!(of_form(0.02, 0.01).decision, Decision::Undecided);
        assert_eq!(of_form(0.05, 0.01).decision, Decision::Fail);
        assert_eq!(
            of_form(0.0, 0.016).reason,
            Some(OpenReason::NoAcceptanceZone),
            "half a normal distribution: 1.96 u"
        );
    }
}
