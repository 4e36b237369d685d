//! The whole course of motion and force, in blocks.
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

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::clock_offset::mean_period;
use super::delay_part::{DELAYS, DelayPart, OfDelays, REACH, SPAN_NS, STEP_NS, lowest};
use crate::stylus::ContactSample;

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
/// Instants of a block that count for its likelihood: a velocity spans 70 ms.
const INDEPENDENT: f64 = 8.0;
/// Variance of the cosine of a steady sliding.
const STEADY: f64 = 2e-3;
/// Maximum least mean of F g, as a share of that over all delays: above it nothing lifted.
const LEAST_SHARE: f64 = 0.7;

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

    fn part(&self, against: OfDelays) -> Option<DelayPart> {
        DelayPart::new(self.time / self.count as f64, &against)
    }

    /// Of sliding: the variance of the cosine.
    fn sliding(&self) -> Option<DelayPart> {
        let count = self.count as f64;
        self.part(std::array::from_fn(|at| {
            let variance = self.squares[at] / count - (self.sums[at] / count).powi(2);
            0.5 * INDEPENDENT * (variance.max(0.0) + STEADY).ln()
        }))
    }

    /// Of lifting: F g as a share of its mean.
    fn lifting(&self) -> Option<DelayPart> {
        let mean = self.sums.iter().sum::<f64>() / DELAYS as f64;
        self.part(self.sums.map(|sum| INDEPENDENT * sum / mean))
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
pub(super) struct CourseBlocks {
    held: VecDeque<CourseSample>,
    /// stamps of the first and the last sample
    ends_ns: Option<[i64; 2]>,
    next_ns: i64,
    sliding: DelayBlocks,
    lifting: DelayBlocks,
}

impl Default for CourseBlocks {
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

impl CourseBlocks {
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
        let time = self.since_first(middle_ns);
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

    /// What sliding tells.
    pub(crate) fn sliding(&self) -> Vec<DelayPart> {
        let blocks = self.sliding.blocks.iter();
        blocks.filter_map(DelayBlock::sliding).collect()
    }

    /// What lifting tells; empty if nothing lifted.
    pub(crate) fn lifting(&self) -> Vec<DelayPart> {
        let blocks = &self.lifting.blocks;
        let total: OfDelays =
            std::array::from_fn(|at| blocks.iter().map(|block| block.sums[at]).sum());
        let mean = total.iter().sum::<f64>() / DELAYS as f64;
        if lowest(&total) > LEAST_SHARE * mean {
            return Vec::new();
        }
        blocks.iter().filter_map(DelayBlock::lifting).collect()
    }

    /// Time of the evidence in full blocks of sliding and of lifting, s.
    pub(crate) fn seconds(&self) -> [f64; 2] {
        [&self.sliding, &self.lifting].map(|of| {
            let instants: usize = of.blocks.iter().map(|block| block.count).sum();
            instants as f64 * EVERY_NS as f64 * 1e-9
        })
    }

    /// Mean time between two samples, s.
    pub(crate) fn period(&self) -> f64 {
        mean_period(self.held.iter().map(|x| x.stamp_ns))
    }

    /// A stamp, s after the first sample.
    pub(crate) fn since_first(&self, stamp_ns: i64) -> f64 {
        let first_ns = self.ends_ns.map_or(stamp_ns, |[first_ns, _]| first_ns);
        stamp_ns.saturating_sub(first_ns) as f64 * 1e-9
    }

    /// Time from the first sample to the last, s.
    pub(crate) fn lasts(&self) -> f64 {
        self.ends_ns
            .map_or(0.0, |[_, last_ns]| self.since_first(last_ns))
    }
}
