//! Course of the delay over the time of observation: steady, drifting evenly, or stepping once.
//!
//! The −log likelihoods of all parts of the evidence sum up, each read at the delay that the course
//! has then. The courses compete by their least sums, each with a price for its unknowns.
//!
//! **Drift**: two independent clocks differ in rate by up to some 100 ppm, 30 ms after five
//! minutes; one that counts samples of an assumed rate, by more. The delay is δ + ε (t − t̄).
//!
//! **Step**: a clock that is set, or a driver that starts again. The delay is δ₀ before t₀ and δ₁
//! from then on; t₀ lies between two parts of the evidence, anywhere alike.

use nalgebra::{Matrix2, Vector2};

use super::delay_part::{DELAYS, DelayPart, OfDelays, REACH, STEP, TimedDelay, lowest, trial};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, median};

/// Maximum of the least sum, as a share of its mean over all delays: above it nothing turned, or
/// stopped.
const LEAST_SHARE: f64 = 0.7;
/// Another delay may be as good if its sum is lower than the mean by all but this share: the motion
/// repeats within the span.
const OTHER_DEPTH: f64 = 0.4;
/// Minimum distance of two equally good delays, in steps.
const OTHER_STEPS: usize = 20;
/// Minimum number of parts that determines their spread, and of those on each side of a step.
pub(super) const LEAST_PARTS: usize = 8;
const LEAST_ON_SIDE: usize = 4;
/// Maximum rate of drift.
const LARGEST_RATE: f64 = 5e-3;
/// Rounds of reweighting, and least scatter of single delays, s.
const ROUNDS: usize = 12;
const LEAST_SCATTER: f64 = 0.5e-3;
/// Price of an unknown, as a −log likelihood.
const PRICE: f64 = 3.0;

/// The delay as a linear function of its two unknowns.
#[derive(Clone, Copy, Debug)]
pub(super) enum CourseShape {
    /// one delay, s
    Steady,
    /// a delay at this time, s, and a rate
    Drifting(f64),
    /// a delay before and one from this time on, s, with its standard uncertainty
    Stepping([f64; 2]),
}

impl CourseShape {
    /// Share of each unknown in the delay at this time, s.
    pub(crate) fn row(self, time: f64) -> Vector2<f64> {
        match self {
            Self::Steady => Vector2::x(),
            Self::Drifting(middle) => Vector2::new(1.0, time - middle),
            Self::Stepping([at, _]) if time < at => Vector2::x(),
            Self::Stepping(_) => Vector2::y(),
        }
    }

    /// Information that makes up for an unknown that the shape lacks.
    fn unused(self) -> Matrix2<f64> {
        match self {
            Self::Steady => Matrix2::from_diagonal(&Vector2::y()),
            Self::Drifting(_) | Self::Stepping(_) => Matrix2::zeros(),
        }
    }

    fn price(self) -> f64 {
        PRICE
            * match self {
                Self::Steady => 1.0,
                Self::Drifting(_) => 2.0,
                Self::Stepping(_) => 3.0,
            }
    }
}

/// A delay at any time.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClockCourse {
    pub shape: CourseShape,
    /// delay of a steady course; in the middle, and the rate; or before a step, and after it
    pub unknowns: Vector2<f64>,
    /// their covariance
    pub covariance: Matrix2<f64>,
}

impl ClockCourse {
    fn of(shape: CourseShape, unknowns: [f64; 2]) -> Self {
        Self {
            shape,
            unknowns: unknowns.into(),
            covariance: Matrix2::zeros(),
        }
    }

    /// One delay, s.
    pub(crate) fn steady(delay: f64) -> Self {
        Self::of(CourseShape::Steady, [delay, 0.0])
    }

    /// Delay at a time, s.
    pub(crate) fn at(&self, time: f64) -> f64 {
        self.shape.row(time).dot(&self.unknowns)
    }

