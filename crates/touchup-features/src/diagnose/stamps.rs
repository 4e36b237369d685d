//! Stamps of the messages, before pairing.

use super::clock::{LARGEST_PATH, USUAL_SPEED};
use super::finding::{FoundNumber, InputCause, InputFinding};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, median};
use touchup_method::stylus::Message;

/// Maximum number of kept periods.
const MOST_PERIODS: usize = 2048;
/// Maximum backward step of messages swapped in transit, ns.
const GOES_BACK_NS: i64 = 1_000_000_000;
/// Minimum period of any force sensor, s.
const FASTEST: f64 = 20e-6;
/// Minimum number of messages for a finding.
const FEWEST: u64 = 20;

/// Minimum share of jittering stamps before their predecessor: an error above the period. Stamps
/// of arrival never go back.
const LEAST_BACK: f64 = 0.2;
/// Minimum median deviation of the periods between jittering stamps in their order, as a share of
/// the period: 0 for messages swapped in transit, 0.5 for stamps anywhere.
const LEAST_UNEVEN: f64 = 0.25;
/// Standard uncertainty of a standard deviation by the median of √n sizes, as a share of it: 1.17,
/// and √(3/2) times that for differences, of which each two neighbours share a stamp.
const OF_JITTER: f64 = 1.43;

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

    /// Standard deviation of the stamps about a steady clock, and its standard uncertainty, s; `None`
    /// unless many go back and leave uneven periods between them.
    fn jitter(&self) -> Option<[f64; 2]> {
        let backs = self.periods.iter().filter(|period| **period < 0.0).count();
        if self.periods.len() < FEWEST as usize
            || (backs as f64) < LEAST_BACK * self.periods.len() as f64
        {
            return None;
        }
        let deviation = |periods: &[f64]| {
            let usual = median(&mut periods.to_vec())?;
            let mut off: Vec<f64> = periods.iter().map(|x| (x - usual).abs()).collect();
            median(&mut off)
        };
        let add = |at: &mut f64, period: &f64| {
            *at += period;
            Some(*at)
        };
        let mut stamps: Vec<f64> = self.periods.iter().scan(0.0, add).collect();
        stamps.sort_unstable_by(f64::total_cmp);
        let in_order: Vec<f64> = stamps.windows(2).map(|two| two[1] - two[0]).collect();
        let mean = (stamps.last()? - stamps.first()?) / in_order.len() as f64;
        // two stamps make a difference
        let sigma = SIGMA_OF_MEDIAN * deviation(&self.periods)? / 2f64.sqrt();
        let is_uneven = deviation(&in_order)? > LEAST_UNEVEN * mean;
        is_uneven.then(|| {
            [
                sigma,
                sigma * OF_JITTER / (self.periods.len() as f64).sqrt(),
            ]
        })
    }

    /// A jitter by which one touch in twenty moves far along the path, beyond two σ.
    fn jitter_finding(&self, name: &str) -> Option<InputFinding> {
        let [sigma, of_sigma] = self.jitter()?;
        let path = 2.0 * sigma * USUAL_SPEED;
        let [ms, of_ms] = [sigma, of_sigma].map(|x| x * 1e3);
        let measured = format!(
            "the stamps of the {name} scatter by {ms:.1} ± {of_ms:.1} ms, and one comes every {:.1} ms on average",
            self.mean_period() * 1e3
        );
        let remedy = "have the driver stamp with the time of measurement by one steady clock; --stamp log takes when they were recorded";
        let numbers = vec![FoundNumber::new("stamp_jitter_ms", ms, of_ms)];
        (path > LARGEST_PATH / 2.0).then(|| {
            InputFinding::new(
                InputCause::StampsGoBack,
                path > LARGEST_PATH,
                measured,
                remedy,
            )
            .with(numbers)
        })
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

    /// Stamps that no steady clock makes.
    fn of_streams(&self) -> Vec<InputFinding> {
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
            } else {
                findings.extend(stream.jitter_finding(name));
            }
        }
        findings
    }

    /// - `largest_gap_ns`: maximum gap between two poses for interpolation.
    /// - `samples`: number of samples from the messages.
    pub(crate) fn findings(&self, largest_gap_ns: i64, samples: u64) -> Vec<InputFinding> {
        let mut findings = self.of_streams();
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use touchup_geometry::numeric::normal_quantile;

    const PERIOD_NS: i64 = 1_000_000;
    const COUNT: i64 = 4000;

    /// Stamps of a steady clock with normal errors.
    fn jitters(sigma_ms: f64) -> StreamStamps {
        let (mut stream, mut rng) = (StreamStamps::default(), Pcg64Mcg::seed_from_u64(1));
        for at in 0..COUNT {
            let error = normal_quantile(rng.random_range(1e-9..1.0)) * sigma_ms * 1e6;
            stream.push(1_000_000_000_000 + at * PERIOD_NS + error.round() as i64);
        }
        stream
    }

    #[test]
    fn a_jitter_above_the_period_is_found_with_its_size() {
        for (sigma_ms, is_sure) in [(3.0, false), (10.0, true), (30.0, true)] {
            let found = jitters(sigma_ms).jitter_finding("wrenches").unwrap();
            let number = &found.numbers[0];
            assert_eq!(
                (found.cause, found.is_sure),
                (InputCause::StampsGoBack, is_sure)
            );
            assert!(
                (number.value - sigma_ms).abs() < 3.0 * number.sigma,
                "{sigma_ms} ms: {number:?}"
            );
        }
        assert_eq!(jitters(0.3).jitter_finding("wrenches"), None);
    }

    /// Late ones after later ones; swapped pairs; several at once; stamps of arrival.
    #[test]
    fn transport_is_no_jitter() {
        let late = |at: i64| if at % 20 == 0 { at - 12 } else { at };
        let swapped = |at: i64| at ^ 7;
        let at_once = |at: i64| at / 8 * 8;
        let arrived = |at: i64| at + (at * 1597) % 7 - (at * 1597) % 7 % 3 * (at % 2);
        let streams: [&dyn Fn(i64) -> i64; 3] = [&late, &swapped, &at_once];
        for (number, stamp) in streams.into_iter().enumerate() {
            let mut stream = StreamStamps::default();
            (0..COUNT).for_each(|at| stream.push(stamp(at) * 8 * PERIOD_NS));
            assert_eq!(stream.jitter(), None, "stream {number}");
        }
        let (mut stream, mut newest) = (StreamStamps::default(), 0);
        for at in 0..COUNT {
            newest = newest.max(arrived(at) * PERIOD_NS);
            stream.push(newest);
        }
        assert_eq!(stream.jitter(), None);
    }
}
