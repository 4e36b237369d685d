//! What is known of the delay between the clocks of wrench and pose.

use std::fmt;

use serde::Serialize;

/// What the clock of the wrench reads beyond that of the pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockOffset {
    /// in the middle of what it is estimated from, s; to be added to
    /// [`super::SyncParams::wrench_offset_ns`] where there is no drift
    pub offset: f64,
    /// standard uncertainty, s
    pub sigma: f64,
    /// where one is seen
    pub drift: Option<ClockDrift>,
    /// what it is estimated from
    pub evidence: ClockEvidence,
}

/// What the clock of the wrench gains on that of the pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockDrift {
    /// s/s; to be added to [`super::SyncParams::wrench_drift`]
    pub rate: f64,
    /// standard uncertainty
    pub rate_sigma: f64,
    /// what it reads beyond the other at the first sample, s; to be added to
    /// [`super::SyncParams::wrench_offset_ns`]
    pub offset_at_first: f64,
    /// … and at the last, s
    pub offset_at_last: f64,
}

impl ClockDrift {
    /// Standard uncertainty of [`Self::offset_at_first`] and [`Self::offset_at_last`], s: of an
    /// offset in the middle between them, and of a rate over half the time, which are independent
    /// there: u² = σ² + (σ_rate T/2)².
    ///
    /// - `sigma`: that of the offset in the middle, s.
    ///
    /// ```
    /// use touchup_core::stylus::ClockDrift;
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

/// What a delay is estimated from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockEvidence {
    /// So many onsets of contact.
    Onsets(usize),
    /// The course of motion and force over so many seconds of sliding or lifting.
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

/// Beyond their uncertainties, two estimates of one delay differ by less than this, s.
const AGREED: f64 = 4e-3;

impl ClockOffset {
    /// Whether another estimate may be of the same delay.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        (self.offset - other.offset).abs() <= AGREED + 3.0 * self.sigma.hypot(other.sigma)
    }
}

/// Mean time between samples of these stamps, in order, s; 0 for fewer than two.
pub(super) fn mean_period(
    mut stamps_ns: impl DoubleEndedIterator<Item = i64> + ExactSizeIterator,
) -> f64 {
    let steps = stamps_ns.len().max(2) - 1;
    let ends = stamps_ns.next().zip(stamps_ns.next_back());
    ends.map_or(0.0, |(first, last)| {
        last.saturating_sub(first) as f64 * 1e-9
    }) / steps as f64
}
