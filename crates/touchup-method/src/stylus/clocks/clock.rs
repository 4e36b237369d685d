//! Clock offset: delay of the wrench clock, from the samples themselves.
//!
//! A ball that comes down onto a surface stops at the instant at which the force leaves zero. Along
//! the force, its centre p + F/k goes as c + v₋ min(t − t₀, 0) + v₊ max(t − t₀, 0), and the force
//! rises as A (1 − e^(−(t − t₁)/T)). The delay is δ = t₁ − t₀. A search within ± 120 ms finds the δ
//! at which the ball loses most speed along the force, over all onsets; around it, each onset gives
//! its least-squares profile over δ. Their sum gives δ, their differences its uncertainty. If
//! another stop, apart from the first, is as strong, the onsets are inconclusive. The course of
//! motion and force between the onsets ([`CourseClock`]) then decides, and overrules the onsets if
//! they are wrong.

use std::collections::VecDeque;

use nalgebra::{Vector2, Vector3};

use super::clock_offset::{ClockEvidence, ClockOffset, mean_period};
use super::course_clock::CourseClock;
use crate::stylus::{ContactSample, SettingError};
use touchup_geometry::numeric::{NormalEquations, direction, median};

/// Window of a stop, before and after it, s.
const BEFORE: f64 = 25e-3;
const AFTER: f64 = 15e-3;
/// Minimum time from the end of a contact to an onset, ns.
const CALM_NS: i64 = 25_000_000;
/// Largest delay of the search, s.
const SEARCHED: f64 = 0.12;
const SEARCH_STEP: f64 = 1e-3;
const SEARCHED_STEPS: usize = 2 * (SEARCHED / SEARCH_STEP) as usize + 1;
/// Window of the samples of an onset, on each side of the opening of the gate, ns.
const BEFORE_NS: i64 = 160_000_000;
const AFTER_NS: i64 = 150_000_000;
/// Minimum time between two distinct stops, s; a stop within half of it of an end of the search may
/// go on beyond.
const APART: f64 = 20e-3;
/// Maximum second stop, as a share of the first.
const SECOND_STOP: f64 = 0.7;
/// Start of the fit of the force's rise, before the gate opens, s.
const RISE_BEFORE: f64 = 8e-3;
/// End of the fit of the force's rise, after the gate opens, s: later the hand changes its motion.
const RISE_AFTER: f64 = 8e-3;
/// Trial delays around the result of the search: ± [`REACH`] steps of [`STEP`] s.
const REACH: usize = 48;
const STEP: f64 = 0.25e-3;
const DELAYS: usize = 2 * REACH + 1;
/// Maximum number of samples of an onset: 310 at 1 kHz, 1240 at 4 kHz.
const MOST_SAMPLES: usize = 1536;
/// Minimum number of samples for the fit of a line.
const LEAST_SAMPLES: usize = 16;
/// Minimum loss of speed at an onset, m/s.
const LEAST_STOP: f64 = 15e-3;
/// Maximum number of onsets, 4 MB at 4 kHz; later ones replace the first.
const MOST_ONSETS: usize = 128;
/// Minimum number of onsets that determines their spread.
const LEAST_ONSETS: usize = 8;
/// Error of the onset of a force that does not rise exponentially, s. Half a period of the wrench
/// adds to it: the part of the period over which a sensor averages is unknown.
const SHAPE: f64 = 0.3e-3;
/// Maximum uncertainty of an estimate, s.
const LARGEST_SIGMA: f64 = 3e-3;

/// Collects onsets of contact, in bounded memory.
#[derive(Clone, Debug)]
pub struct ClockEstimator {
    stiffness: Option<f64>,
    is_in_contact: bool,
    held: VecDeque<OnsetEntry>,
    /// stamp of the last start or end of contact, and the onset that waits for its samples
    turned_ns: Option<i64>,
    onset_ns: Option<i64>,
    /// mean time between two samples, at the last onset, s
    period: f64,
    onsets: VecDeque<OnsetWindow>,
    course: CourseClock,
}

/// Samples around the opening of the gate, and the start of the force, s after it.
#[derive(Clone, Debug)]
struct OnsetWindow {
    samples: Vec<OnsetSample>,
    begun: f64,
}

