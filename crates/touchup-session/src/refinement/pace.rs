//! Samples in real time, with the patch beside them.

use std::fmt;
use std::thread::sleep;
use std::time::{Duration, Instant};

use touchup_geometry::numeric::counted;

use crate::live::{Latencies, LiveCounts, Quantiles};
use crate::reported;

reported! {
    /// Lag of the patch behind the samples.
    pub struct LiveSummary, pub(super) fn of(behind: &Latencies, counts: LiveCounts) {
        /// age of the touches that the mesh shows, in time of the samples
        pub behind_ns: Quantiles = behind.quantiles(),
        /// renewals of the patch
        pub renewals: u64 = counts.renewals,
        /// renewals not done when due
        pub late: u64 = counts.late,
    }
}

impl fmt::Display for LiveSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Quantiles { median, p99, .. } = self.behind_ns;
        let [median, p99] = [median, p99].map(|ns| ns as f64 * 1e-6);
        let renewals = counted(self.renewals, "renewal", "renewals");
        write!(
            f,
            "live: patch {median:.0} ms behind, p99 {p99:.0} ms; {renewals}, {} of them late",
            self.late
        )
    }
}

/// The clock of samples in real time.
#[derive(Debug, Default)]
pub(super) struct RealTime {
    /// arrival of the first sample, and its stamp, ns
    begun: Option<(Instant, i64)>,
    /// age of the touches that the mesh shows, at each sample
    pub behind: Latencies,
}

impl RealTime {
    /// Waits for the due time of a sample.
    pub fn wait_for(&mut self, stamp_ns: i64) {
        let (begun, first_ns) = *self.begun.get_or_insert((Instant::now(), stamp_ns));
        let due =
            Duration::from_nanos(u64::try_from(stamp_ns.saturating_sub(first_ns)).unwrap_or(0));
        sleep(due.saturating_sub(begun.elapsed()));
    }

    /// Notes the lag of the patch at a sample.
    ///
    /// - `patched_until_ns`: stamp up to which the mesh shows all touches.
    pub fn note(&mut self, stamp_ns: i64, patched_until_ns: Option<i64>) {
        let behind = patched_until_ns.map(|until_ns| stamp_ns.saturating_sub(until_ns));
        if let Some(Ok(behind_ns)) = behind.map(u64::try_from) {
            self.behind.record(Duration::from_nanos(behind_ns));
        }
    }
}
