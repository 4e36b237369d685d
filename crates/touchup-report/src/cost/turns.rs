//! Cases of the same work, timed in turns, so that a disturbance of the machine affects all of
//! them.

use std::hint::black_box;
use std::ops::Range;
use std::time::Instant;

use crate::Spread;
use crate::allocations::asked;
use crate::error::{MeasureError, MeasureResult};

/// One case: does the work of these samples, by number.
pub(super) struct TimedCase<'a> {
    pub name: &'a str,
    pub run: Box<dyn FnMut(Range<usize>) -> MeasureResult<()> + 'a>,
}

impl<'a> TimedCase<'a> {
    pub fn new(name: &'a str, run: impl FnMut(Range<usize>) -> MeasureResult<()> + 'a) -> Self {
        Self {
            name,
            run: Box::new(run),
        }
    }

    /// Does the same work with each of `items`, one per sample.
    pub fn each<T, R>(
        name: &'a str,
        items: &'a [T],
        mut work: impl FnMut(&'a T) -> MeasureResult<R> + 'a,
    ) -> Self {
        Self::new(name, move |block| {
            items[block]
                .iter()
                .try_for_each(|item| work(item).map(black_box).map(drop))
        })
    }
}

/// Amount of timing: samples to warm up, blocks, and samples in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    pub warm: usize,
    pub blocks: usize,
    pub block: usize,
}

impl Timing {
    /// Number of samples required.
    pub fn samples(&self) -> usize {
        self.warm + self.blocks * self.block
    }
}

/// Cost of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerSample {
    /// time, ns
    pub time_ns: Spread,
    /// requests to the allocator; `None` if the program does not count them
    pub allocations: Option<f64>,
    /// allocated bytes
    pub allocated_bytes: Option<f64>,
}

/// Times of one case, block by block.
#[derive(Default)]
pub(super) struct BlockTimes {
    /// time of one sample, ns
    pub blocks_ns: Vec<f64>,
    requests: u64,
    bytes: u64,
    samples: usize,
    counts: bool,
}

impl BlockTimes {
    fn add(&mut self, case: &mut TimedCase, samples: Range<usize>) -> MeasureResult<()> {
        let count = samples.len();
        let before = asked();
        let started = Instant::now();
        (case.run)(samples)?;
        let time_ns = started.elapsed().as_nanos() as f64;
        // the query of the counters is a request too
        if let (Some(before), Some(after)) = (before, asked()) {
            self.requests += (after.requests - before.requests).saturating_sub(1);
            self.bytes += (after.bytes - before.bytes).saturating_sub(1);
        }
        self.blocks_ns.push(time_ns / count.max(1) as f64);
        self.samples += count;
        Ok(())
    }

    pub fn per_sample(&self) -> MeasureResult<PerSample> {
        let share = |count: u64| {
            self.counts
                .then(|| count as f64 / self.samples.max(1) as f64)
        };
        Ok(PerSample {
            time_ns: spread(self.blocks_ns.iter().copied())?,
            allocations: share(self.requests),
            allocated_bytes: share(self.bytes),
        })
    }
}

/// Runs all cases over the same samples: first to warm up, then block by block, each time with
/// another case first.
pub(super) fn in_turns(cases: &mut [TimedCase], timing: Timing) -> MeasureResult<Vec<BlockTimes>> {
    let counts = asked().is_some();
    let mut timed: Vec<_> = cases
        .iter()
        .map(|_| BlockTimes {
            counts,
            ..BlockTimes::default()
        })
        .collect();
    for case in cases.iter_mut() {
        (case.run)(0..timing.warm)?;
    }
    for block in 0..timing.blocks {
        let first = timing.warm + block * timing.block;
        for turn in 0..cases.len() {
            let at = (turn + block) % cases.len();
            timed[at].add(&mut cases[at], first..first + timing.block)?;
        }
    }
    Ok(timed)
}

/// Block by block, the first against the second: their ratio, or their difference in ns.
pub(super) fn by_block(
    of: &BlockTimes,
    to: &BlockTimes,
    compare: fn(f64, f64) -> f64,
) -> MeasureResult<Spread> {
    spread(
        of.blocks_ns
            .iter()
            .zip(&to.blocks_ns)
            .map(|(of, to)| compare(*of, *to)),
    )
}

/// Spread of times.
pub(super) fn spread(times: impl IntoIterator<Item = f64>) -> MeasureResult<Spread> {
    Spread::of(times.into_iter().collect()).ok_or(MeasureError::NothingTimed)
}

#[cfg(test)]
mod tests {
    use std::ops::{Div, Sub};

    use super::*;

    #[test]
    fn every_case_gets_every_sample_once_and_in_order() {
        let (mut first, mut second) = (Vec::new(), Vec::new());
        let mut cases = [
            TimedCase::new("first", |samples| {
                first.extend(samples);
                Ok(())
            }),
            TimedCase::new("second", |samples| {
                second.extend(samples);
                Ok(())
            }),
        ];
        let timing = Timing {
            warm: 3,
            blocks: 4,
            block: 2,
        };
        let timed = in_turns(&mut cases, timing).unwrap();
        assert_eq!(
            timed
                .iter()
                .map(|timed| (timed.blocks_ns.len(), timed.samples))
                .collect::<Vec<_>>(),
            [(4, 8); 2]
        );
        drop(cases);
        assert_eq!(
            (first, second),
            ((0..11).collect(), (0..11).collect::<Vec<_>>())
        );
    }

    #[test]
    fn ratios_and_differences_are_of_blocks_side_by_side() {
        let of = |blocks_ns: &[f64]| BlockTimes {
            blocks_ns: blocks_ns.to_vec(),
            ..BlockTimes::default()
        };
        let (slow, fast) = (of(&[300.0, 20.0, 100.0]), of(&[100.0, 10.0, 100.0]));
        assert_eq!(
            by_block(&slow, &fast, f64::div).unwrap(),
            Spread {
                median: 2.0,
                p10: 1.0,
                p90: 3.0
            }
        );
        assert_eq!(
            by_block(&slow, &fast, f64::sub).unwrap(),
            Spread {
                median: 10.0,
                p10: 0.0,
                p90: 200.0
            }
        );
        assert_eq!(slow.per_sample().unwrap().allocations, None);
    }
}