#[derive(Clone, Copy, Debug)]
struct OnsetEntry {
    stamp_ns: i64,
    position: Vector3<f64>,
    force_o: Vector3<f64>,
}

/// −log likelihood of one onset at each delay.
type LikelihoodProfile = [f64; DELAYS];

impl ClockEstimator {
    /// - `stiffness`: of stylus and probe, N/m; `None`: rigid.
    ///
    /// # Errors
    /// [`SettingError`] for a stiffness that is not positive and finite.
    pub fn new(stiffness: Option<f64>) -> Result<Self, SettingError> {
        let value = stiffness.unwrap_or(1.0);
        SettingError::check("tip stiffness (N/m)", value, value > 0.0, "more than 0")?;
        let held = VecDeque::with_capacity(MOST_SAMPLES);
        let onsets = VecDeque::new();
        let course = CourseClock::default();
        Ok(Self {
            stiffness,
            is_in_contact: false,
            held,
            turned_ns: None,
            onset_ns: None,
            period: 0.0,
            onsets,
            course,
        })
    }

    /// Takes the next sample, later than the previous one.
    pub fn push(&mut self, sample: &ContactSample) {
        self.course.push(sample);
        let (tip, is_in_contact) = (&sample.tip, sample.is_in_contact());
        let was_in_contact = std::mem::replace(&mut self.is_in_contact, is_in_contact);
        if self.held.len() == MOST_SAMPLES {
            self.held.pop_front();
        }
        let position = tip.pose_ot.translation.vector;
        self.held.push_back(OnsetEntry {
            stamp_ns: tip.stamp_ns,
            position,
            force_o: tip.force_o,
        });
        if self
            .onset_ns
            .is_some_and(|onset_ns| tip.stamp_ns.saturating_sub(onset_ns) >= AFTER_NS)
            && let Some(onset_ns) = self.onset_ns.take()
            && let Some(onset) = self.onset(onset_ns)
        {
            if self.onsets.len() == MOST_ONSETS {
                self.onsets.pop_front();
            }
            self.onsets.push_back(onset);
            self.period = mean_period(self.held.iter().map(|x| x.stamp_ns));
        }
        if was_in_contact != is_in_contact {
            let was_calm = self
                .turned_ns
                .is_none_or(|turned_ns| tip.stamp_ns.saturating_sub(turned_ns) >= CALM_NS);
            if is_in_contact && was_calm && self.onset_ns.is_none() {
                self.onset_ns = Some(tip.stamp_ns);
            }
            self.turned_ns = Some(tip.stamp_ns);
        }
    }

    /// Delay by all onsets; if they do not determine it, or the course of motion and force
    /// contradicts them or shows a drift, by the course; `None` if neither determines it.
    pub fn offset(&self) -> Option<ClockOffset> {
        let (onsets, course) = (self.by_onsets(), self.course.offset());
        match (onsets, course) {
            // onsets give the mean of a clock that drifts
            (Some(onsets), Some(course)) if course.drift.is_some() || !onsets.agrees(&course) => {
                Some(course)
            }
            (onsets, course) => onsets.or(course),
        }
    }

    fn by_onsets(&self) -> Option<ClockOffset> {
        if self.onsets.len() < LEAST_ONSETS {
            return None;
        }
        let coarse = self.searched()?;
        let bend = 1.0 / self.stiffness.unwrap_or(f64::INFINITY);
        let profiles: Vec<LikelihoodProfile> = self
            .onsets
            .iter()
            .filter_map(|onset| onset.profile(coarse, bend))
            .collect();
        if profiles.len() < LEAST_ONSETS {
            return None;
        }
        let sum: LikelihoodProfile =
            std::array::from_fn(|at| profiles.iter().map(|profile| profile[at]).sum());
        let best = (0..DELAYS).min_by(|&a, &b| sum[a].total_cmp(&sum[b]))?;
        // slopes over ±3 steps smooth the rounding of single samples
        const SPAN: usize = 3;
        if best < 2 * SPAN || best + 2 * SPAN >= DELAYS {
            return None;
        }
        let width = SPAN as f64 * STEP;
        let slope = |x: &LikelihoodProfile| (x[best + SPAN] - x[best - SPAN]) / (2.0 * width);
        let bend = (sum[best + SPAN] - 2.0 * sum[best] + sum[best - SPAN]) / (width * width);
        if bend <= 0.0 {
            return None;
        }
        let shift = -slope(&sum) / bend;
        let mean_slope = slope(&sum) / profiles.len() as f64;
        let scatter: f64 = profiles
            .iter()
            .map(|x| (slope(x) - mean_slope).powi(2))
            .sum();
        let sigma = (scatter / (bend * bend) + SHAPE * SHAPE + (self.period / 2.0).powi(2)).sqrt();
        let offset = coarse + (best as f64 - REACH as f64) * STEP + shift.clamp(-width, width);
        let is_inside = offset.abs() <= SEARCHED - APART / 2.0;
        (is_inside && sigma <= LARGEST_SIGMA).then_some(ClockOffset {
            offset,
            sigma,
            drift: None,
            evidence: ClockEvidence::Onsets(profiles.len()),
        })
    }

