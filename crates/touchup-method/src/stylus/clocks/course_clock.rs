//! Delay of the wrench clock, from the whole course of motion and force.
//!
//! **Sliding**: friction turns with the motion. The force holds a sliding ball back along its path,
//! F · v̂ = −|F| sin φ, with the angle of friction φ. As the stylus turns back or rolls around an
//! edge, F and v turn at one instant. Read with a delay δ, the cosine s = F(t + δ) · v(t) / |F| |v|
//! leaves its level there: over all sliding, its variance is least at the delay.
//!
//! **Lifting**: a gap between ball and part excludes a force (Signorini's condition, F ≥ 0, g ≥ 0,
//! F g = 0). Read with a delay, the force outlasts the contact, or precedes it: the mean of F(t +
//! δ) g(t) is least at the delay. The gap counts from the lowest position of the ball along the
//! force shortly before and after.
//!
//! **Drift**: two independent clocks differ in rate by up to some 100 ppm, 30 ms after five
//! minutes. The delay is then δ + ε (t − t̄), and the sums over all blocks are least at both.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::clock_offset::{ClockDrift, ClockEvidence, ClockOffset, mean_period};
use crate::stylus::ContactSample;
use touchup_geometry::numeric::jackknife_variance;

/// Trial delays: ± [`REACH`] steps of [`STEP_NS`].
const STEP_NS: i64 = 4_000_000;
const REACH: usize = 37;
const DELAYS: usize = 2 * REACH + 1;
/// Longest trial delay, ns.
const SPAN_NS: i64 = REACH as i64 * STEP_NS;
/// Duration of the two means whose difference is a velocity, on both sides of its instant, ns.
const MEAN_NS: i64 = 35_000_000;
/// Minimum speed of certain sliding, m/s.
const LEAST_SPEED: f64 = 8e-3;
/// Maximum gap between samples of one course, ns.
const LONGEST_GAP_NS: i64 = 100_000_000;
/// Maximum number of samples: 300 ms at 4 kHz.
const MOST_SAMPLES: usize = 1536;
/// Minimum time between instants, ns.
const EVERY_NS: i64 = 4_000_000;
/// Instants of a block: 0.4 s.
const BLOCK: usize = 100;
/// Maximum number of blocks; at this number, pairs merge.
const MOST_BLOCKS: usize = 64;
/// Minimum number of blocks that determines their spread.
const LEAST_BLOCKS: usize = 8;
/// Maximum of the least sum, as a share of its mean over all delays: above it nothing turned, or
/// lifted.
const LEAST_SHARE: f64 = 0.7;
/// Another delay may be as good if its sum is lower than the mean by all but this share: the motion
/// repeats within the span.
const OTHER_DEPTH: f64 = 0.1;
/// Minimum distance of two equally good delays, in steps.
const OTHER_STEPS: usize = 10;
/// Trial rates of drift on each side: the largest, the step or a finer one, and the maximum number.
const LARGEST_RATE: f64 = 400e-6;
const RATE_STEP: f64 = 5e-6;
const MOST_RATES: i64 = 400;
/// Minimum of a sure drift, in standard uncertainties, and of one worth removing, in its gain over
/// the span, s.
const SURE_SIGMAS: f64 = 5.0;
const LEAST_GAIN: f64 = 8e-3;
/// Minimum fall of the sum by a delay or a drift, in standard errors.
const LEAST_FALL: f64 = 4.0;
/// Standard uncertainties beyond which a delay must make the sum fall.
const CLEAR_SIGMAS: f64 = 3.0;
/// Maximum uncertainty of an estimate, s.
const LARGEST_SIGMA: f64 = 12e-3;

/// One number for each delay.
type OfDelays = [f64; DELAYS];

/// Sums over some instants, for each delay.
#[derive(Clone, Copy, Debug)]
struct DelayBlock {
    count: usize,
    /// sum of their times, s
    time: f64,
    sums: OfDelays,
    squares: OfDelays,
}

impl DelayBlock {
    const EMPTY: Self = Self {
        count: 0,
        time: 0.0,
        sums: [0.0; DELAYS],
        squares: [0.0; DELAYS],
    };

    fn joined(mut self, other: &Self) -> Self {
        self.count += other.count;
        self.time += other.time;
        for at in 0..DELAYS {
            self.sums[at] += other.sums[at];
            self.squares[at] += other.squares[at];
        }
        self
    }

