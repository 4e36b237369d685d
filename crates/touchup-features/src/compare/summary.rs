//! Statistics of a set of deviations.

use touchup_geometry::numeric::quantile;

/// Statistics of a set of deviations. All but `bias` are of the sizes, without sign.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// number of deviations
    pub points: usize,
    /// m
    pub mean: f64,
    /// root mean square, m
    pub rms: f64,
    /// m
    pub median: f64,
    /// 95th percentile, m
    pub p95: f64,
    /// 99th percentile, m
    pub p99: f64,
    /// m
    pub max: f64,
    /// mean with sign, m; positive: too much material
    pub bias: f64,
}

impl Summary {
    /// Of deviations in m; `None` without any.
    pub fn of(deviations: &[f64]) -> Option<Self> {
        let count = deviations.len() as f64;
        let mut sizes: Vec<f64> = deviations.iter().map(|d| d.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let max = *sizes.last()?;
        Some(Self {
            points: deviations.len(),
            mean: sizes.iter().sum::<f64>() / count,
            rms: (sizes.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
            median: quantile(&sizes, 0.5),
            p95: quantile(&sizes, 0.95),
            p99: quantile(&sizes, 0.99),
            max,
            bias: deviations.iter().sum::<f64>() / count,
        })
    }
}

/// Number of deviations in each of equal bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// lower end of the first bin, m; the upper end of the last is the same with the other sign
    pub from: f64,
    /// width of a bin, m
    pub width: f64,
    /// from the most negative to the most positive
    pub counts: Vec<usize>,
    /// below the first bin
    pub below: usize,
    /// above the last bin
    pub above: usize,
}

/// Bins of a [`Histogram`].
pub(crate) const BINS: usize = 40;

impl Histogram {
    /// Of deviations in m, in 40 bins from −`range` to `range` (m, more than 0); a bin includes its
    /// lower end.
    pub(crate) fn of(deviations: &[f64], range: f64) -> Self {
        let width = 2.0 * range / BINS as f64;
        let mut histogram = Self {
            from: -range,
            width,
            counts: vec![0; BINS],
            below: 0,
            above: 0,
        };
        for &deviation in deviations {
            let bin = ((deviation + range) / width).floor();
            match histogram.counts.get_mut(bin.max(0.0) as usize) {
                _ if bin < 0.0 => histogram.below += 1,
                Some(count) => *count += 1,
                None => histogram.above += 1,
            }
        }
        histogram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_numbers_by_hand() {
        let summary = Summary::of(&[1.0, -2.0, 3.0, -4.0, 0.0]).unwrap();
        assert_eq!(
            (summary.points, summary.mean, summary.median, summary.max),
            (5, 2.0, 2.0, 4.0)
        );
        assert_eq!((summary.rms, summary.bias), (6.0_f64.sqrt(), -0.4));
        // sizes 0 1 2 3 4: the 95 % quantile is 3.8
        assert!((summary.p95 - 3.8).abs() < 1e-15 && (summary.p99 - 3.96).abs() < 1e-15);
        assert_eq!(Summary::of(&[]), None);
    }

    #[test]
    fn every_deviation_is_counted_once() {
        let deviations = [-5.0, -2.0, -1.95, -0.01, 0.0, 0.05, 1.99, 2.0, 9.0];
        let histogram = Histogram::of(&deviations, 2.0);
        assert_eq!(
            (histogram.below, histogram.above, histogram.width),
            (1, 2, 0.1)
        );
        let filled: Vec<_> = histogram
            .counts
            .iter()
            .enumerate()
            .filter(|(_, n)| **n > 0)
            .map(|(at, n)| (at, *n))
            .collect();
        assert_eq!(filled, [(0, 2), (19, 1), (20, 2), (39, 1)]);
    }
}
