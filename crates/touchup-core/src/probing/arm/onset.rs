//! Where a touch began: the corner of force over travel, going in and coming out.
//!
//! f(t) = b + k max(0, s(t − τ) − s₀)
//!
//! s is the travel of the arm along its approach as it is reported, f the force against it, b what
//! the sensor reads in free air, k the stiffness of arm, probe and part in series, τ how much later
//! the force is stamped than the travel. While the arm presses, it is reported deeper than the tip
//! is, by f/k; at the corner s₀ it is not. The fit takes the whole curve, so that neither the
//! threshold at which the arm was commanded to stop nor its braking travel is in s₀. τ moves the
//! corner forward going in and backward coming out: a touch that does both determines it.

use nalgebra::{Cholesky, Matrix4, Vector3, Vector4};

use crate::numeric::{DampedSearch, NormalEquations, SearchEnd, median};
use crate::{names, parameters};

/// One moment of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchMoment {
    /// s, growing
    pub t: f64,
    /// of the arm along its approach, m; into the part is positive
    pub travel: f64,
    /// on the tip against the approach, N; what presses is positive
    pub force: f64,
    /// on the tip across the approach, N
    pub lateral: f64,
}

parameters! {
    /// Settings of [`find_onset`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct OnsetParams in "robot" {
        /// What is believed of τ before the touch, s …
        delay: f64 = 0.0;
        /// … and its standard deviation, s: a cycle or two of a controller at 500 Hz, and its
        /// filter.
        delay_sigma: f64 = 4e-3;
        /// Standard deviation of the measured force.
        ///
        /// In N, in free air; noise that is smaller is not believed. That of a wrist.
        force_noise: f64 = 0.15, "force_noise_n" [N, 0.0001, 10];
        /// The force that counts as contact for verdicts, N.
        contact_force: f64 = 0.5;
        /// Shorter contacts are impacts, s.
        shortest_contact: f64 = 10e-3;
        /// Largest share of the force across the approach; more is an edge or a slope. Friction of
        /// a steel ball on metal is below 0.3; a slope of 20 degrees adds as much.
        lateral_share: f64 = 0.65;
    }
}

names! {
    /// The class of the curve of a touch.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum OnsetVerdict {
        /// One line in free air, one in contact, the same in and out.
        Clean = "clean",
        /// Going in and coming out differ: the tip slipped sideways or the part yielded.
        Slip = "slip",
        /// Much of the force was across the approach: an edge, or a slope.
        Edge = "edge",
        /// Contact was lost and found again going in.
        Bounce = "bounce",
        /// A short push that was no contact: something hit the arm or the table.
        Impact = "impact",
    }
}

/// Where a touch began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// s₀, m
    pub travel: f64,
    /// its standard uncertainty, m
    pub sigma: f64,
    /// k, N/m
    pub stiffness: f64,
    /// standard uncertainty of it, N/m
    pub stiffness_sigma: f64,
    /// τ, s
    pub delay: f64,
    /// b, N
    pub bias: f64,
    /// largest force above it, N
    pub peak: f64,
    /// the class of the curve
    pub verdict: OnsetVerdict,
}

/// Why there is no onset.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OnsetError {
    /// The force never rose.
    #[error("no contact: the largest force was {peak_n:.2} N, contact begins at {contact_n:.2} N")]
    NoContact {
        /// N
        peak_n: f64,
        /// N
        contact_n: f64,
    },
    /// Contact from the first moment on.
    #[error(
        "in contact before the search began: {count} moments in free air, {LEAST} are needed; search from farther away"
    )]
    NoFreeAir {
        /// moments
        count: usize,
    },
    /// Something is no number, or goes back in time.
    #[error("moment {index} of the touch is no number, or not later than the one before")]
    BadMoment {
        /// which one
        index: usize,
    },
    /// The fit does not converge.
    #[error("force over travel is no bent line: the fit does not converge")]
    NoFit,
}