    /// The course with a delay further by `shift`, s.
    fn further(&self, shift: f64) -> Self {
        let all = match self.shape {
            CourseShape::Steady | CourseShape::Drifting(_) => Vector2::x(),
            CourseShape::Stepping(_) => Vector2::repeat(1.0),
        };
        Self {
            unknowns: self.unknowns + shift * all,
            ..*self
        }
    }

    /// −log likelihood.
    pub(crate) fn against(&self, parts: &[DelayPart]) -> f64 {
        parts
            .iter()
            .map(|part| part.against(self.at(part.time)))
            .sum()
    }

    /// Whether the parts determine it: they contradict any other delay.
    pub(crate) fn is_clear(&self, parts: &[DelayPart]) -> bool {
        let sides: Vec<&[DelayPart]> = match self.shape {
            CourseShape::Steady | CourseShape::Drifting(_) => vec![parts],
            CourseShape::Stepping([at, _]) => {
                let (before, after) = parts.split_at(parts.partition_point(|part| part.time < at));
                vec![before, after]
            }
        };
        sides.into_iter().all(|side| {
            let here = side
                .get(side.len() / 2)
                .map_or(0.0, |part| self.at(part.time));
            let total: OfDelays =
                std::array::from_fn(|at| self.further(trial(at) - here).against(side));
            let mean = total.iter().sum::<f64>() / DELAYS as f64;
            let lowest = lowest(&total);
            lowest <= LEAST_SHARE * mean
                && !has_another(&total, lowest + OTHER_DEPTH * (mean - lowest))
        })
    }

    /// Whether single delays are enough to tell it.
    fn is_told_by(&self, delays: &[TimedDelay]) -> bool {
        let on_side = |side: Vector2<f64>| {
            let rows = delays.iter().map(|of| self.shape.row(of.time));
            rows.filter(|row| *row == side).count()
        };
        let is_on_sides = match self.shape {
            CourseShape::Steady | CourseShape::Drifting(_) => true,
            CourseShape::Stepping(_) => {
                on_side(Vector2::x()).min(on_side(Vector2::y())) >= LEAST_ON_SIDE
            }
        };
        delays.len() >= LEAST_PARTS && is_on_sides
    }

    /// The course through single delays, with its covariance by their scatter; one that is far from
    /// the others does not count. `None` for too few.
    pub(crate) fn through(mut self, delays: &[TimedDelay]) -> Option<Self> {
        if !self.is_told_by(delays) {
            return None;
        }
        for _ in 0..ROUNDS {
            let off = |of: &TimedDelay| of.delay - self.at(of.time);
            let mut sizes: Vec<f64> = delays.iter().map(|of| off(of).abs()).collect();
            let sigma = SIGMA_OF_MEDIAN * median(&mut sizes)?;
            let width = TUKEY_WIDTH * sigma.max(LEAST_SCATTER);
            let (mut information, mut scatter) = (self.shape.unused(), Matrix2::zeros());
            let mut right = Vector2::zeros();
            for of in delays {
                let (row, off) = (self.shape.row(of.time), off(of));
                let weight = biweight((off / width).powi(2));
                let pull = row * (weight * (LEAST_SCATTER / of.sigma.max(LEAST_SCATTER)).powi(2));
                information += pull * row.transpose();
                right += pull * off;
                scatter += pull * pull.transpose() * off * off;
            }
            let inverse = information.try_inverse()?;
            self.unknowns += inverse * right;
            self.covariance = inverse * scatter * inverse;
        }
        Some(self)
    }
}

/// The likeliest steady course.
///
/// - `parts`: in order of time.
pub(super) fn steady(parts: &[DelayPart]) -> ClockCourse {
    let total: OfDelays =
        std::array::from_fn(|at| parts.iter().map(|part| part.against(trial(at))).sum());
    ClockCourse::steady(least(&total))
}