    /// Delay at which the ball loses most speed, by the median of all onsets; `None` if it stops at
    /// two delays.
    fn searched(&self) -> Option<f64> {
        let at_step = |step: usize| (step as f64 - (SEARCHED_STEPS / 2) as f64) * SEARCH_STEP;
        let stops: Vec<f64> = (0..SEARCHED_STEPS)
            .map(|step| {
                let mut stops: Vec<f64> = self
                    .onsets
                    .iter()
                    .filter_map(|onset| onset.stop(at_step(step)))
                    .collect();
                let is_seen = stops.len() >= LEAST_ONSETS.max(self.onsets.len() / 2);
                // the median ignores one odd onset, as of a ball leaving an edge
                if is_seen {
                    median(&mut stops).unwrap_or(0.0)
                } else {
                    0.0
                }
            })
            .collect();
        let best = (0..SEARCHED_STEPS).max_by(|&a, &b| stops[a].total_cmp(&stops[b]))?;
        let apart = (APART / SEARCH_STEP) as usize;
        let second = (0..SEARCHED_STEPS)
            .filter(|step| step.abs_diff(best) > apart)
            .map(|step| stops[step]);
        let is_alone = second.fold(0.0, f64::max) <= SECOND_STOP * stops[best];
        (is_alone && stops[best] >= LEAST_STOP).then(|| at_step(best))
    }

    /// Onset at `onset_ns`; `None` if the samples around it do not show one.
    fn onset(&self, onset_ns: i64) -> Option<OnsetWindow> {
        let around = self
            .held
            .iter()
            .filter(|x| (-BEFORE_NS..=AFTER_NS).contains(&x.stamp_ns.saturating_sub(onset_ns)));
        let of_press = |x: &&OnsetEntry| {
            (0.0..=AFTER).contains(&(x.stamp_ns.saturating_sub(onset_ns) as f64 * 1e-9))
        };
        let pressed: Vector3<f64> = around.clone().filter(of_press).map(|x| x.force_o).sum();
        let along = direction(&pressed)?;
        let of_entry = |x: &OnsetEntry| {
            let t = x.stamp_ns.saturating_sub(onset_ns) as f64 * 1e-9;
            OnsetSample {
                t,
                centre: x.position.dot(&along),
                force: x.force_o.dot(&along),
            }
        };
        let mut samples: Vec<OnsetSample> = around.map(of_entry).collect();
        if samples.len() < LEAST_SAMPLES || samples[0].t > -0.6 * BEFORE {
            return None;
        }
        // centred, so that far-off positions keep the digits of a micrometre
        let middle = samples[samples.len() / 2].centre;
        samples.iter_mut().for_each(|x| x.centre -= middle);
        let begun = force_begins(&samples)?;
        Some(OnsetWindow { samples, begun })
    }
}

impl OnsetWindow {
    /// Samples around an instant; `None` if they do not cover it.
    fn around(&self, t: f64) -> Option<&[OnsetSample]> {
        let first = self.samples.partition_point(|x| x.t < t - BEFORE);
        let end = self.samples.partition_point(|x| x.t <= t + AFTER);
        let around = self.samples.get(first..end)?;
        let is_covered = around.len() >= LEAST_SAMPLES
            && around.first()?.t <= t - 0.6 * BEFORE
            && around.last()?.t >= t + 0.6 * AFTER;
        is_covered.then_some(around)
    }