/// Moments on each side of the corner at the least.
const LEAST: usize = 5;
/// Steps of a fit; five are usual.
const SEARCH: DampedSearch = DampedSearch {
    first: 1e-6,
    factors: [0.1, 10.0],
    least: 1e-12,
    most: 1e9,
    tries: 60,
};
/// The corner has converged when a step moves it by less than this, m.
const REST: f64 = 1e-9;
/// Times that the noise is taken from the residuals.
const WEIGHINGS: usize = 3;
/// Moments that share one error of the travel after smoothing: one over the middle weight of the
/// parabola, 89/429 for eleven.
const SMOOTHED: f64 = 429.0 / 89.0;
/// Neighbours farther away than this share nothing: twice the smoothing.
const FARTHEST: usize = 2 * BESIDE;
/// Deviations of the force that noise alone does not reach.
const NOISE: f64 = 6.0;
/// Moments on each side that the travel is smoothed over: 20 ms at 500 Hz.
const BESIDE: usize = 5;
/// Moments on each side that the speed is taken from.
const BESIDE_SPEED: usize = 15;
/// Delays that are tried first, in standard deviations of what is believed.
const STARTS: [f64; 5] = [0.0, -1.0, 1.0, -2.0, 2.0];
/// In and out differ when their residuals do by this share of the largest force …
const HYSTERESIS: f64 = 0.05;
/// … and by this many standard deviations of the force.
const CLEARLY: f64 = 4.0;

/// Fits the bent line to a touch.
///
/// - `moments`: the approach through free air, the contact, and, as far as there is one, the
///   retraction.
///
/// # Errors
/// [`OnsetError`].
pub fn find_onset(moments: &[TouchMoment], params: &OnsetParams) -> Result<Onset, OnsetError> {
    let is_bad = |index: usize| {
        let m = &moments[index];
        let is_number = [m.t, m.travel, m.force, m.lateral]
            .iter()
            .all(|x| x.is_finite());
        !is_number || index > 0 && m.t <= moments[index - 1].t
    };
    if let Some(index) = (0..moments.len()).find(|&index| is_bad(index)) {
        return Err(OnsetError::BadMoment { index });
    }
    let noise = params.force_noise;
    let mut curve = ForceCurve {
        moments,
        path: smoothed(moments),
        params,
        noise: [noise, noise],
    };
    let (free, peak) = curve.free_air()?;
    let start = curve.crossing(free, peak);
    let deepest = moments
        .iter()
        .map(|m| m.travel)
        .fold(f64::NEG_INFINITY, f64::max);
    let stiffness = (peak - free) / (deepest - start).max(REST);
    let starts = STARTS.map(|by| {
        LineFit::new(
            start,
            params.delay + by * params.delay_sigma,
            free,
            stiffness,
        )
    });
    let fits = starts.iter().filter_map(|line| curve.fit(*line));
    let (mut line, _) = fits
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or(OnsetError::NoFit)?;
    // noise of the travel is in the force while the arm presses, and nowhere else
    for _ in 0..WEIGHINGS {
        curve.noise = curve.seen_noise(&line);
        line = curve.fit(line).ok_or(OnsetError::NoFit)?.0;
    }
    curve.check_free_air(&line)?;
    let covariance = curve.covariance(&line).ok_or(OnsetError::NoFit)?;
    let [sigma, stiffness_sigma] = [S0, K].map(|i| covariance[(i, i)].sqrt());
    Ok(Onset {
        travel: line[S0],
        sigma,
        stiffness: line[K],
        stiffness_sigma,
        delay: line[TAU],
        bias: line[B],
        peak: peak - line[B],
        verdict: curve.verdict(&line),
    })
}

/// Places of the unknowns.
const S0: usize = 0;
const TAU: usize = 1;
const B: usize = 2;
const K: usize = 3;

type LineFit = Vector4<f64>;

/// Travel at each moment by a parabola through those around it \[Savitzky Golay 1964\], speed by a
/// line through more of them. A speed that is noisy would look like one that changes, and so
/// simulate a delay.
fn smoothed(moments: &[TouchMoment]) -> Vec<Smooth> {
    let around = |index: usize, beside: usize| {
        &moments[index.saturating_sub(beside)..(index + beside + 1).min(moments.len())]
    };
    let travel = |index: usize| {
        let (here, near) = (moments[index], around(index, BESIDE));
        // in units that keep the matrix regular
        let scale = near.last().map_or(1.0, |last| last.t) - near[0].t;
        let row = |m: &TouchMoment| {
            let x = (m.t - here.t) / scale;
            (Vector3::new(1.0, x, x * x), m.travel - here.travel)
        };
        here.travel
            + NormalEquations::of(near.iter().map(row))
                .solution()
                .map_or(0.0, |parabola| parabola[0])
    };
    let speed = |index: usize| {
        let near = around(index, BESIDE_SPEED);
        let count = near.len() as f64;
        let [t, travel] = [|m: &TouchMoment| m.t, |m: &TouchMoment| m.travel]
            .map(|of| near.iter().map(of).sum::<f64>() / count);
        let square: f64 = near.iter().map(|m| (m.t - t).powi(2)).sum();
        let product: f64 = near.iter().map(|m| (m.t - t) * (m.travel - travel)).sum();
        if square > 0.0 {
            (product / square, 1.0 / square)
        } else {
            (0.0, 0.0)
        }
    };
    let at = |index: usize| {
        let (speed, speed_variance) = speed(index);
        Smooth {
            travel: travel(index),
            speed,
            speed_variance,
        }
    };
    (0..moments.len()).map(at).collect()
}

