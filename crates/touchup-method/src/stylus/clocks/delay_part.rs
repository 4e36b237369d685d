//! What one onset of contact, or one block of sliding or lifting, tells about the delay.

/// Trial delays: ± [`REACH`] steps of [`STEP_NS`].
pub(super) const STEP_NS: i64 = 2_000_000;
pub(super) const STEP: f64 = STEP_NS as f64 * 1e-9;
pub(super) const REACH: usize = 74;
pub(super) const DELAYS: usize = 2 * REACH + 1;
/// Longest trial delay, ns.
pub(super) const SPAN_NS: i64 = REACH as i64 * STEP_NS;
/// Most that one part says against a delay: a wrong part outweighs no two right ones.
pub(super) const MOST: f64 = 4.0;

/// Delays near another one, in steps, and how much less likely its ends are.
const NEAR: i32 = 12;
const LEAST_TOLD: f64 = 0.5;

/// One number for each trial delay.
pub(super) type OfDelays = [f64; DELAYS];

/// Trial delay, s.
pub(super) fn trial(at: usize) -> f64 {
    (at as f64 - REACH as f64) * STEP
}

/// −log likelihood of the delay, from one part of the evidence.
#[derive(Clone, Debug)]
pub(super) struct DelayPart {
    /// s
    pub time: f64,
    /// 0 at its likeliest delay, at most [`MOST`]
    against: OfDelays,
}

impl DelayPart {
    /// - `against`: −log likelihood, up to a constant; infinite for an impossible delay.
    ///
    /// `None` if no delay is possible.
    pub(crate) fn new(time: f64, against: &OfDelays) -> Option<Self> {
        let least = lowest(against);
        least.is_finite().then(|| Self {
            time,
            against: against.map(|value| (value - least).min(MOST)),
        })
    }

    /// −log likelihood of a delay, s: linear between trial delays, [`MOST`] beyond them.
    pub(crate) fn against(&self, delay: f64) -> f64 {
        let at = delay / STEP + REACH as f64;
        let value = |at: f64| {
            if (0.0..DELAYS as f64).contains(&at) {
                self.against[at as usize]
            } else {
                MOST
            }
        };
        let share = at - at.floor();
        value(at.floor()) * (1.0 - share) + value(at.floor() + 1.0) * share
    }

    /// −log likelihood of the likeliest delay within two steps of another one, s.
    pub(crate) fn least_near(&self, delay: f64) -> f64 {
        let near = (-2..=2).map(|by| self.against(delay + f64::from(by) * STEP));
        near.fold(MOST, f64::min)
    }

    /// Its delay near another one, s.
    pub(crate) fn delay(&self, coarse: f64) -> Option<TimedDelay> {
        let near = (-NEAR..=NEAR).map(|by| coarse + f64::from(by) * STEP);
        TimedDelay::of(self.time, near.map(|delay| (delay, self.against(delay))))
    }
}

/// A delay at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimedDelay {
    /// s
    pub time: f64,
    /// s
    pub delay: f64,
    /// standard uncertainty, s
    pub sigma: f64,
}

impl TimedDelay {
    /// Mean and standard deviation over some delays by their likelihood; `None` if an end of them
    /// is as likely.
    ///
    /// - `trials`: delays, s, each with its −log likelihood.
    pub(crate) fn of(time: f64, trials: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let trials: Vec<(f64, f64)> = trials.collect();
        let least = trials.iter().map(|of| of.1).fold(f64::INFINITY, f64::min);
        let ends = trials.first()?.1.min(trials.last()?.1);
        let (mut whole, mut first, mut second) = (0.0, 0.0, 0.0);
        for (delay, against) in &trials {
            let weight = (-(against - least).min(MOST)).exp() - (-MOST).exp();
            whole += weight;
            first += weight * delay;
            second += weight * delay * delay;
        }
        let delay = first / whole;
        let sigma = (second / whole - delay * delay).max(0.0).sqrt();
        (ends - least > LEAST_TOLD).then_some(Self { time, delay, sigma })
    }
}

/// Lowest of some numbers.
pub(super) fn lowest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}
