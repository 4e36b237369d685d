//! What is known of the delay between the clocks of wrench and pose.

use std::fmt;

use serde::Serialize;

/// What the clock of the wrench reads beyond that of the pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockOffset {
    /// s; to be added to [`super::SyncParams::wrench_offset_ns`]
    pub offset: f64,
    /// standard uncertainty, s
    pub sigma: f64,
    /// what it is estimated from
    pub evidence: ClockEvidence,
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

impl ClockOffset {
    /// Whether another estimate differs by no more than the uncertainties and `slack`, s.
    pub(super) fn agrees(&self, other: &Self, slack: f64) -> bool {
        (self.offset - other.offset).abs() <= slack + 3.0 * self.sigma.hypot(other.sigma)
    }
}