/// Travel and speed at a moment, m and m/s.
#[derive(Clone, Copy, Debug)]
struct Smooth {
    travel: f64,
    speed: f64,
    /// of the speed, for travel with a variance of 1 m²; 1/s²
    speed_variance: f64,
}

/// How many neighbours on average share one error: 1 + 2 Σ ρ, as long as ρ is above zero \[Geyer
/// 1992\].
fn shared(residuals: &[f64]) -> f64 {
    let square: f64 = residuals.iter().map(|r| r * r).sum();
    let with = |lag: usize| {
        residuals
            .iter()
            .zip(residuals.iter().skip(lag))
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / square
    };
    1.0 + 2.0
        * (1..=FARTHEST)
            .map(with)
            .take_while(|rho| *rho > 0.0)
            .sum::<f64>()
}

struct ForceCurve<'a> {
    moments: &'a [TouchMoment],
    /// of each moment travel and speed without noise
    path: Vec<Smooth>,
    params: &'a OnsetParams,
    /// standard deviations of the force in free air and while pressing, N
    noise: [f64; 2],
}

impl ForceCurve<'_> {
    /// Force in free air and the largest, N.
    fn free_air(&self) -> Result<(f64, f64), OnsetError> {
        let peak = self
            .moments
            .iter()
            .map(|m| m.force)
            .fold(f64::NEG_INFINITY, f64::max);
        // the lower quarter of all forces before the peak is free air, or there is none
        let before: Vec<_> = self
            .moments
            .iter()
            .map(|m| m.force)
            .take_while(|&force| force < peak)
            .collect();
        let least = self.contact_force();
        if !peak.is_finite() {
            return Err(OnsetError::NoFreeAir { count: 0 });
        }
        let mut first: Vec<_> = before
            .iter()
            .copied()
            .take((before.len() / 4).max(LEAST))
            .collect();
        let free = median(&mut first).unwrap_or(peak);
        if peak - free < least {
            return Err(OnsetError::NoContact {
                peak_n: peak - free,
                contact_n: least,
            });
        }
        let count = before
            .iter()
            .take_while(|&&force| force - free < least)
            .count();
        if count < LEAST {
            return Err(OnsetError::NoFreeAir { count });
        }
        Ok((free, peak))
    }

    /// Travel at which the last rise towards the peak began, m.
    fn crossing(&self, free: f64, peak: f64) -> f64 {
        let top = self
            .moments
            .iter()
            .position(|m| m.force >= peak)
            .unwrap_or(0);
        let below = |m: &TouchMoment| m.force - free < self.contact_force();
        let last = self.moments[..top].iter().rposition(below).unwrap_or(0);
        self.moments[last].travel
    }

    /// Travel at a time and how fast it grows, between the moments; beyond them it goes on as at
    /// the end.
    fn travel(&self, t: f64) -> (f64, f64) {
        let after = self.moments.partition_point(|m| m.t <= t);
        let before = after.saturating_sub(1);
        let (a, since) = (self.path[before], t - self.moments[before].t);
        match self.path.get(after).filter(|_| after > 0) {
            Some(b) => {
                let share = since / (self.moments[after].t - self.moments[before].t);
                (
                    a.travel + (b.travel - a.travel) * share,
                    a.speed + (b.speed - a.speed) * share,
                )
            }
            None => (a.travel + a.speed * since, a.speed),
        }
    }

    /// Residual, its derivatives by the unknowns, and whether it is in free air, 0, or pressing, 1.
    fn residual(&self, m: &TouchMoment, line: &LineFit) -> (f64, LineFit, usize) {
        let (travel, speed) = self.travel(m.t - line[TAU]);
        let depth = (travel - line[S0]).max(0.0);
        let is_in = usize::from(depth > 0.0);
        let slope = -line[K] * is_in as f64;
        (
            m.force - line[B] - line[K] * depth,
            LineFit::new(slope, slope * speed, 1.0, depth),
            is_in,
        )
    }

    /// Sum of squared residuals over their variances, with what is believed of τ.
    fn cost(&self, line: &LineFit) -> f64 {
        let of = |m: &TouchMoment| {
            let (residual, _, is_in) = self.residual(m, line);
            residual * residual / self.noise[is_in].powi(2)
        };
        let believed = (line[TAU] - self.params.delay) / self.params.delay_sigma;
        self.moments.iter().map(of).sum::<f64>() + believed * believed
    }

    /// Of a small change of the line.
    ///
    /// - `noise`: that weights the moments, N in free air and while pressing.
    fn normal_equations(&self, line: &LineFit, noise: [f64; 2]) -> NormalEquations<4> {
        let mut equations = NormalEquations::default();
        for m in self.moments {
            let (residual, gradient, is_in) = self.residual(m, line);
            equations.add(&gradient, residual, 1.0 / noise[is_in].powi(2));
        }
        equations
    }

    /// The line of least cost near another, and its cost.
    fn fit(&self, line: LineFit) -> Option<(LineFit, f64)> {
        let believed = self.params.delay_sigma.powi(-2);
        let equations = |line: &LineFit| {
            let mut equations = self.normal_equations(line, self.noise);
            equations.add(
                &LineFit::ith(TAU, 1.0),
                self.params.delay - line[TAU],
                believed,
            );
            equations
        };
        let better = |line: &LineFit, step: &LineFit, before: f64| {
            let next = line + step;
            Some((next, self.cost(&next))).filter(|(next, cost)| *cost <= before && next[K] > 0.0)
        };
        let is_last = |step: &LineFit, _: &NormalEquations<4>| {
            step[S0].abs() < REST && step[TAU].abs() < REST
        };
        let (line, cost, end) = SEARCH.run(
            (line, self.cost(&line)),
            equations,
            NormalEquations::damped,
            better,
            is_last,
        );
        (end != SearchEnd::Singular && line.iter().all(|x| x.is_finite())).then_some((line, cost))
    }

    /// Residuals in free air and while pressing.
    fn residuals(&self, line: &LineFit) -> [Vec<f64>; 2] {
        let mut found = [Vec::new(), Vec::new()];
        for m in self.moments {
            let (residual, _, is_in) = self.residual(m, line);
            found[is_in].push(residual);
        }
        found
    }

    /// What the residuals show, N; never less than the noise of the force.
    fn seen_noise(&self, line: &LineFit) -> [f64; 2] {
        // two unknowns each
        let rms = |of: &Vec<f64>| {
            (of.iter().map(|r| r * r).sum::<f64>() / of.len().saturating_sub(2).max(1) as f64)
                .sqrt()
        };
        self.residuals(line)
            .each_ref()
            .map(|of| rms(of).max(self.params.force_noise))
    }

    /// Of the unknowns. Neighbours that share their noise count as fewer.
    fn covariance(&self, line: &LineFit) -> Option<Matrix4<f64>> {
        let [free, pressing] = self.residuals(line);
        let [alone, all] = self.noise.map(|noise| noise * noise);
        // what the noise of the travel adds while it presses is shared over the smoothing
        let by_travel = ((all - alone) / all).max(0.0);
        let shared = [
            shared(&free),
            shared(&pressing).max(1.0 + by_travel * (SMOOTHED - 1.0)),
        ];
        let noise = [0, 1].map(|at| self.noise[at] * f64::sqrt(shared[at]));
        let mut square = self.normal_equations(line, noise).information;
        // of the information on τ, some is noise of the speed
        let travel_variance = self.travel_variance();
        let pressing = self
            .moments
            .iter()
            .zip(&self.path)
            .filter(|(m, _)| self.residual(m, line).2 == 1);
        let noisy: f64 = pressing
            .map(|(_, smooth)| smooth.speed_variance * travel_variance)
            .sum();
        let information = square[(TAU, TAU)];
        square[(TAU, TAU)] +=
            self.params.delay_sigma.powi(-2) - noisy * (line[K] / noise[1]).powi(2);
        let corrected = Cholesky::new(square).map(|square| square.inverse());
        corrected.or_else(|| {
            square[(TAU, TAU)] = information + self.params.delay_sigma.powi(-2);
            square.try_inverse()
        })
    }

    /// Of the reported travel about its smoothed one, m².
    fn travel_variance(&self) -> f64 {
        let squares = self
            .moments
            .iter()
            .zip(&self.path)
            .map(|(m, smooth)| (m.travel - smooth.travel).powi(2));
        let freedom = self.moments.len() as f64 * (1.0 - 1.0 / SMOOTHED);
        squares.sum::<f64>() / freedom.max(1.0)
    }

    /// A curve that begins in contact has no corner.
    fn check_free_air(&self, line: &LineFit) -> Result<(), OnsetError> {
        let is_free = |m: &&TouchMoment| self.travel(m.t - line[TAU]).0 <= line[S0];
        let count = self.moments[..self.deepest()]
            .iter()
            .filter(is_free)
            .count();
        if count < LEAST {
            Err(OnsetError::NoFreeAir { count })
        } else {
            Ok(())
        }
    }

    /// The moment from which on it goes back.
    fn deepest(&self) -> usize {
        (0..self.path.len())
            .max_by(|&a, &b| self.path[a].travel.total_cmp(&self.path[b].travel))
            .unwrap_or(0)
    }

    /// The force that counts as contact, N: noise alone does not reach it.
    fn contact_force(&self) -> f64 {
        self.params
            .contact_force
            .max(NOISE * self.params.force_noise)
    }

    fn verdict(&self, line: &LineFit) -> OnsetVerdict {
        let contacts = self.contacts(line[B]);
        let is_short = |&(first, last): &(usize, usize)| {
            self.moments[last].t - self.moments[first].t < self.params.shortest_contact
        };
        // the tip was clearly above the surface: what pushed it was something else
        let is_above = |&(first, _): &(usize, usize)| {
            let Smooth { travel, speed, .. } = self.path[first];
            let later =
                self.moments[(first + 3).min(self.moments.len() - 1)].t - self.moments[first].t;
            travel < line[S0] - self.contact_force() / line[K] - speed.abs() * later
        };
        if contacts.iter().any(is_above) || contacts.iter().all(is_short) {
            return OnsetVerdict::Impact;
        }
        if contacts.len() > 1 {
            return OnsetVerdict::Bounce;
        }
        if self.lateral_share(line) > self.params.lateral_share {
            return OnsetVerdict::Edge;
        }
        if self.is_hysteretic(line) {
            OnsetVerdict::Slip
        } else {
            OnsetVerdict::Clean
        }
    }

    /// First and last moments of each contact that began going in; between two the force is less
    /// than half of what counts as one. The mean of five forces is looked at: noise makes no
    /// contact out of one that comes slowly.
    fn contacts(&self, bias: f64) -> Vec<(usize, usize)> {
        let mut contacts: Vec<(usize, usize)> = Vec::new();
        let (mut is_in, deepest) = (false, self.deepest());
        for index in 0..self.moments.len() {
            let around =
                &self.moments[index.saturating_sub(2)..(index + 3).min(self.moments.len())];
            let force = around.iter().map(|m| m.force).sum::<f64>() / around.len() as f64 - bias;
            if !is_in && force >= self.contact_force() && index <= deepest {
                contacts.push((index, index));
                is_in = true;
            } else if is_in && force < 0.5 * self.contact_force() {
                is_in = false;
            }
            if is_in && let Some(contact) = contacts.last_mut() {
                contact.1 = index;
            }
        }
        contacts
    }

    /// Median share of the force across the approach while in contact.
    fn lateral_share(&self, line: &LineFit) -> f64 {
        let pressing = self
            .moments
            .iter()
            .filter(|m| m.force - line[B] >= self.contact_force());
        let mut shares: Vec<f64> = pressing
            .map(|m| m.lateral.abs() / (m.force - line[B]))
            .collect();
        median(&mut shares).unwrap_or(0.0)
    }

    /// Whether the force differs between going in and coming out at the same depth, by itself or as
    /// a delay that cannot be.
    fn is_hysteretic(&self, line: &LineFit) -> bool {
        if (line[TAU] - self.params.delay).abs() > CLEARLY * self.params.delay_sigma {
            return true;
        }
        let peak = self
            .moments
            .iter()
            .map(|m| m.force - line[B])
            .fold(0.0, f64::max);
        let (into, out) = self.moments.split_at(self.deepest());
        let mean = |of: &[TouchMoment]| {
            let pressing = of
                .iter()
                .map(|m| self.residual(m, line))
                .filter(|(.., is_in)| *is_in == 1);
            let residuals: Vec<f64> = pressing.map(|(residual, ..)| residual).collect();
            let count = residuals.len() as f64;
            (residuals.len() >= LEAST).then(|| (residuals.iter().sum::<f64>() / count, count))
        };
        let (Some((into, n)), Some((out, m))) = (mean(into), mean(out)) else {
            return false;
        };
        // as it should be, not as the residuals have it, of which hysteresis is a part
        let noise = self
            .params
            .force_noise
            .hypot(line[K] * self.travel_variance().sqrt());
        (into - out).abs() > (HYSTERESIS * peak).max(CLEARLY * noise * (1.0 / n + 1.0 / m).sqrt())
    }
}
