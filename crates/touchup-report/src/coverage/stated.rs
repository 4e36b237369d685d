//! A stated number beside the truth.

/// Standard deviations that hold 95 % of a normal distribution.
pub(super) const SIGMAS_95: f64 = 1.96;

/// A stated number beside the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedNumber {
    /// stated less true value, m
    pub error: f64,
    /// stated standard deviation, m; 0: none
    pub std: f64,
    /// whether it is a lower bound
    pub is_at_least: bool,
}

impl StatedNumber {
    /// Error over stated standard deviation; `None` for a bound, or without a stated deviation.
    pub fn score(&self) -> Option<f64> {
        (!self.is_at_least && self.std > 0.0).then(|| self.error / self.std)
    }

    /// Whether the truth is below a stated lower bound by more than the bound's uncertainty.
    pub(super) fn contradicts(&self) -> bool {
        self.is_at_least && self.error > SIGMAS_95 * self.std
    }
}
