//! Stamps of the messages, before pairing.

use super::finding::{InputCause, InputFinding};
use touchup_geometry::numeric::median;
use touchup_method::stylus::Message;

/// Maximum number of kept periods.
const MOST_PERIODS: usize = 2048;
/// Maximum backward step of messages swapped in transit, ns.
const GOES_BACK_NS: i64 = 1_000_000_000;
/// Minimum period of any force sensor, s.
const FASTEST: f64 = 20e-6;
/// Minimum number of messages for a finding.
const FEWEST: u64 = 20;

/// Stamps of one stream.
#[derive(Clone, Debug, Default)]
struct StreamStamps {
    count: u64,
    zeros: u64,
    backs: u64,
    span_ns: Option<[i64; 2]>,
    last_ns: i64,
    /// s
    periods: Vec<f64>,
}

impl StreamStamps {
    fn push(&mut self, stamp_ns: i64) {
        self.count += 1;
        self.zeros += u64::from(stamp_ns == 0);
        if let Some([first_ns, newest_ns]) = &mut self.span_ns {
            self.backs += u64::from(self.last_ns.saturating_sub(stamp_ns) > GOES_BACK_NS);
            if self.periods.len() < MOST_PERIODS {
                self.periods
                    .push(stamp_ns.saturating_sub(self.last_ns) as f64 * 1e-9);
            }
            (*first_ns, *newest_ns) = ((*first_ns).min(stamp_ns), (*newest_ns).max(stamp_ns));
        } else {
            self.span_ns = Some([stamp_ns; 2]);
        }
        self.last_ns = stamp_ns;
    }

    /// s
    fn mean_period(&self) -> f64 {
        let [first_ns, newest_ns] = self.span_ns.unwrap_or_default();
        newest_ns.saturating_sub(first_ns) as f64 * 1e-9
            / self.count.max(2).saturating_sub(1) as f64
    }
}

/// Stamps of both streams.
#[derive(Clone, Debug, Default)]
pub(super) struct InputStamps {
    poses: StreamStamps,
    wrenches: StreamStamps,
}

impl InputStamps {
    /// Takes a sample with one stamp for pose and wrench.
    #[inline]
    pub(crate) fn push_pair(&mut self, stamp_ns: i64) {
        self.poses.push(stamp_ns);
        self.wrenches.push(stamp_ns);
    }

    pub(crate) fn push(&mut self, message: &Message) {
        let stream = if matches!(message, Message::Pose(_)) {
            &mut self.poses
        } else {
            &mut self.wrenches
        };
        stream.push(message.stamp_ns());
    }

    /// Median time between two poses, s.
    pub(crate) fn pose_period(&self) -> f64 {
        median(&mut self.poses.periods.clone()).unwrap_or(0.0)
    }

    /// - `largest_gap_ns`: maximum gap between two poses for interpolation.
    /// - `samples`: number of samples from the messages.
    pub(crate) fn findings(&self, largest_gap_ns: i64, samples: u64) -> Vec<InputFinding> {
        let mut findings = Vec::new();
        for (name, stream) in [("poses", &self.poses), ("wrenches", &self.wrenches)] {
            if stream.count >= FEWEST && 2 * stream.zeros > stream.count {
                findings.push(InputFinding::new(
                    InputCause::ZeroStamps,
                    true,
                    format!("{} of {} {name} have the stamp 0", stream.zeros, stream.count),
                    "have the driver fill header.stamp with the time of measurement; --stamp log takes when they were recorded",
                ));
            } else if stream.backs > 0 {
                findings.push(InputFinding::new(
                    InputCause::StampsGoBack,
                    stream.backs > stream.count / 4,
                    format!(
                        "{} of {} {name} are stamped more than 1 s before the one before them",
                        stream.backs, stream.count
                    ),
                    "record with one steady clock; a recording that was started twice is two recordings",
                ));
            }
        }
        if !findings.is_empty() {
            return findings;
        }
        // mean of all periods: a recorder may write several messages at once
        let wrench_period = self.wrenches.mean_period();
        if self.wrenches.count >= FEWEST && wrench_period < FASTEST {
            findings.push(InputFinding::new(
                InputCause::TimeUnit,
                true,
                format!("the wrenches come every {:.3} µs", wrench_period * 1e6),
                "no cell is so fast: the stamps look like µs or ms, and are read as ns",
            ));
            return findings;
        }
        if let (Some(poses), Some(wrenches)) = (self.poses.span_ns, self.wrenches.span_ns) {
            let apart =
                (wrenches[0].saturating_sub(poses[1])).max(poses[0].saturating_sub(wrenches[1]));
            if apart > 0 {
                let later = wrenches[0].saturating_sub(poses[0]) as f64 * 1e-9;
                findings.push(InputFinding::new(
                    InputCause::TwoEpochs,
                    true,
                    format!("the wrenches are stamped {later:+.3} s beyond the poses: no instant has both"),
                    "stamp both by one clock; --stamp log takes when they were recorded",
                ));
            }
        }
        let gap = largest_gap_ns as f64 * 1e-9;
        let period = self.pose_period();
        // a pose at the stamp of the wrench needs no other
        let is_paired = 2 * samples > self.wrenches.count;
        if self.poses.count >= FEWEST && period > gap && !is_paired {
            findings.push(InputFinding::new(
                InputCause::SlowPoses,
                true,
                format!("poses come every {:.1} ms, and none is interpolated over {:.0} ms", period * 1e3, gap * 1e3),
                "record poses faster; sync.largest_gap_ms allows more where the stylus moves slowly",
            ));
        }
        findings
    }

    pub(crate) fn counts(&self) -> [u64; 2] {
        [self.poses.count, self.wrenches.count]
    }
}
