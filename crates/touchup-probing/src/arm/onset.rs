//! Onset of a touch: the corner of force over travel, going in and coming out.
//!
//! f(t) = b + k max(0, s(t − τ) − s₀)
//!
//! s is the reported travel of the arm along its approach, f the force against it, b the sensor
//! reading in free air, k the stiffness of arm, probe and part in series, τ the delay of the
//! force's stamps against the travel's. While the arm presses, its reported depth exceeds the tip's
//! by f/k; at the corner s₀ it does not. The fit uses the whole curve, so s₀ contains neither the
//! threshold of the stop command nor the braking travel. τ moves the corner forward going in and
//! backward coming out: a touch with both determines it.

use nalgebra::{Cholesky, Matrix4, Vector3, Vector4};

use touchup_geometry::numeric::{DampedSearch, NormalEquations, SearchEnd, median};
use touchup_method::names;
use touchup_method::parameters;

/// One moment of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchMoment {
    /// time, s, increasing
    pub t: f64,
    /// travel of the arm along its approach, m; positive into the part
    pub travel: f64,
    /// force on the tip against the approach, N; positive for a push
    pub force: f64,
    /// force on the tip across the approach, N
    pub lateral: f64,
}

parameters! {
    /// Settings of [`find_onset`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct OnsetParams in "robot" {
        /// Prior of τ, s.
        delay: f64 = 0.0;
        /// Standard deviation of this prior, s: a cycle or two of a controller at 500 Hz, and its
        /// filter.
        delay_sigma: f64 = 4e-3;
        /// Standard deviation of the noise of the measured force.
        ///
        /// In N, in free air, for a wrist; also the least that the fit believes.
        force_noise: f64 = 0.15, "force_noise_n" [N, 0.0001, 10];
        /// Force of a contact for verdicts, N.
        contact_force: f64 = 0.5;
        /// Duration below which a contact is an impact, s.
        shortest_contact: f64 = 10e-3;
        /// Largest share of the force across the approach; more means an edge or a slope. Friction
        /// of a steel ball on metal is below 0.3; a slope of 20 degrees adds as much.
        lateral_share: f64 = 0.65;
    }
}

names! {
    /// Class of the curve of a touch.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum OnsetVerdict {
        /// One line in free air, one in contact, equal in and out.
        Clean = "clean",
        /// Going in and coming out differ: the tip slipped sideways or the part yielded.
        Slip = "slip",
        /// Much of the force is across the approach: an edge, or a slope.
        Edge = "edge",
        /// Contact lost and found again going in.
        Bounce = "bounce",
        /// A short push without contact: something hit the arm or the table.
        Impact = "impact",
    }
}

/// Onset of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// travel s₀, m
    pub travel: f64,
    /// standard uncertainty of s₀, m
    pub sigma: f64,
    /// stiffness k, N/m
    pub stiffness: f64,
    /// standard uncertainty of k, N/m
    pub stiffness_sigma: f64,
    /// delay τ, s
    pub delay: f64,
    /// bias b, N
    pub bias: f64,
    /// largest force above b, N
    pub peak: f64,
    /// class of the curve
    pub verdict: OnsetVerdict,
}

/// Why there is no onset.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OnsetError {
    /// The force never rose.
    #[error("no contact: the largest force was {peak_n:.2} N, contact begins at {contact_n:.2} N")]
    NoContact {
        /// largest force, N
        peak_n: f64,
        /// force of a contact, N
        contact_n: f64,
    },
    /// Contact from the first moment on.
    #[error(
        "in contact before the search began: {count} moments in free air, {LEAST} are needed; search from farther away"
    )]
    NoFreeAir {
        /// moments in free air
        count: usize,
    },
    /// A value that is no number, or a stamp that goes back.
    #[error("moment {index} of the touch is no number, or not later than the one before")]
    BadMoment {
        /// index of the moment
        index: usize,
    },
    /// The fit does not converge.
    #[error("force over travel is no bent line: the fit does not converge")]
    NoFit,
}

/// Minimum number of moments on each side of the corner.
const LEAST: usize = 5;
/// Damping of the fit; five steps are usual.
const SEARCH: DampedSearch = DampedSearch {
    first: 1e-6,
    factors: [0.1, 10.0],
    least: 1e-12,
    most: 1e9,
    tries: 60,
};
/// Step of the corner at which the fit has converged, m.
const REST: f64 = 1e-9;
/// Estimates of the noise from the residuals.
const WEIGHINGS: usize = 3;
/// Moments that share one error of the travel after smoothing: the inverse of the middle weight of
/// the parabola, 89/429 for eleven.
const SMOOTHED: f64 = 429.0 / 89.0;
/// Largest distance of neighbours with shared errors: twice the smoothing.
const FARTHEST: usize = 2 * BESIDE;
/// Deviations of the force that noise alone does not reach.
const NOISE: f64 = 6.0;
/// Moments on each side in the smoothed travel: 20 ms at 500 Hz.
const BESIDE: usize = 5;
/// Moments on each side in the speed.
const BESIDE_SPEED: usize = 15;
/// Initial delays of the fit, in standard deviations of the prior.
const STARTS: [f64; 5] = [0.0, -1.0, 1.0, -2.0, 2.0];
/// Difference of the residuals in and out that is hysteresis, over the largest force.
const HYSTERESIS: f64 = 0.05;
/// Smallest such difference, in standard deviations of the force.
const CLEARLY: f64 = 4.0;

