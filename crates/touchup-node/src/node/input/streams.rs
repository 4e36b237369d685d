//! Arrival of the two streams.

use std::time::{Duration, Instant};

/// Minimum averaging time of rates.
const RATE_OVER: Duration = Duration::from_secs(1);

/// Arrival of one stream.
#[derive(Clone, Debug)]
pub struct StreamWatch {
    last: Option<Instant>,
    /// stamp of the last message, ns, and its arrival
    stamped: Option<(i64, Instant)>,
    /// number of messages
    pub arrived: u64,
    /// number of gaps
    pub gaps: u64,
    is_stale: bool,
    since: Instant,
    arrived_since: u64,
    /// messages per second
    pub rate_hz: f64,
}

impl StreamWatch {
    /// Before the first message.
    pub fn new(now: Instant) -> Self {
        Self {
            last: None,
            stamped: None,
            arrived: 0,
            gaps: 0,
            is_stale: true,
            since: now,
            arrived_since: 0,
            rate_hz: 0.0,
        }
    }

    /// Notes a message.
    ///
    /// - `stamp_ns`: of its header, if valid; `at`: arrival at the port.
    pub fn arrive(&mut self, now: Instant, stamp_ns: Option<i64>, at: Instant) {
        self.last = Some(now);
        self.stamped = stamp_ns.map(|stamp_ns| (stamp_ns, at));
        self.is_stale = false;
        self.arrived += 1;
    }

    /// Updates rate and gaps, called from time to time; returns whether the stream is stale.
    pub fn check(&mut self, now: Instant, stale: Duration) -> bool {
        let is_stale = self
            .last
            .is_none_or(|last| now.saturating_duration_since(last) > stale);
        self.gaps += u64::from(is_stale && !self.is_stale);
        self.is_stale = is_stale;
        let over = now.saturating_duration_since(self.since);
        if over >= RATE_OVER {
            self.rate_hz = (self.arrived - self.arrived_since) as f64 / over.as_secs_f64();
            (self.since, self.arrived_since) = (now, self.arrived);
        }
        is_stale
    }

    /// Whether the last message has an empty stamp.
    pub fn is_unstamped(&self) -> bool {
        self.stamped.is_some_and(|(stamp_ns, _)| stamp_ns == 0)
    }

    /// Lead of this stream's stamps over simultaneous ones of the other, s; `None` before both have
    /// come.
    pub fn stamped_beyond(&self, other: &Self) -> Option<f64> {
        let ((ours_ns, ours), (theirs_ns, theirs)) = (self.stamped?, other.stamped?);
        let between = ours.saturating_duration_since(theirs).as_secs_f64()
            - theirs.saturating_duration_since(ours).as_secs_f64();
        Some((ours_ns as f64 - theirs_ns as f64) * 1e-9 - between)
    }

    /// Age of the last message; `None` before the first.
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.last.map(|last| now.saturating_duration_since(last))
    }
}

/// Detection of a clock set back: both streams come with stamps older than earlier ones, message
/// after message.
///
/// Time in a session only goes forward: from then on stamps continue 61 s beyond the newest one, so
/// that nothing pairs across.
#[derive(Clone, Debug, Default)]
pub struct Epoch {
    /// offset added to stamps, ns
    pub shift_ns: i64,
    newest_ns: i64,
    late: [u32; 2],
    /// number of times that the clock went back
    pub jumps: u64,
}

/// Number of late messages in a row of both streams that is no mistake of single messages.
const MOST_LATE: u32 = 50;
/// Time between two epochs, ns: longer than any bridged gap between poses.
const BETWEEN_NS: i64 = 61_000_000_000;

impl Epoch {
    /// Notes whether a message of stream 0 or 1 with this shifted stamp was accepted. Returns
    /// whether a new epoch begins: then the next message needs another shift.
    ///
    /// - `newest_ns`: confirmed newest stamp of both streams: a leap withdrawn later does not
    ///   count.
    pub fn note(
        &mut self,
        stream: usize,
        stamp_ns: i64,
        is_taken: bool,
        newest_ns: Option<i64>,
    ) -> bool {
        self.newest_ns = self.newest_ns.max(newest_ns.unwrap_or(0));
        if is_taken {
            self.late = [0; 2];
            return false;
        }
        let is_behind = stamp_ns < self.newest_ns;
        self.late[stream] = if is_behind {
            self.late[stream] + 1
        } else {
            self.late[stream]
        };
        if self.late.iter().any(|&late| late < MOST_LATE) {
            return false;
        }
        let shift_ns = self
            .newest_ns
            .saturating_add(BETWEEN_NS)
            .saturating_sub(stamp_ns);
        self.shift_ns = self.shift_ns.saturating_add(shift_ns);
        self.late = [0; 2];
        self.jumps += 1;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_stream_is_stale_after_its_time_and_that_counts_once() {
        let (begun, stale) = (Instant::now(), 100 * MS);
        let mut stream = StreamWatch::new(begun);
        assert!(
            stream.check(begun, stale) && stream.gaps == 0,
            "what never came is no gap"
        );
        for round in 1..=3u32 {
            let came = begun + round * 1000 * MS;
            stream.arrive(came, None, came);
            assert!(!stream.check(came, stale) && !stream.check(came + stale, stale));
            assert_eq!(
                (stream.gaps, stream.age(came + stale)),
                (u64::from(round) - 1, Some(stale))
            );
            assert!(
                stream.check(came + stale + MS, stale) && stream.check(came + 3 * stale, stale)
            );
            assert_eq!(stream.gaps, u64::from(round));
        }
    }

    /// Worked by hand: the wrench comes 2 ms after the pose, and its stamp is 5 s and 2 ms later.
    #[test]
    fn stamps_are_compared_at_the_same_time() {
        let begun = Instant::now();
        let [mut poses, mut wrenches] = [StreamWatch::new(begun), StreamWatch::new(begun)];
        poses.arrive(begun, Some(1_000_000_000), begun);
        assert_eq!(poses.stamped_beyond(&wrenches), None);
        wrenches.arrive(begun + 3 * MS, Some(6_002_000_000), begun + 2 * MS);
        assert!((poses.stamped_beyond(&wrenches).unwrap() + 5.0).abs() < 1e-9);
        assert!((wrenches.stamped_beyond(&poses).unwrap() - 5.0).abs() < 1e-9);
        assert!(!poses.is_unstamped());
        poses.arrive(begun, Some(0), begun);
        assert!(poses.is_unstamped());
    }

    #[test]
    fn a_rate_is_that_of_the_last_second() {
        let begun = Instant::now();
        let mut stream = StreamWatch::new(begun);
        let mut rates = Vec::new();
        for ms in 1..=3000u32 {
            // 1000 Hz, then 250 Hz, then nothing
            if ms <= 1000 || (ms <= 2000 && ms % 4 == 0) {
                stream.arrive(begun + ms * MS, None, begun + ms * MS);
            }
            stream.check(begun + ms * MS, 100 * MS);
            if ms % 1000 == 0 {
                rates.push(stream.rate_hz);
            }
        }
        assert_eq!(rates, [1000.0, 250.0, 0.0]);
    }
}
