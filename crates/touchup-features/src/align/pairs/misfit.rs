//! Faults of pairs that no motion fits.
//!
//! Leave one out: with S the weighted squares of all pairs and Sᵢ without pair i, Sᵢ / S is Beta((3
//! n − 9) / 2, 3 / 2) distributed if pair i is as good as the others (the F test of a shifted
//! point). A value too small for chance names the pair.

use super::error::PairsError;
use super::solved::{PairsParams, PointPair, SolvedMotion};

/// Chance of refusing good pairs, over all of them.
const FALSE_ALARM: f64 = 1e-4;
/// Smallest number of pairs that can reveal a wrong one.
const FEWEST_TO_BLAME: usize = 5;
/// Maximum number of pairs left out in turn, of the largest residuals: among more pairs no single
/// one has the power to draw the motion to itself.
const MOST_TO_BLAME: usize = 32;
/// Relative difference of the distances from which a factor is an error: picks scatter less.
const SCALE_TOLERANCE: f64 = 0.05;
/// Relative difference from a known factor up to which the error names it.
const NAMED_TOLERANCE: f64 = 0.03;
/// Largest rms residual, as a share of the points' scatter.
const LARGEST_SHARE: f64 = 0.1;
/// Ratio of residuals from which a mirror image is an error.
const MIRROR_RATIO: f64 = 3.0;

/// Factors between units, space over scan, and their meaning.
const UNITS: [(f64, &str); 8] = [
    (
        1000.0,
        " (1000: the scan is in m, or taken for mm, and space in mm)",
    ),
    (1e-3, " (1/1000: space is in m and the scan in mm)"),
    (25.4, " (25.4: the scan is in inches)"),
    (1.0 / 25.4, " (1/25.4: space is in inches)"),
    (10.0, " (10: the scan is in cm)"),
    (0.1, " (1/10: space is in cm)"),
    (39.3700787, " (39.37: the scan is in m and space in inches)"),
    (0.0254, " (1/39.37: space is in m and the scan in inches)"),
];

pub(super) fn check(
    pairs: &[PointPair],
    weights: &[f64],
    params: &PairsParams,
    solved: &SolvedMotion,
) -> Result<(), PairsError> {
    let total: f64 = weights.iter().sum();
    let [rms, mirrored] =
        [solved.squares, solved.mirrored_squares].map(|squares| (squares / total).sqrt());
    let extent = extent(pairs);
    let limit = params.largest_rms.min(LARGEST_SHARE * extent[0]);
    if rms > limit {
        check_scale(extent)?;
        if mirrored <= limit && rms > MIRROR_RATIO * mirrored {
            return Err(PairsError::Mirrored {
                rms_mm: rms * 1e3,
                mirrored_mm: mirrored * 1e3,
            });
        }
    }
    check_each(pairs, weights, params, solved)?;
    if rms <= limit {
        return Ok(());
    }
    let residual = |pair: &PointPair| (pair.to - solved.motion * pair.from).norm();
    let worst = pairs
        .iter()
        .enumerate()
        .max_by(|a, b| residual(a.1).total_cmp(&residual(b.1)));
    let (worst, worst_mm) = worst.map_or((0, 0.0), |(i, pair)| (i + 1, residual(pair) * 1e3));
    let hint = if pairs.len() < FEWEST_TO_BLAME {
        "; with 5 pairs or more the wrong one can be named"
    } else {
        ""
    };
    Err(PairsError::Disagree {
        rms_mm: rms * 1e3,
        limit_mm: limit * 1e3,
        worst,
        worst_mm,
        hint,
    })
}

/// Rms distance from the middle, of `from` and of `to`, m.
fn extent(pairs: &[PointPair]) -> [f64; 2] {
    let n = pairs.len() as f64;
    [super::PairSide::From, super::PairSide::To].map(|side| {
        let mean = pairs
            .iter()
            .map(|pair| pair.on(side).coords / n)
            .sum::<nalgebra::Vector3<f64>>();
        pairs
            .iter()
            .map(|pair| (pair.on(side).coords - mean).norm_squared() / n)
            .sum::<f64>()
            .sqrt()
    })
}