/// Fits the bent line to a touch.
///
/// - `moments`: the approach through free air, the contact, and the retraction, if there is one.
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
    // noise of the travel enters the force only while the arm presses
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

/// Indices of the unknowns.
const S0: usize = 0;
const TAU: usize = 1;
const B: usize = 2;
const K: usize = 3;

type LineFit = Vector4<f64>;

/// Travel at each moment by a parabola through its neighbours \[Savitzky Golay 1964\], speed by a
/// line through more of them. A noisy speed would look like a changing one, and so simulate a
/// delay.
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
    /// variance of the speed for a travel with a variance of 1 m²; 1/s²
    speed_variance: f64,
}

/// Average number of neighbours with one shared error: 1 + 2 Σ ρ, while ρ is above zero \[Geyer
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
    /// travel and speed of each moment without noise
    path: Vec<Smooth>,
    params: &'a OnsetParams,
    /// standard deviations of the force in free air and while pressing, N
    noise: [f64; 2],
}

impl ForceCurve<'_> {
    /// Force in free air, and the largest force, N.
    fn free_air(&self) -> Result<(f64, f64), OnsetError> {
        let peak = self
            .moments
            .iter()
            .map(|m| m.force)
            .fold(f64::NEG_INFINITY, f64::max);
        // the first quarter of the forces before the peak is free air, or there is none
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

    /// Travel and speed at a time, between the moments; beyond them as at the end.
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

    /// Residual, its derivatives by the unknowns, and its side: 0 in free air, 1 while pressing.
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

    /// Sum of squared residuals over their variances, with the prior of τ.
    fn cost(&self, line: &LineFit) -> f64 {
        let of = |m: &TouchMoment| {
            let (residual, _, is_in) = self.residual(m, line);
            residual * residual / self.noise[is_in].powi(2)
        };
        let believed = (line[TAU] - self.params.delay) / self.params.delay_sigma;
        self.moments.iter().map(of).sum::<f64>() + believed * believed
    }

    /// Normal equations of a small change of the line.
    ///
    /// - `noise`: weights of the moments, N in free air and while pressing.
    fn normal_equations(&self, line: &LineFit, noise: [f64; 2]) -> NormalEquations<4> {
        let mut equations = NormalEquations::default();
        for m in self.moments {
            let (residual, gradient, is_in) = self.residual(m, line);
            equations.add(&gradient, residual, 1.0 / noise[is_in].powi(2));
        }
        equations
    }

    /// Line of least cost near another, and its cost.
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

    /// Noise by the residuals, N; never less than the noise of the force.
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

    /// Covariance of the unknowns. Neighbours with shared noise count as fewer.
    fn covariance(&self, line: &LineFit) -> Option<Matrix4<f64>> {
        let [free, pressing] = self.residuals(line);
        let [alone, all] = self.noise.map(|noise| noise * noise);
        // smoothing correlates the noise that the travel adds while the arm presses
        let by_travel = ((all - alone) / all).max(0.0);
        let shared = [
            shared(&free),
            shared(&pressing).max(1.0 + by_travel * (SMOOTHED - 1.0)),
        ];
        let noise = [0, 1].map(|at| self.noise[at] * f64::sqrt(shared[at]));
        let mut square = self.normal_equations(line, noise).information;
        // part of the information on τ is noise of the speed
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

    /// Variance of the reported travel about its smoothed value, m².
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

    /// Moment at which the tip begins to go back.
    fn deepest(&self) -> usize {
        (0..self.path.len())
            .max_by(|&a, &b| self.path[a].travel.total_cmp(&self.path[b].travel))
            .unwrap_or(0)
    }

    /// Force of a contact, N: noise alone does not reach it.
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
        // the tip was clearly above the surface: something else pushed it
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

    /// First and last moments of each contact that began going in; between two contacts the force
    /// falls below half of a contact's. The mean of five forces decides: noise splits no slow
    /// contact.
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

    /// Whether force at equal depth differs between going in and coming out, by itself or as an
    /// impossible delay.
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
        // expected noise: the residuals contain the hysteresis
        let noise = self
            .params
            .force_noise
            .hypot(line[K] * self.travel_variance().sqrt());
        (into - out).abs() > (HYSTERESIS * peak).max(CLEARLY * noise * (1.0 / n + 1.0 / m).sqrt())
    }
}
