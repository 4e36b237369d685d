//! Weights of iteratively reweighted least squares, as functions of u², with u the residual over
//! the width of the weights.

/// Standard deviation of normal errors over the median of their sizes: 1/Φ⁻¹(3/4).
pub const SIGMA_OF_MEDIAN: f64 = 1.482_602_218_505_602;

/// Width of Tukey's weights in standard deviations: 95 % as good as plain least squares without
/// outliers.
pub const TUKEY_WIDTH: f64 = 4.685;

/// Tukey's biweight (1 − u²)², 0 from u = 1 on.
#[inline]
pub fn biweight(u_squared: f64) -> f64 {
    (1.0 - u_squared).max(0.0).powi(2)
}

/// Cauchy's weight 1/(1 + u²): half at u = 1, never 0.
#[inline]
pub fn cauchy_weight(u_squared: f64) -> f64 {
    1.0 / (1.0 + u_squared)
}

/// Cauchy's cost of misfits, ½ Σ ln(1 + (x / width)²), in units of the squared width.
pub fn cauchy_cost(misfits: &[f64], width: f64) -> f64 {
    let cost = |misfit: &f64| (misfit / width).powi(2).ln_1p();
    misfits.iter().map(cost).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_fall_from_one() {
        assert_eq!([0.0, 0.5, 1.0, 9.0].map(biweight), [1.0, 0.25, 0.0, 0.0]);
        assert_eq!([0.0, 1.0, 3.0].map(cauchy_weight), [1.0, 0.5, 0.25]);
    }

    /// ½ ln 2 for a misfit of one width, ½ ln 5 for two.
    #[test]
    fn cost_grows_ever_slower() {
        let expected = (2f64.ln() + 5f64.ln()) / 2.0;
        assert!((cauchy_cost(&[3.0, -6.0], 3.0) - expected).abs() < 1e-12);
    }
}
