//! Quantiles: order statistics, interpolated and weighted.

/// The entry of `values` with ⌊`share` n⌋ of the n before it in rising order, or the last; `None`
/// if empty. Reorders the values. O(n).
///
/// - `share`: 0 to 1.
pub fn order_statistic(values: &mut [f64], share: f64) -> Option<f64> {
    let at = ((share * values.len() as f64) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// Index of the largest of three, the first among equals.
pub fn largest<T: PartialOrd>(of: &[T; 3]) -> usize {
    (1..3).fold(0, |at, i| if of[i] > of[at] { i } else { at })
}

/// The middle one in rising order, the upper of two; `None` if empty. Reorders the values. O(n).
pub fn median(values: &mut [f64]) -> Option<f64> {
    order_statistic(values, 0.5)
}

/// The value at a share of the range of indices of rising `values`, interpolated; 0 if empty.
///
/// - `share`: from the first (0) to the last (1).
pub fn quantile(rising: &[f64], share: f64) -> f64 {
    let Some(last) = rising.len().checked_sub(1) else {
        return 0.0;
    };
    let at = share.clamp(0.0, 1.0) * last as f64;
    let (low, high) = (rising[at.floor() as usize], rising[at.ceil() as usize]);
    low + (high - low) * at.fract()
}

/// The least value with at least a share of the weight up to it; `None` if empty. Sorts the values;
/// equal ones keep their order.
///
/// - `values`: each with its weight, 0 or more.
pub fn weighted_quantile(values: &mut [(f64, f64)], share: f64) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    let reached = |(_, weight): &&(f64, f64)| {
        below += weight;
        below >= share * total
    };
    values
        .iter()
        .find(reached)
        .or(values.last())
        .map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_found_whatever_the_order() {
        assert_eq!(median(&mut [3.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median(&mut []), None);
    }

    #[test]
    fn the_first_of_equals_is_the_largest() {
        let all = [[3, 1, 2], [1, 3, 3], [1, 2, 3], [3, 3, 3], [2, 2, 3]];
        assert_eq!(all.map(|of| largest(&of)), [0, 1, 2, 0, 2]);
    }

    #[test]
    fn of_a_hundred_numbers_a_share_has_as_many_before_it() {
        let mut numbers: Vec<f64> = (0..100).rev().map(f64::from).collect();
        for (share, expected) in [
            (0.0, 0.0),
            (0.1, 10.0),
            (0.25, 25.0),
            (0.9, 90.0),
            (0.95, 95.0),
            (1.0, 99.0),
        ] {
            assert_eq!(
                order_statistic(&mut numbers, share),
                Some(expected),
                "{share}"
            );
        }
    }

    #[test]
    fn between_two_numbers_it_goes_by_proportion() {
        let five = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert!((quantile(&five, 0.95) - 3.8).abs() < 1e-15);
        assert_eq!(
            [0.0, 0.5, 1.0].map(|share| quantile(&five, share)),
            [0.0, 2.0, 4.0]
        );
        assert_eq!(quantile(&[], 0.5), 0.0);
    }

    #[test]
    fn a_heavy_value_is_the_quantile_of_all_that_it_holds() {
        let mut values = [(2.0, 3.0), (0.0, 6.0), (1.0, 1.0)];
        assert_eq!(
            [0.5, 0.6, 0.65, 0.71].map(|share| weighted_quantile(&mut values, share).unwrap()),
            [0.0, 0.0, 1.0, 2.0]
        );
        assert_eq!(weighted_quantile(&mut [], 0.5), None);
    }
}
