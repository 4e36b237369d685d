/// Running median of a stream of lengths in constant memory: a step up for each longer one, a step
/// down for each shorter one.
#[derive(Clone, Copy, Debug)]
pub struct RunningMedian {
    /// current estimate
    pub length: f64,
    /// lower bound of the estimate
    pub least: f64,
}

/// Relative step; the estimate converges within some hundred samples.
const STEP: f64 = 0.01;

impl RunningMedian {
    /// Updates the estimate by a length above or below it.
    pub fn note(&mut self, is_larger: bool) {
        self.length =
            (self.length * if is_larger { 1.0 + STEP } else { 1.0 - STEP }).max(self.least);
    }
}