/// A known factor between the distances is a unit; any other is a wrong pick.
fn check_scale([from, to]: [f64; 2]) -> Result<(), PairsError> {
    let factor = to / from;
    if (factor - 1.0).abs() <= SCALE_TOLERANCE {
        return Ok(());
    }
    let named = UNITS
        .iter()
        .find(|(known, _)| (factor / known - 1.0).abs() < NAMED_TOLERANCE);
    named.map_or(Ok(()), |&(_, named)| {
        Err(PairsError::Scale { factor, named })
    })
}

/// Checks each pair that may matter against the others.
fn check_each(
    pairs: &[PointPair],
    weights: &[f64],
    params: &PairsParams,
    all: &SolvedMotion,
) -> Result<(), PairsError> {
    let n = pairs.len();
    if n < FEWEST_TO_BLAME || all.squares <= 0.0 {
        return Ok(());
    }
    let mut order: Vec<usize> = (0..n).collect();
    let residual =
        |i: usize| weights[i] * (pairs[i].to - all.motion * pairs[i].from).norm_squared();
    order.sort_by(|&i, &j| residual(j).total_cmp(&residual(i)));
    let mut worst: Option<(f64, PairsError)> = None;
    for i in order.into_iter().take(MOST_TO_BLAME) {
        let pair = &pairs[i];
        let Some(others) = SolvedMotion::of(pairs, weights, Some(i)) else {
            continue;
        };
        let distance = (pair.to - others.motion * pair.from).norm();
        let least = pair
            .sigma
            .or(params.sigma)
            .map_or(params.least_misfit, |sigma| 4.0 * sigma);
        let chance = beta_below(others.squares / all.squares, 1.5 * (n as f64 - 3.0));
        if distance < least
            || chance * n as f64 > FALSE_ALARM
            || worst.as_ref().is_some_and(|(c, _)| *c <= chance)
        {
            continue;
        }
        let rest: f64 = weights.iter().sum::<f64>() - weights[i];
        let rest_mm = (others.squares / rest).sqrt() * 1e3;
        let outlier = PairsError::Outlier {
            pair: i + 1,
            distance_mm: distance * 1e3,
            others: n - 1,
            rest_mm,
        };
        worst = Some((chance, outlier));
    }
    worst.map_or(Ok(()), |(_, outlier)| Err(outlier))
}

/// Chance that a Beta(a, 3/2) variable is below `x`, a ≥ 3: ∫₀ˣ tᵃ⁻¹ √(1 − t) dt over the same to
/// 1, by the midpoint rule.
fn beta_below(x: f64, a: f64) -> f64 {
    const STEPS: u32 = 512;
    let x = x.clamp(0.0, 1.0);
    // t = 1 − u² makes the integrand smooth at 1, despite the square root
    let integral = |from: f64| {
        // beyond this it has fallen by e⁻⁶⁴
        let to = (from * from + 64.0 / a).sqrt().min(1.0);
        let step = (to - from) / f64::from(STEPS);
        let at = |k: u32| from + (f64::from(k) + 0.5) * step;
        (0..STEPS)
            .map(at)
            .map(|u| (1.0 - u * u).powf(a - 1.0) * 2.0 * u * u * step)
            .sum::<f64>()
    };
    integral((1.0 - x).sqrt()) / integral(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms: I_x(a, 3/2) at a = 3 by hand, from ∫ t² √(1−t) dt with u = √(1−t).
    #[test]
    fn chance_has_its_closed_form() {
        let tail = |u: f64| 2.0 * (u.powi(3) / 3.0 - 2.0 * u.powi(5) / 5.0 + u.powi(7) / 7.0);
        for x in [0.01, 0.2, 0.5, 0.9] {
            let u = (1.0_f64 - x).sqrt();
            let exact = (tail(1.0) - tail(u)) / tail(1.0);
            assert!(
                (beta_below(x, 3.0) / exact - 1.0).abs() < 1e-3,
                "{x}: {} {exact}",
                beta_below(x, 3.0)
            );
        }
        assert_eq!(beta_below(0.0, 3.0), 0.0);
        // many pairs: −2 a ln t tends to χ² of three, with 0.5 % above 12.838
        assert!((beta_below((-12.838_f64 / 2e5).exp(), 1e5) / 0.005 - 1.0).abs() < 1e-2);
        assert!((beta_below(1.0, 7.5) - 1.0).abs() < 1e-12);
    }
}