    /// Sum of squares about the mean, at each delay.
    fn scatter(&self) -> OfDelays {
        std::array::from_fn(|at| {
            self.squares[at] - self.sums[at] * self.sums[at] / self.count.max(1) as f64
        })
    }
}

/// Blocks of instants, bounded.
#[derive(Clone, Debug)]
struct DelayBlocks {
    /// instants per block
    size: usize,
    block: DelayBlock,
    blocks: Vec<DelayBlock>,
}

impl DelayBlocks {
    /// - `time`: of the instant, s.
    fn add(&mut self, time: f64, values: &OfDelays) {
        self.block.time += time;
        for (at, value) in values.iter().enumerate() {
            self.block.sums[at] += value;
            self.block.squares[at] += value * value;
        }
        self.block.count += 1;
        if self.block.count == self.size {
            self.blocks
                .push(std::mem::replace(&mut self.block, DelayBlock::EMPTY));
            if self.blocks.len() == MOST_BLOCKS {
                self.blocks = self
                    .blocks
                    .chunks_exact(2)
                    .map(|two| two[0].joined(&two[1]))
                    .collect();
                self.size *= 2;
            }
        }
    }

    /// Delay with the least sum of `of_block` over the blocks, with its jackknife uncertainty:
    /// constant, or with a steady drift if that is sure.
    ///
    /// - `period`: between two samples, s.
    /// - `ends`: first and last sample, s.
    fn offset(
        &self,
        period: f64,
        ends: [f64; 2],
        of_block: impl Fn(&DelayBlock) -> OfDelays,
    ) -> Option<ClockOffset> {
        if self.blocks.len() < LEAST_BLOCKS {
            return None;
        }
        let parts = Parts::of(&self.blocks, of_block);
        let drift = parts.drift().filter(|drift| is_sure(drift, parts.span()));
        let rate = drift.map_or(0.0, |[rate, _]| rate);
        let total = parts.total(rate);
        let offset = least(&total)?;
        let mean = total.iter().sum::<f64>() / DELAYS as f64;
        let lowest = lowest(&total);
        if lowest > LEAST_SHARE * mean
            || has_another(&total, lowest + OTHER_DEPTH * (mean - lowest))
        {
            return None;
        }
        let without: Vec<OfDelays> = (0..parts.curves.len())
            .map(|at| sum_of(&total, &parts.shifted(at, rate), -1.0))
            .collect();
        let fall = |sums: &OfDelays| sums[REACH] - self::lowest(sums);
        let fall_errors = in_errors(fall(&total), without.iter().map(fall));
        let without: Vec<f64> = without.iter().map(least).collect::<Option<_>>()?;
        let [step, every] = [STEP_NS, EVERY_NS].map(|ns| ns as f64 * 1e-9);
        let instants: usize = self.blocks.iter().map(|block| block.count).sum();
        // error of the steps, and of the sensor's averaging over a period
        let sigma = jackknife_variance(&without)
            .sqrt()
            .hypot(step / 2.0)
            .hypot(period / 2.0);
        let at = |t: f64| offset + rate * (t - parts.middle);
        let drift = drift.map(|[rate, rate_sigma]| ClockDrift {
            rate,
            rate_sigma,
            offset_at_first: at(ends[0]),
            offset_at_last: at(ends[1]),
        });
        let is_inside = offset.abs() + CLEAR_SIGMAS * sigma < SPAN_NS as f64 * 1e-9;
        let is_seen =
            drift.is_some() || offset.abs() <= CLEAR_SIGMAS * sigma || fall_errors >= LEAST_FALL;
        (is_inside && is_seen && sigma <= LARGEST_SIGMA).then_some(ClockOffset {
            offset,
            sigma,
            drift,
            evidence: ClockEvidence::Course(instants as f64 * every),
        })
    }
}

/// Curves of all blocks, each with its time.
struct Parts {
    /// of each block: middle time, s, and values
    curves: Vec<(f64, OfDelays)>,
    /// mean of the times, s
    middle: f64,
}

impl Parts {
    fn of(blocks: &[DelayBlock], of_block: impl Fn(&DelayBlock) -> OfDelays) -> Self {
        let curves: Vec<_> = blocks
            .iter()
            .map(|block| (block.time / block.count.max(1) as f64, of_block(block)))
            .collect();
        let middle = curves.iter().map(|(time, _)| time).sum::<f64>() / curves.len().max(1) as f64;
        Self { curves, middle }
    }

