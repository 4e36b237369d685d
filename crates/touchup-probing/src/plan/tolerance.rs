//! From a tolerance to a standard deviation.

/// Standard deviation of a normal error that stays within ± `half_width` with a probability of
/// `confidence`, in the unit of the half width.
///
/// σ = w / √2 erf⁻¹(P), with erf⁻¹ by bisection of the error function's series \[Abramowitz Stegun
/// 1964, 7.1.6\].
pub fn sigma_of(half_width: f64, confidence: f64) -> f64 {
    let (mut low, mut high) = (0.0, HIGHEST);
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        if within(middle) < confidence {
            low = middle
        } else {
            high = middle
        }
    }
    half_width / f64::midpoint(low, high)
}

/// Deviations that suffice for any probability below 1 − 1e-9.
const HIGHEST: f64 = 6.2;
/// Number of bisections, to below the last digit.
const BISECTIONS: usize = 60;

/// Share of a normal distribution within ± z deviations.
fn within(z: f64) -> f64 {
    // erf(x) = 2/√π exp(−x²) Σ 2ⁿ x²ⁿ⁺¹ / (1·3·…·(2n+1))
    let x = z / std::f64::consts::SQRT_2;
    let (mut term, mut sum) = (x, x);
    let mut n = 0.0;
    while term > sum * f64::EPSILON {
        n += 1.0;
        term *= 2.0 * x * x / (2.0 * n + 1.0);
        sum += term;
    }
    std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp() * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From tables of the normal distribution.
    #[test]
    fn deviations_are_those_of_the_tables() {
        for (confidence, z) in [
            (0.5, 0.674_490),
            (0.682_689, 1.0),
            (0.95, 1.959_964),
            (0.99, 2.575_829),
            (0.9999, 3.890_592),
        ] {
            assert!(
                (1.0 / sigma_of(1.0, confidence) - z).abs() < 2e-6,
                "{confidence}"
            );
        }
    }
}
