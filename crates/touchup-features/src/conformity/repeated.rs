//! Confidence of a decision that is tested after every touch.
//!
//! Repeated tests that stop at the first decision err more often than each test by itself: with a
//! value on its limit, the mean of the touches crosses a guard band of z u at some time with a
//! higher probability than at a given one [Armitage, McPherson, Rowe 1969]. Pocock's guard band is
//! the same at every look, and chance crosses it at any of them with the stated probability alone
//! [Pocock 1977]; here for one side, as each limit has one.
//!
//! Looks are at n, n + 1, … touches, each of the same weight. The mean of n of them over its
//! standard deviation is Z_n, and Z_m = √(n/m) Z_n + √(1 − n/m) ξ with ξ normal. The trapezoid rule
//! follows its density, without the stopped part, from look to look. Errors common to all touches
//! tie the looks together more closely, so they cross less often than that.

use touchup_geometry::numeric::{normal_cdf, normal_quantile};

/// Step of the density, in standard deviations: at most 2/5 of the deviation of one step of Z.
const STEP: f64 = 0.05;
/// Lower end of the density.
const LOWEST: f64 = -6.0;
/// Steps of a doubling: for many touches one look in each stands for those beside it.
const LOOKS: usize = 64;
/// Cut-off of the kernel, in its standard deviations.
const TAIL: f64 = 6.0;
/// Halves the range of quantiles to a thousandth of a standard deviation.
const BISECTIONS: usize = 12;

/// Probability of conformity that each look must require for a combined `confidence` of all looks.
///
/// - `confidence`: above 0.5 and below 1.
/// - `first`, `last`: touches at the first look and at the last, from 1 on.
pub fn repeated_confidence(confidence: f64, first: usize, last: usize) -> f64 {
    let first = first.max(1);
    if last <= first {
        return confidence;
    }
    // no more than separate looks would need
    let looks = (last - first + 1) as f64;
    let (mut low, mut high) = (
        normal_quantile(confidence),
        normal_quantile(1.0 - (1.0 - confidence) / looks),
    );
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        if crossing(middle, first, last) > 1.0 - confidence {
            low = middle
        } else {
            high = middle
        }
    }
    normal_cdf(high)
}

/// Probability that Z is above `bound` at one of the looks.
fn crossing(bound: f64, first: usize, last: usize) -> f64 {
    let count = ((bound - LOWEST) / STEP).ceil() as usize + 1;
    let z = |at: usize| bound - at as f64 * STEP;
    let normal = |z: f64| (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    // the bound itself has half a step
    let weight = |at: usize| if at == 0 { STEP / 2.0 } else { STEP };
    let mut density: Vec<f64> = (0..count).map(|at| normal(z(at))).collect();
    let mut crossed = normal_cdf(-bound);
    let mut touches = first;
    while touches < last {
        let next = (touches + (touches / LOOKS).max(1)).min(last);
        let kept = touches as f64 / next as f64;
        let (shrink, sigma) = (kept.sqrt(), (1.0 - kept).sqrt());
        let mut after = vec![0.0; count];
        for (at, share) in density
            .iter()
            .enumerate()
            .map(|(at, density)| (at, density * weight(at)))
        {
            let middle = shrink * z(at);
            crossed += share * normal_cdf(-(bound - middle) / sigma);
            let near = |z: f64| ((bound - z) / STEP).max(0.0);
            let from = near(middle + TAIL * sigma) as usize;
            let to = (near(middle - TAIL * sigma) as usize + 1).min(count - 1);
            for (to, after) in after.iter_mut().enumerate().take(to + 1).skip(from) {
                *after += share * normal((z(to) - middle) / sigma) / sigma;
            }
        }
        (density, touches) = (after, next);
    }
    crossed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 of Pocock 1977, both sides at 5 %: one side at 2.5 % is less than 0.005 below.
    #[test]
    fn looks_at_equal_groups_need_the_constants_of_pocock() {
        for (looks, expected) in [
            (1, 1.960),
            (2, 2.178),
            (3, 2.289),
            (4, 2.361),
            (5, 2.413),
            (10, 2.555),
        ] {
            let found = normal_quantile(repeated_confidence(0.975, 1, looks));
            assert!(
                (found - expected).abs() < 0.006,
                "{looks} looks: {found}, not {expected}"
            );
        }
    }

    /// Armitage, McPherson and Rowe 1969, table 2: both sides at 5 % each, ten looks err in 19.3 %
    /// of the cases.
    #[test]
    fn looking_ten_times_nearly_quadruples_the_risk() {
        let both = 2.0 * crossing(1.959_964, 1, 10);
        // counts a crossing of both twice
        assert!((0.193..0.200).contains(&both), "{both}");
    }

    #[test]
    fn more_looks_ask_for_more_and_one_look_for_what_is_stated() {
        let asked: Vec<f64> = [6, 12, 39, 200]
            .map(|last| repeated_confidence(0.95, 6, last))
            .to_vec();
        assert!(
            asked.is_sorted() && asked[0] == 0.95 && asked[3] < 0.999,
            "{asked:?}"
        );
    }
}