    /// Speed along the force that the ball loses `delay` before the force begins, m/s.
    fn stop(&self, delay: f64) -> Option<f64> {
        let begun = self.begun - delay;
        let row = |x: &OnsetSample| {
            let t = x.t - begun;
            (Vector3::new(1.0, t.min(0.0), t.max(0.0)), x.centre)
        };
        let solved = NormalEquations::of(self.around(begun)?.iter().map(row)).solution()?;
        Some(solved.z - solved.y)
    }

    /// - `coarse`: delay in the middle of the profile, s.
    /// - `bend`: compliance of the stylus, m/N.
    fn profile(&self, coarse: f64, bend: f64) -> Option<LikelihoodProfile> {
        let around = self.around(self.begun - coarse)?;
        let mut profile = [0.0; DELAYS];
        let (mut stop, mut least) = (0.0, f64::INFINITY);
        for (at, out) in profile.iter_mut().enumerate() {
            let delay = coarse + (at as f64 - REACH as f64) * STEP;
            let (left, speeds) = kink(around, &self.samples, self.begun, delay, bend)?;
            *out = 0.5 * around.len() as f64 * left.max(f64::MIN_POSITIVE).ln();
            if left < least {
                (least, stop) = (left, speeds[1] - speeds[0]);
            }
        }
        (stop >= LEAST_STOP).then_some(profile)
    }
}

/// A sample of an onset along the force.
#[derive(Clone, Copy, Debug)]
struct OnsetSample {
    /// s after the gate opened
    t: f64,
    /// position of the reported ball, m
    centre: f64,
    /// N
    force: f64,
}

/// Onset of the force: least squares of offset and A (1 − e^(−(t − t₁)/T)) over t₁ and T.
fn force_begins(samples: &[OnsetSample]) -> Option<f64> {
    let rise = || {
        samples
            .iter()
            .filter(|x| (-2.0 * RISE_BEFORE..=RISE_AFTER).contains(&x.t))
    };
    let mut best: Option<(f64, f64)> = None;
    for time in [2e-3, 4e-3, 7e-3, 10e-3, 15e-3, 30e-3] {
        for step in 0..=90 {
            let begun = 1e-3 - f64::from(step) * 1e-4;
            let row = |x: &OnsetSample| {
                (
                    Vector2::new(1.0, -(-(x.t - begun).max(0.0) / time).exp_m1()),
                    x.force,
                )
            };
            let equations = NormalEquations::of(rise().map(row));
            let Some(solved) = equations.solution() else {
                continue;
            };
            let left = equations.residual_square(&solved);
            if best.is_none_or(|(least, _)| left < least) {
                best = Some((left, begun));
            }
        }
    }
    best.map(|(_, begun)| begun)
}

/// Residual of the centre's path from a bent line, and the speeds before and after the bend.
///
/// - `around`: samples around the stop, out of `samples`.
fn kink(
    around: &[OnsetSample],
    samples: &[OnsetSample],
    begun: f64,
    delay: f64,
    bend: f64,
) -> Option<(f64, [f64; 2])> {
    let row = |x: &OnsetSample| {
        let t = x.t - (begun - delay);
        (
            Vector3::new(1.0, t.min(0.0), t.max(0.0)),
            x.centre + force_at(samples, x.t + delay) * bend,
        )
    };
    let equations = NormalEquations::of(around.iter().map(row));
    let solved = equations.solution()?;
    Some((equations.residual_square(&solved), [solved.y, solved.z]))
}

/// Linear between samples, constant beyond them.
fn force_at(samples: &[OnsetSample], t: f64) -> f64 {
    let after = samples.partition_point(|x| x.t <= t);
    match (
        after.checked_sub(1).and_then(|i| samples.get(i)),
        samples.get(after),
    ) {
        (Some(a), Some(b)) => a.force + (b.force - a.force) * (t - a.t) / (b.t - a.t),
        (Some(only), None) | (None, Some(only)) => only.force,
        (None, None) => 0.0,
    }
}
