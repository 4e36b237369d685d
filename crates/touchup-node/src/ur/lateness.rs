//! Lateness of the states of an arm.
//!
//! No stamp is in the clock of this machine. But the state with the least delay from stamp to
//! arrival was the least late; the excess of another state's delay is its lateness. Only the last
//! seconds count, so the measure follows a controller clock that goes a little faster or slower.

use std::time::{Duration, Instant};

/// Memory of the least delay; the two newest memories count. Two clocks differ by less than a
/// millisecond after it.
const MEMORY: Duration = Duration::from_secs(5);
/// Number of states examined before any motion: one second.
pub(super) const LOOKED_AT: usize = 500;
/// Maximum 99th percentile of the lateness before any motion, ms: two periods, as an order that
/// follows an older state is not sent.
const USUAL_MS: f64 = 4.0;
/// Maximum lateness before any motion, ms: beyond it a motion ends.
const WORST_MS: f64 = 20.0;

/// Lateness of the states before any motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StartLateness {
    /// 99th percentile, ms
    pub usual_ms: f64,
    pub worst_ms: f64,
}

impl StartLateness {
    /// Whether orders reach the arm in time on this machine.
    pub fn is_tolerable(&self) -> bool {
        self.usual_ms <= USUAL_MS && self.worst_ms <= WORST_MS
    }
}

/// Lateness by arrivals and stamps.
#[derive(Debug)]
pub(super) struct Lateness {
    begun: Instant,
    /// lateness of the first states relative to those before them, s
    first_s: Vec<f64>,
    /// least delay of the last two memories, s
    least_s: [f64; 2],
    since: Instant,
    newest_s: f64,
}

impl Lateness {
    pub fn new(now: Instant) -> Self {
        Self {
            begun: now,
            first_s: Vec::new(),
            least_s: [f64::INFINITY; 2],
            since: now,
            newest_s: f64::INFINITY,
        }
    }

    /// Notes a new state.
    pub fn take(&mut self, stamp_s: f64, now: Instant) {
        self.newest_s = now.saturating_duration_since(self.begun).as_secs_f64() - stamp_s;
        if now.saturating_duration_since(self.since) > MEMORY {
            (self.least_s, self.since) = ([f64::INFINITY, self.least_s[0]], now);
        }
        self.least_s[0] = self.least_s[0].min(self.newest_s);
        if self.first_s.len() < LOOKED_AT {
            self.first_s.push(self.newest_s());
        }
    }

    /// Lateness of the newest state, s.
    pub fn newest_s(&self) -> f64 {
        let least = self.least_s[0].min(self.least_s[1]);
        if least.is_finite() {
            self.newest_s - least
        } else {
            0.0
        }
    }

    /// Lateness of the first states; `None`: some are missing.
    pub fn at_start(&self) -> Option<StartLateness> {
        let mut late = self.first_s.clone();
        late.sort_by(f64::total_cmp);
        let usual = late
            .get(LOOKED_AT * 99 / 100 - 1)
            .filter(|_| late.len() == LOOKED_AT)?;
        Some(StartLateness {
            usual_ms: usual * 1e3,
            worst_ms: late.last()? * 1e3,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States each 2 ms with a given lateness, ms.
    fn after(count: usize, late_ms: impl Fn(usize) -> f64) -> Lateness {
        let begun = Instant::now();
        let mut lateness = Lateness::new(begun);
        for number in 0..count {
            // the controller has been on for a day
            let stamp_s = 86_400.0 + number as f64 * 2e-3;
            let arrival_ms = number as f64 * 2.0 + 1.0 + late_ms(number);
            lateness.take(stamp_s, begun + Duration::from_secs_f64(arrival_ms * 1e-3));
        }
        lateness
    }

    #[test]
    fn one_in_two_hundred_that_is_10_ms_late_is_tolerable_and_one_in_fifty_is_not() {
        let each = |every: usize, ms: f64| {
            after(
                LOOKED_AT,
                move |number| if number % every == 3 { ms } else { 0.0 },
            )
        };
        for (every, ms, usual_ms, is_tolerable) in [
            (200, 10.0, 0.0, true),
            (50, 10.0, 10.0, false),
            (50, 3.0, 3.0, true),
            (300, 25.0, 0.0, false),
        ] {
            let found = each(every, ms).at_start().unwrap();
            assert!((found.usual_ms - usual_ms).abs() < 1e-3, "{found:?}");
            assert!((found.worst_ms - ms).abs() < 1e-3, "{found:?}");
            assert_eq!(
                found.is_tolerable(),
                is_tolerable,
                "each {every}th by {ms} ms: {found:?}"
            );
        }
        assert_eq!(after(LOOKED_AT - 1, |_| 0.0).at_start(), None);
    }

    #[test]
    fn a_constant_delay_that_begins_shows_and_a_clock_that_goes_faster_does_not() {
        // late from the 1000th on
        let late = after(1100, |number| if number < 1000 { 0.5 } else { 40.5 });
        assert!(
            (late.newest_s() - 40e-3).abs() < 1e-6,
            "{}",
            late.newest_s()
        );
        // 50 millionths for an hour are 180 ms; the memory of at most ten seconds keeps 0.5 ms of
        // them
        let drifting = after(1_800_000, |number| number as f64 * 2.0 * 50e-6);
        assert!(drifting.newest_s() < 0.51e-3, "{}", drifting.newest_s());
        assert_eq!(after(0, |_| 0.0).newest_s(), 0.0);
        // a clock that stands still while states come, as in a test
        let ahead = after(LOOKED_AT, |number| -2.0 * number as f64)
            .at_start()
            .unwrap();
        assert_eq!(
            ahead,
            StartLateness {
                usual_ms: 0.0,
                worst_ms: 0.0
            }
        );
    }
}
