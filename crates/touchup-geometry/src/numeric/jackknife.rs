//! Uncertainty of an estimate from its values without each part of its data.

/// Variance of an estimate by the delete-one jackknife \[Tukey 1958\]: (n − 1)/n Σ (xᵢ − x̄)².
///
/// - `without`: the estimates without one part of the data, for each part.
pub fn jackknife_variance(without: &[f64]) -> f64 {
    let count = without.len().max(1) as f64;
    let mean = without.iter().sum::<f64>() / count;
    (count - 1.0) / count * without.iter().map(|x| (x - mean).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For a mean it is the variance of the data over their number, here 2.5 / 5.
    #[test]
    fn the_variance_of_a_mean_is_that_of_the_data_over_their_number() {
        let data = [1.0, 2.0, 3.0, 4.0, 5.0];
        let without = data.map(|left_out| (15.0 - left_out) / 4.0);
        assert!((jackknife_variance(&without) - 0.5).abs() < 1e-12);
        assert_eq!(jackknife_variance(&[]), 0.0);
    }
}
