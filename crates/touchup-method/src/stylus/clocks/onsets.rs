//! Onsets of contact: the ball stops as the force begins.
//!
//! A ball that comes down onto a surface stops at the instant at which the force leaves zero. Along
//! the force, its centre p + F/k goes as c + v₋ min(t − t₀, 0) + v₊ max(t − t₀, 0), and the force
//! rises as A (1 − e^(−(t − t₁)/T)). The delay is δ = t₁ − t₀. At each δ, the residual of the bent
//! line is a likelihood; a δ at which the ball does not come down, or goes on afterwards, is none.

use std::collections::VecDeque;

use nalgebra::{Vector2, Vector3};

use super::clock_offset::mean_period;
use super::delay_part::{DelayPart, MOST, STEP, TimedDelay, trial};
use crate::stylus::ContactSample;
use touchup_geometry::numeric::{NormalEquations, direction};

/// Window of a stop, before and after it, s.
const BEFORE: f64 = 25e-3;
const AFTER: f64 = 15e-3;
/// Minimum time from the end of a contact to an onset, ns.
const CALM_NS: i64 = 25_000_000;
/// Largest delay of an onset, s: a stop beyond it may go on beyond the samples around it.
pub(super) const LARGEST_DELAY: f64 = 0.11;
/// Window of the samples of an onset, on each side of the opening of the gate, ns.
const BEFORE_NS: i64 = 160_000_000;
const AFTER_NS: i64 = 150_000_000;
/// Start of the fit of the force's rise, before the gate opens, s.
const RISE_BEFORE: f64 = 8e-3;
/// End of the fit of the force's rise, after the gate opens, s: later the hand changes its motion.
const RISE_AFTER: f64 = 8e-3;
/// Maximum number of samples of an onset: 310 at 1 kHz, 1240 at 4 kHz.
const MOST_SAMPLES: usize = 1536;
/// Minimum number of samples for the fit of a line.
const LEAST_SAMPLES: usize = 16;
/// Minimum speed of the ball before it stops, m/s, and maximum share of it that it keeps as it
/// slides on.
const LEAST_SPEED: f64 = 15e-3;
const KEPT_SPEED: f64 = 0.5;
/// Stops that compete with one, on both sides, in steps of the trial delays.
const NEAR: i32 = 3;
/// Delays around a coarse one: ± [`FINE_REACH`] steps of [`FINE_STEP`] s.
const FINE_REACH: i32 = 24;
const FINE_STEP: f64 = 0.25e-3;
/// Standard deviation of the noise of the best poses, m.
const LEAST_NOISE: f64 = 5e-6;
/// Maximum number of onsets, 4 MB at 4 kHz; at this number, every second one stays.
const MOST_ONSETS: usize = 128;

/// Collects onsets of contact, in bounded memory.
#[derive(Clone, Debug)]
pub(super) struct ContactOnsets {
    is_in_contact: bool,
    held: VecDeque<OnsetEntry>,
    /// stamp of the last start or end of contact, and the onset that waits for its samples
    turned_ns: Option<i64>,
    onset_ns: Option<i64>,
    /// mean time between two samples, at the last onset, s
    pub period: f64,
    /// one of `every` seen
    pub onsets: Vec<OnsetWindow>,
    every: usize,
    seen: usize,
}

/// Samples around the opening of the gate, and the start of the force, s after it.
#[derive(Clone, Debug)]
pub(super) struct OnsetWindow {
    pub stamp_ns: i64,
    samples: Vec<OnsetSample>,
    begun: f64,
}

#[derive(Clone, Copy, Debug)]
struct OnsetEntry {
    stamp_ns: i64,
    position: Vector3<f64>,
    force_o: Vector3<f64>,
}

impl Default for ContactOnsets {
    fn default() -> Self {
        Self {
            is_in_contact: false,
            held: VecDeque::with_capacity(MOST_SAMPLES),
            turned_ns: None,
            onset_ns: None,
            period: 0.0,
            onsets: Vec::new(),
            every: 1,
            seen: 0,
        }
    }
}