    /// Time from the first block to the last, s.
    fn span(&self) -> f64 {
        self.curves
            .first()
            .zip(self.curves.last())
            .map_or(0.0, |(first, last)| last.0 - first.0)
    }

    /// Sum of all curves at each delay in the middle, for a delay that grows by `rate`.
    fn total(&self, rate: f64) -> OfDelays {
        let all = 0..self.curves.len();
        all.fold([0.0; DELAYS], |total, at| {
            sum_of(&total, &self.shifted(at, rate), 1.0)
        })
    }

    /// Values of a block at each delay in the middle, for a delay that grows by `rate`.
    fn shifted(&self, block: usize, rate: f64) -> OfDelays {
        let (time, curve) = &self.curves[block];
        let shift = rate * (time - self.middle) / (STEP_NS as f64 * 1e-9);
        let mean = curve.iter().sum::<f64>() / DELAYS as f64;
        // nothing is known beyond the trial delays
        let value = |at: i64| {
            usize::try_from(at)
                .ok()
                .and_then(|at| curve.get(at))
                .copied()
                .unwrap_or(mean)
        };
        let (whole, share) = (shift.floor(), shift - shift.floor());
        std::array::from_fn(|at| {
            let before = at as i64 + whole as i64;
            value(before) * (1.0 - share) + value(before + 1) * share
        })
    }

    /// Rate with the lowest least sum, and its standard uncertainty: by the jackknife over all
    /// rates, since without a block it may be another one altogether. `None` at an end of the trial
    /// rates, and if the sum hardly falls by it.
    fn drift(&self) -> Option<[f64; 2]> {
        // one step of the rate is one step of the delay from end to end
        let rate_step = (STEP_NS as f64 * 1e-9 / self.span().max(f64::MIN_POSITIVE)).min(RATE_STEP);
        let count = ((LARGEST_RATE / rate_step) as i64).min(MOST_RATES);
        let rates: Vec<f64> = (-count..=count).map(|at| at as f64 * rate_step).collect();
        let totals: Vec<OfDelays> = rates.iter().map(|rate| self.total(*rate)).collect();
        let best = |depths: &[f64]| {
            let at = (0..depths.len()).min_by(|&a, &b| depths[a].total_cmp(&depths[b]))?;
            let (before, after) = (depths.get(at.checked_sub(1)?)?, depths.get(at + 1)?);
            Some(rates[at] + parabola([*before, depths[at], *after]) * rate_step)
        };
        let depths = |left_out: Option<usize>| {
            let depth = |(rate, total): (&f64, &OfDelays)| match left_out {
                Some(at) => lowest(&sum_of(total, &self.shifted(at, *rate), -1.0)),
                None => lowest(total),
            };
            rates.iter().zip(&totals).map(depth).collect::<Vec<_>>()
        };
        let all = depths(None);
        let rate = best(&all)?;
        let without: Vec<Vec<f64>> = (0..self.curves.len()).map(|at| depths(Some(at))).collect();
        let steady = rates.len() / 2;
        let drifting = (0..rates.len()).min_by(|&a, &b| all[a].total_cmp(&all[b]))?;
        let fall = |depths: &Vec<f64>| depths[steady] - depths[drifting];
        if in_errors(fall(&all), without.iter().map(fall)) < LEAST_FALL {
            return None;
        }
        let without: Vec<f64> = without
            .iter()
            .map(|depths| best(depths))
            .collect::<Option<_>>()?;
        // error of the steps of the delay
        let of_steps = STEP_NS as f64 * 0.5e-9 / self.span().max(f64::MIN_POSITIVE);
        let sigma = jackknife_variance(&without).sqrt().hypot(of_steps);
        (rate.abs() + CLEAR_SIGMAS * sigma < *rates.last()?).then_some([rate, sigma])
    }
}

/// One sum and `weight` times another, at each delay.
fn sum_of(one: &OfDelays, other: &OfDelays, weight: f64) -> OfDelays {
    std::array::from_fn(|at| one[at] + weight * other[at])
}

