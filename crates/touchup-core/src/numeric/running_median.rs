/// The median of a stream of lengths, followed in constant memory: a step up for each longer one, a
/// step down for each shorter one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunningMedian {
    /// as followed so far
    pub length: f64,
    /// what is never undercut
    pub least: f64,
}

/// Share by which it moves: it converges within some hundred samples.
const STEP: f64 = 0.01;

impl RunningMedian {
    /// Takes in a length that is larger than the median, or smaller.
    pub(crate) fn note(&mut self, is_larger: bool) {
        self.length =
            (self.length * if is_larger { 1.0 + STEP } else { 1.0 - STEP }).max(self.least);
    }
}