impl ContactOnsets {
    /// Takes the next sample, later than the previous one.
    pub(crate) fn push(&mut self, sample: &ContactSample) {
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
            if self.seen.is_multiple_of(self.every) {
                self.onsets.push(onset);
            }
            self.seen += 1;
            if self.onsets.len() == MOST_ONSETS {
                self.every *= 2;
                let mut number = 0..;
                self.onsets
                    .retain(|_| number.next().is_some_and(|at: usize| at.is_multiple_of(2)));
            }
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
        Some(OnsetWindow {
            stamp_ns: onset_ns,
            samples,
            begun,
        })
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

    /// −log likelihood of a stop at each trial delay, clearly likelier than a steady deceleration: each
    /// competes with stops shortly before and after it, in one window of samples. `None` if there
    /// is none.
    ///
    /// - `time`: of the onset, s.
    /// - `bend`: compliance of the stylus, m/N.
    pub(crate) fn part(&self, time: f64, bend: f64) -> Option<DelayPart> {
        let against = |at: usize| {
            let delay = trial(at);
            let near = self.around(self.begun - delay)?;
            let kink = |delay| self.kink(near, delay, bend);
            let (here, [before, after]) = kink(delay)?;
            let is_stop = before <= -LEAST_SPEED
                && after.abs() <= KEPT_SPEED * before.abs()
                && here + MOST < self.slowed(near, delay, bend)?;
            let others = (-NEAR..=NEAR).map(|by| kink(delay + f64::from(by) * STEP));
            let others = others.flatten().map(|(other, _)| other);
            is_stop.then(|| here - others.fold(here, f64::min))
        };
        DelayPart::new(
            time,
            &std::array::from_fn(|at| against(at).unwrap_or(f64::INFINITY)),
        )
    }

    /// Its delay near another one, s.
    ///
    /// - `time`: of the onset, s.
    pub(crate) fn delay(&self, time: f64, coarse: f64, bend: f64) -> Option<TimedDelay> {
        let near = self.around(self.begun - coarse)?;
        let trials = (-FINE_REACH..=FINE_REACH).map(|at| coarse + f64::from(at) * FINE_STEP);
        let trials = trials.map(|delay| Some((delay, self.kink(near, delay, bend)?.0)));
        TimedDelay::of(time, trials.collect::<Option<Vec<_>>>()?.into_iter())
    }

    /// −log likelihood of a stop of the centre in a window of samples, and the speeds before and
    /// after it, m/s.
    fn kink(&self, near: &[OnsetSample], delay: f64, bend: f64) -> Option<(f64, [f64; 2])> {
        let begun = self.begun - delay;
        let rows = |t: f64| Vector3::new(1.0, (t - begun).min(0.0), (t - begun).max(0.0));
        let (against, path) = self.path(near, delay, bend, rows)?;
        Some((against, [path.y, path.z]))
    }

    /// −log likelihood of a steady deceleration that ends later, or beyond the window.
    fn slowed(&self, near: &[OnsetSample], delay: f64, bend: f64) -> Option<f64> {
        let path = |later: f64| {
            let rest = self.begun - delay + later;
            let rows = |t: f64| Vector3::new(1.0, (t - rest).min(0.0), (t - rest).min(0.0).powi(2));
            Some(self.path(near, delay, bend, rows)?.0)
        };
        Some(path(AFTER / 2.0)?.min(path(AFTER)?))
    }

    /// −log likelihood of a path of the centre, and its coefficients.
    fn path(
        &self,
        near: &[OnsetSample],
        delay: f64,
        bend: f64,
        rows: impl Fn(f64) -> Vector3<f64>,
    ) -> Option<(f64, Vector3<f64>)> {
        let row = |x: &OnsetSample| {
            let bent = force_at(&self.samples, x.t + delay) * bend;
            (rows(x.t), x.centre + bent)
        };
        let equations = NormalEquations::of(near.iter().map(row));
        let solved = equations.solution()?;
        let (count, noise) = (near.len() as f64, LEAST_NOISE * LEAST_NOISE);
        let left = equations.residual_square(&solved) / count;
        Some((0.5 * count * (left + noise).ln(), solved))
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
