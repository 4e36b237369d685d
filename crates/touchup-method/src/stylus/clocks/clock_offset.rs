//! Delay between the clocks of wrench and pose.

use std::fmt;

use serde::Serialize;

/// Reading of the wrench clock beyond the pose clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockOffset {
    /// in the middle of the evidence, s; add it to [`crate::stylus::SyncParams::wrench_offset_ns`] unless
    /// it changes
    pub offset: f64,
    /// standard uncertainty, s; of a step, the larger one of both offsets
    pub sigma: f64,
    /// change in the course of time, if evident
    pub change: Option<ClockChange>,
    /// evidence of the estimate
    pub evidence: ClockEvidence,
}

/// Change of the offset in the course of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockChange {
    /// Even.
    Drift(ClockDrift),
    /// At once.
    Step(ClockStep),
}

/// A clock of the wrench that was set while it ran.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockStep {
    /// when, s after the first sample
    pub at: f64,
    /// standard uncertainty, s
    pub at_sigma: f64,
    /// reading beyond the pose clock before, s
    pub offset_before: f64,
    /// reading beyond the pose clock after, s
    pub offset_after: f64,
}

/// Gain of the wrench clock on the pose clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockDrift {
    /// s/s; add it to [`crate::stylus::SyncParams::wrench_drift`]
    pub rate: f64,
    /// standard uncertainty
    pub rate_sigma: f64,
    /// reading beyond the pose clock at the first sample, s; add it to
    /// [`crate::stylus::SyncParams::wrench_offset_ns`]
    pub offset_at_first: f64,
    /// reading beyond the pose clock at the last sample, s
    pub offset_at_last: f64,
}

impl ClockOffset {
    /// The offset at first and at last, s: that in the middle, unless it changes.
    pub fn ends(&self) -> [f64; 2] {
        match self.change {
            None => [self.offset; 2],
            Some(ClockChange::Drift(of)) => [of.offset_at_first, of.offset_at_last],
            Some(ClockChange::Step(of)) => [of.offset_before, of.offset_after],
        }
    }

    /// The drift, if the offset changes evenly.
    pub fn drift(&self) -> Option<ClockDrift> {
        match self.change {
            Some(ClockChange::Drift(drift)) => Some(drift),
            _ => None,
        }
    }

    /// The step, if the offset changes at once.
    pub fn step(&self) -> Option<ClockStep> {
        match self.change {
            Some(ClockChange::Step(step)) => Some(step),
            _ => None,
        }
    }
}

impl ClockDrift {
    /// Standard uncertainty of [`Self::offset_at_first`] and [`Self::offset_at_last`], s: of the
    /// offset in the middle between them, and of the rate over half the time, which are independent
    /// there: u² = σ² + (σ_rate T/2)².
    ///
    /// - `sigma`: standard uncertainty of the offset in the middle, s.
    ///
    /// ```
    /// use touchup_method::stylus::ClockDrift;
    ///
    /// // a straight line through equally good values over 60 s: twice as uncertain at its ends as in the middle
    /// let (sigma, rate_sigma) = (1e-4, 12f64.sqrt() * 1e-4 / 60.0);
    /// let drift = ClockDrift { rate: -5e-5, rate_sigma, offset_at_first: 2e-3, offset_at_last: -1e-3 };
    /// assert!((drift.sigma_at_ends(sigma) - 2.0 * sigma).abs() < 1e-12);
    /// ```
    pub fn sigma_at_ends(&self, sigma: f64) -> f64 {
        let half = (self.offset_at_last - self.offset_at_first) / (2.0 * self.rate);
        sigma.hypot(self.rate_sigma * half)
    }
}

/// Evidence of a delay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockEvidence {
    /// Number of contact onsets.
    Onsets(usize),
    /// Seconds of sliding or lifting in the course of motion and force.
    Course(f64),
}

impl fmt::Display for ClockEvidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Onsets(onsets) => write!(f, "{onsets} onsets of contact"),
            Self::Course(seconds) => write!(f, "{seconds:.0} s of sliding and lifting"),
        }
    }
}

/// Mean time between samples of these stamps, in order, s; 0 for fewer than two.
pub(in crate::stylus) fn mean_period(
    mut stamps_ns: impl DoubleEndedIterator<Item = i64> + ExactSizeIterator,
) -> f64 {
    let steps = stamps_ns.len().max(2) - 1;
    let ends = stamps_ns.next().zip(stamps_ns.next_back());
    ends.map_or(0.0, |(first, last)| {
        last.saturating_sub(first) as f64 * 1e-9
    }) / steps as f64
}