/// The likeliest drift and the likeliest step, the likelier of them first.
///
/// - `parts`: in order of time.
pub(super) fn changes(parts: &[DelayPart]) -> Vec<ClockCourse> {
    let mut found: Vec<ClockCourse> = drifting(parts).into_iter().chain(stepping(parts)).collect();
    found.sort_by(|one, other| odds(other, one, parts).total_cmp(&0.0));
    found
}

/// How much likelier one course is than another, with the price of their unknowns.
pub(super) fn odds(one: &ClockCourse, other: &ClockCourse, parts: &[DelayPart]) -> f64 {
    let cost = |of: &ClockCourse| of.against(parts) + of.shape.price();
    cost(other) - cost(one)
}

fn drifting(parts: &[DelayPart]) -> Option<ClockCourse> {
    let span = parts.last()?.time - parts.first()?.time;
    let middle = parts.iter().map(|part| part.time).sum::<f64>() / parts.len() as f64;
    // one step of the rate is one step of the delay from end to end
    let step = STEP / span.max(f64::MIN_POSITIVE);
    let count = ((LARGEST_RATE / step) as i64).min(DELAYS as i64 / 2);
    let at_rate = |rate: i64| {
        let course = ClockCourse::of(CourseShape::Drifting(middle), [0.0, rate as f64 * step]);
        let total: OfDelays = std::array::from_fn(|at| course.further(trial(at)).against(parts));
        (lowest(&total), course.further(least(&total)))
    };
    let rates = (-count..=count).map(at_rate);
    rates
        .min_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, course)| course)
}

/// The step's time is the mean over all times between parts, each by its likelihood.
fn stepping(parts: &[DelayPart]) -> Option<ClockCourse> {
    let each: Vec<OfDelays> = parts
        .iter()
        .map(|part| std::array::from_fn(|at| part.against(trial(at))))
        .collect();
    let plus = |sum: &OfDelays, other: &OfDelays, sign: f64| -> OfDelays {
        std::array::from_fn(|at| sum[at] + sign * other[at])
    };
    let mut after = each
        .iter()
        .fold([0.0; DELAYS], |sum, of| plus(&sum, of, 1.0));
    let mut before = [0.0; DELAYS];
    let mut splits = Vec::new();
    for (at, of) in each.iter().enumerate() {
        let is_split = at >= LEAST_ON_SIDE && at + LEAST_ON_SIDE <= parts.len();
        if is_split {
            let sides = [before, after];
            splits.push((
                at,
                sides.iter().map(|of| lowest(of)).sum::<f64>(),
                sides.map(|of| least(&of)),
            ));
        }
        (before, after) = (plus(&before, of, 1.0), plus(&after, of, -1.0));
    }
    let (_, best, sides) = splits
        .iter()
        .min_by(|one, other| one.1.total_cmp(&other.1))?;
    let at = time_of(splits.iter().map(|(at, against, _)| {
        let ends = [parts[at - 1].time, parts[*at].time];
        (ends, (best - against).exp())
    }));
    Some(ClockCourse::of(CourseShape::Stepping(at), *sides))
}

/// Mean and standard deviation of a time that is anywhere alike in each interval.
///
/// - `intervals`: of each its ends, s, and density.
fn time_of(intervals: impl Iterator<Item = ([f64; 2], f64)>) -> [f64; 2] {
    let (mut whole, mut first, mut second) = (0.0, 0.0, 0.0);
    for ([from, to], density) in intervals {
        let weight = density * (to - from).max(f64::MIN_POSITIVE);
        let middle = (from + to) / 2.0;
        whole += weight;
        first += weight * middle;
        second += weight * (middle * middle + (to - from).powi(2) / 12.0);
    }
    let mean = first / whole;
    [mean, (second / whole - mean * mean).max(0.0).sqrt()]
}

/// The delay of the least sum, s.
fn least(sums: &OfDelays) -> f64 {
    let at = (0..DELAYS).min_by(|&a, &b| sums[a].total_cmp(&sums[b]));
    trial(at.unwrap_or(REACH))
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