/// A sum over blocks in its standard errors, by the jackknife.
///
/// - `without`: the sum without each block.
fn in_errors(sum: f64, without: impl Iterator<Item = f64>) -> f64 {
    let without: Vec<f64> = without.collect();
    sum / jackknife_variance(&without).sqrt().max(f64::MIN_POSITIVE)
}

fn lowest(sums: &OfDelays) -> f64 {
    sums.iter().copied().fold(f64::INFINITY, f64::min)
}

impl Default for DelayBlocks {
    fn default() -> Self {
        Self {
            size: BLOCK,
            block: DelayBlock::EMPTY,
            blocks: Vec::new(),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct CourseSample {
    stamp_ns: i64,
    position: Vector3<f64>,
    force_o: Vector3<f64>,
    is_in_contact: bool,
}

/// Collects sliding and lifting, in bounded memory.
#[derive(Clone, Debug)]
pub(in crate::stylus) struct CourseClock {
    held: VecDeque<CourseSample>,
    /// stamps of the first and the last sample
    ends_ns: Option<[i64; 2]>,
    next_ns: i64,
    sliding: DelayBlocks,
    lifting: DelayBlocks,
}

impl Default for CourseClock {
    fn default() -> Self {
        let held = VecDeque::with_capacity(MOST_SAMPLES);
        Self {
            held,
            ends_ns: None,
            next_ns: i64::MIN,
            sliding: DelayBlocks::default(),
            lifting: DelayBlocks::default(),
        }
    }
}

impl CourseClock {
    /// Takes the next sample, later than the previous one.
    pub(crate) fn push(&mut self, sample: &ContactSample) {
        let (tip, is_in_contact) = (&sample.tip, sample.is_in_contact());
        let is_next =
            |last: &CourseSample| tip.stamp_ns.saturating_sub(last.stamp_ns) <= LONGEST_GAP_NS;
        if !self.held.back().is_none_or(is_next) {
            self.held.clear();
        }
        if self.held.len() == MOST_SAMPLES {
            self.held.pop_front();
        }
        let (stamp_ns, position) = (tip.stamp_ns, tip.pose_ot.translation.vector);
        self.ends_ns.get_or_insert([stamp_ns; 2])[1] = stamp_ns;
        self.held.push_back(CourseSample {
            stamp_ns,
            position,
            force_o: tip.force_o,
            is_in_contact,
        });
        let oldest_ns = stamp_ns.saturating_sub(2 * SPAN_NS);
        // the sample before that stays: it shows the length of the course
        while self
            .held
            .get(1)
            .is_some_and(|second| second.stamp_ns <= oldest_ns)
        {
            self.held.pop_front();
        }
        let is_covered = self.held.len() > 1
            && self
                .held
                .front()
                .is_some_and(|first| first.stamp_ns <= oldest_ns);
        if is_covered && stamp_ns >= self.next_ns {
            self.next_ns = stamp_ns.saturating_add(EVERY_NS);
            self.add(stamp_ns.saturating_sub(SPAN_NS));
        }
    }

    /// Compares the motion at `middle_ns` with the forces around it.
    fn add(&mut self, middle_ns: i64) {
        let [first_ns, _] = self.ends_ns.unwrap_or_default();
        let time = middle_ns.saturating_sub(first_ns) as f64 * 1e-9;
        let presses = self.held.iter().filter(|x| x.is_in_contact).count();
        if presses == self.held.len() {
            if let Some(values) = self.cosines(middle_ns) {
                self.sliding.add(time, &values);
            }
        } else if presses > 0
            && let Some(values) = self.forces_at_gap(middle_ns)
        {
            self.lifting.add(time, &values);
        }
    }

    /// F(t + δ) · v(t) / |F| |v|.
    fn cosines(&self, middle_ns: i64) -> Option<OfDelays> {
        let before = self.mean_position(middle_ns.saturating_sub(MEAN_NS), middle_ns)?;
        let way = self.mean_position(middle_ns, middle_ns.saturating_add(MEAN_NS))? - before;
        let length = way.norm();
        (length >= LEAST_SPEED * MEAN_NS as f64 * 1e-9).then(|| {
            self.at_delays(middle_ns, |force_o| {
                force_o.dot(&way) / (force_o.norm() * length).max(f64::MIN_POSITIVE)
            })
        })
    }

    /// F(t + δ) g(t), N m.
    fn forces_at_gap(&self, middle_ns: i64) -> Option<OfDelays> {
        let along = self
            .held
            .iter()
            .map(|x| x.force_o)
            .sum::<Vector3<f64>>()
            .try_normalize(0.0)?;
        let middle = self.mean_position(
            middle_ns.saturating_sub(EVERY_NS),
            middle_ns.saturating_add(EVERY_NS),
        )?;
        let lowest = self
            .held
            .iter()
            .map(|x| (x.position - middle).dot(&along))
            .fold(0.0, f64::min);
        Some(self.at_delays(middle_ns, |force_o| -lowest * force_o.dot(&along)))
    }

    fn mean_position(&self, from_ns: i64, to_ns: i64) -> Option<Vector3<f64>> {
        let first = self.held.partition_point(|x| x.stamp_ns < from_ns);
        let end = self
            .held
            .partition_point(|x| x.stamp_ns <= to_ns)
            .max(first + 1);
        (end <= self.held.len()).then(|| {
            self.held
                .range(first..end)
                .map(|x| x.position)
                .sum::<Vector3<f64>>()
                / (end - first) as f64
        })
    }

    /// `value` of the force at each delay, linear between two samples.
    fn at_delays(&self, middle_ns: i64, value: impl Fn(&Vector3<f64>) -> f64) -> OfDelays {
        let mut after = 1;
        std::array::from_fn(|at| {
            let wanted_ns = middle_ns.saturating_add((at as i64 - REACH as i64) * STEP_NS);
            while after + 1 < self.held.len() && self.held[after].stamp_ns < wanted_ns {
                after += 1;
            }
            let (one, two) = (&self.held[after - 1], &self.held[after]);
            let since = |from: i64, to: i64| to.saturating_sub(from) as f64;
            let share = since(one.stamp_ns, wanted_ns) / since(one.stamp_ns, two.stamp_ns).max(1.0);
            value(&one.force_o.lerp(&two.force_o, share.clamp(0.0, 1.0)))
        })
    }

    /// The delay; `None` if neither sliding nor lifting determines it, or the two differ.
    pub(crate) fn offset(&self) -> Option<ClockOffset> {
        let period = mean_period(self.held.iter().map(|x| x.stamp_ns));
        let ends = self
            .ends_ns
            .map(|[first, last]| [0.0, last.saturating_sub(first) as f64 * 1e-9])?;
        let lifting = self.lifting.offset(period, ends, |block| block.sums);
        match (
            self.sliding.offset(period, ends, DelayBlock::scatter),
            lifting,
        ) {
            (Some(sliding), Some(lifting)) => {
                let surer = if sliding.sigma <= lifting.sigma {
                    sliding
                } else {
                    lifting
                };
                sliding.agrees(&lifting).then_some(surer)
            }
            (sliding, lifting) => sliding.or(lifting),
        }
    }
}

/// Whether a drift is sure, and worth removing.
///
/// - `span`: time of observation, s.
fn is_sure([rate, sigma]: &[f64; 2], span: f64) -> bool {
    rate.abs() > SURE_SIGMAS * sigma && rate.abs() * span > LEAST_GAIN
}

/// Whether a sum is least at two delays apart, both below `limit`.
fn has_another(sums: &OfDelays, limit: f64) -> bool {
    let is_low =
        |at: &usize| sums[*at] < limit && sums[*at] <= sums[at - 1] && sums[*at] <= sums[at + 1];
    let mut low = (1..DELAYS - 1).filter(is_low);
    low.next()
        .zip(low.next_back())
        .is_some_and(|(first, last)| last - first > OTHER_STEPS)
}

/// Delay of the least sum, by the parabola through three points, s; `None` at an end.
fn least(sums: &OfDelays) -> Option<f64> {
    let at = (0..DELAYS).min_by(|&a, &b| sums[a].total_cmp(&sums[b]))?;
    let (before, after) = (sums.get(at.checked_sub(1)?)?, sums.get(at + 1)?);
    let shift = parabola([*before, sums[at], *after]);
    Some((at as f64 - REACH as f64 + shift) * STEP_NS as f64 * 1e-9)
}

/// Minimum of the parabola through three values, in steps from the middle one.
fn parabola([before, middle, after]: [f64; 3]) -> f64 {
    let bend = before - 2.0 * middle + after;
    if bend > 0.0 {
        0.5 * (before - after) / bend
    } else {
        0.0
    }
}
