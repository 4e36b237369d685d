//! Processing times of samples: median and tails to 1/64, the maximum exactly, in constant memory.

use std::time::Duration;

use serde::Serialize;

/// Bits kept below the highest one of a duration: buckets are at most 1/64 wide.
const KEPT_BITS: u32 = 6;
/// Limit of durations with a bucket each, ns.
const EXACT_BELOW: u64 = 1 << (KEPT_BITS + 1);
/// Two rows of buckets for exact durations, and one for each higher leading bit.
const BUCKETS: usize = (65 - KEPT_BITS as usize) << KEPT_BITS;

/// A histogram of durations with a relative width of 1/64.
#[derive(Debug)]
pub struct Latencies {
    buckets: Box<[u64]>,
    count: u64,
    max_ns: u64,
}

/// Percentiles in the report, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Quantiles {
    /// half are no longer
    pub median: u64,
    /// 99 in 100 are no longer
    pub p99: u64,
    /// 999 in 1000 are no longer
    pub p999: u64,
    /// none is longer
    pub max: u64,
}

impl Default for Latencies {
    fn default() -> Self {
        Self::new()
    }
}

impl Latencies {
    /// No duration yet.
    pub fn new() -> Self {
        Self {
            buckets: vec![0; BUCKETS].into(),
            count: 0,
            max_ns: 0,
        }
    }

    /// Adds a duration.
    pub fn record(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.buckets[bucket_of(ns)] += 1;
        self.count += 1;
        self.max_ns = self.max_ns.max(ns);
    }

    /// Median and tails: the longest duration of each one's bucket; 0 without any.
    pub fn quantiles(&self) -> Quantiles {
        Quantiles {
            median: self.at(500),
            p99: self.at(990),
            p999: self.at(999),
            max: self.max_ns,
        }
    }

    /// The duration that `per_mille` of all do not exceed, ns.
    fn at(&self, per_mille: u64) -> u64 {
        let wanted = (u128::from(self.count) * u128::from(per_mille)).div_ceil(1000);
        let mut seen = 0;
        let reached = self.buckets.iter().position(|&in_bucket| {
            seen += u128::from(in_bucket);
            seen >= wanted
        });
        reached.map_or(0, |bucket| longest_of(bucket).min(self.max_ns))
    }
}

fn bucket_of(ns: u64) -> usize {
    if ns < EXACT_BELOW {
        return ns as usize;
    }
    let shift = ns.ilog2() - KEPT_BITS;
    ((shift as usize) << KEPT_BITS) + (ns >> shift) as usize
}

fn longest_of(bucket: usize) -> u64 {
    if (bucket as u64) < EXACT_BELOW {
        return bucket as u64;
    }
    let shift = (bucket >> KEPT_BITS) - 1;
    let mantissa = (bucket - (shift << KEPT_BITS)) as u64;
    (mantissa << shift) + ((1 << shift) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_duration_lies_in_its_bucket_and_buckets_follow_each_other() {
        for bucket in 1..BUCKETS {
            let (before, longest) = (longest_of(bucket - 1), longest_of(bucket));
            assert_eq!(
                (bucket_of(before + 1), bucket_of(longest)),
                (bucket, bucket)
            );
            assert!((longest - before - 1) as f64 <= longest as f64 / 64.0);
        }
        assert_eq!(longest_of(BUCKETS - 1), u64::MAX);
    }

    #[test]
    fn quantiles_of_a_known_list() {
        let mut latencies = Latencies::new();
        assert_eq!(
            latencies.quantiles(),
            Quantiles {
                median: 0,
                p99: 0,
                p999: 0,
                max: 0
            }
        );
        for ns in 1..=1000 {
            latencies.record(Duration::from_nanos(ns));
        }
        let Quantiles {
            median,
            p99,
            p999,
            max,
        } = latencies.quantiles();
        assert!((500..508).contains(&median), "{median}");
        assert!(
            (990..=1000).contains(&p99) && (999..=1000).contains(&p999),
            "{p99} {p999}"
        );
        assert_eq!(max, 1000);
    }

    /// Numbers of short durations at which one more or less changes a quantile.
    #[test]
    fn a_quantile_is_exceeded_by_its_share_and_no_more() {
        let quantiles = |short: usize| {
            let mut latencies = Latencies::new();
            (0..1000).for_each(|at| {
                latencies.record(Duration::from_micros(if at < short { 1 } else { 1000 }))
            });
            let Quantiles {
                median, p99, p999, ..
            } = latencies.quantiles();
            [median, p99, p999].map(|ns| ns > 500_000)
        };
        assert_eq!(quantiles(1000), [false, false, false]);
        assert_eq!(quantiles(999), [false, false, false]);
        assert_eq!(quantiles(998), [false, false, true]);
        assert_eq!(quantiles(990), [false, false, true]);
        assert_eq!(quantiles(989), [false, true, true]);
        assert_eq!(quantiles(500), [false, true, true]);
        assert_eq!(quantiles(499), [true, true, true]);
    }
}
