//! Age of the messages of a topic.
//!
//! The clocks of the controller and of this machine need not agree: the lateness of a message is
//! the excess of its delay from stamp to arrival over the least delay before. That least delay may
//! grow as fast as two clocks may drift apart.

use std::time::{Duration, Instant};

use touchup_probing::arm::ArmError;

/// Maximum drift between two clocks, as a share.
const DRIFT: f64 = 2e-4;
/// Lead of stamps that counts as a jump, s. Messages held up on the way and arriving at once are
/// late before, not ahead.
const JUMP: f64 = 0.1;

/// Stamps and arrivals of a topic.
#[derive(Clone, Debug)]
pub(super) struct TopicAge {
    topic: String,
    begun: Instant,
    last_ns: Option<i64>,
    /// least delay from stamp to arrival, s; the two clocks have zeros of their own
    least_delay: f64,
    /// arrival of the last new message
    heard_at: Instant,
    /// arrival of the last message, new or not
    came_at: Instant,
}

impl TopicAge {
    pub fn new(topic: &str, now: Instant) -> Self {
        let topic = topic.to_owned();
        Self {
            topic,
            begun: now,
            last_ns: None,
            least_delay: f64::INFINITY,
            heard_at: now,
            came_at: now,
        }
    }

    /// Notes a message; returns whether it is new.
    ///
    /// - `late`: lateness that is a fault.
    pub fn see(&mut self, stamp_ns: i64, late: Duration, now: Instant) -> Result<bool, ArmError> {
        self.came_at = now;
        let since_last_ns = self
            .last_ns
            .map_or(1, |last_ns| stamp_ns.saturating_sub(last_ns));
        if since_last_ns == 0 {
            return Ok(false);
        }
        if since_last_ns < 0 {
            return Err(ArmError::WentBack {
                back_ms: -since_last_ns as f64 * 1e-6,
            });
        }
        let arrived = now.saturating_duration_since(self.begun).as_secs_f64();
        let delay = arrived - stamp_ns as f64 * 1e-9;
        let drifted = DRIFT * now.saturating_duration_since(self.heard_at).as_secs_f64();
        let least = self.least_delay + drifted;
        (self.last_ns, self.heard_at) = (Some(stamp_ns), now);
        self.least_delay = least.min(delay);
        let topic = || self.topic.clone();
        if least - delay > JUMP && least.is_finite() {
            return Err(ArmError::JumpedAhead {
                topic: topic(),
                ahead_ms: (least - delay) * 1e3,
            });
        }
        if delay - least > late.as_secs_f64() {
            return Err(ArmError::Late {
                topic: topic(),
                late_ms: (delay - least) * 1e3,
            });
        }
        Ok(true)
    }

    /// Stamp of the newest message.
    pub fn stamp_ns(&self) -> Option<i64> {
        self.last_ns
    }

    /// Remaining time of allowed silence.
    ///
    /// # Errors
    /// After it [`ArmError::TopicSilent`], or [`ArmError::Stale`] if only the same message repeats.
    pub fn patience(&self, silent: Duration, now: Instant) -> Result<Duration, ArmError> {
        let waited = now.saturating_duration_since(self.heard_at);
        if waited < silent {
            return Ok(silent - waited);
        }
        if now.saturating_duration_since(self.came_at) < silent && self.last_ns.is_some() {
            return Err(ArmError::Stale);
        }
        Err(ArmError::TopicSilent {
            topic: self.topic.clone(),
            silent_ms: waited.as_secs_f64() * 1e3,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SILENT: Duration = Duration::from_millis(60);
    const MS: i64 = 1_000_000;

    /// A topic with messages each 2 ms for one second, 7 ms after their stamps.
    fn steady() -> (TopicAge, Instant) {
        let begun = Instant::now();
        let mut age = TopicAge::new("t", begun);
        for number in 0..500 {
            let now = begun + Duration::from_millis(number * 2 + 7);
            assert_eq!(age.see(number as i64 * 2 * MS, SILENT, now), Ok(true));
        }
        (age, begun)
    }

    /// 7 ms are usual: at 1068 ms a stamp of 1000 ms is 61 ms late; the drift of 70 ms is 0.014 ms.
    #[test]
    fn a_message_is_late_by_what_it_is_later_than_usual() {
        let (mut age, begun) = steady();
        let at = |ms| begun + Duration::from_millis(ms);
        assert_eq!(age.clone().see(1000 * MS, SILENT, at(1066)), Ok(true));
        let late = age.see(1000 * MS, SILENT, at(1068)).unwrap_err();
        assert!(
            matches!(&late, ArmError::Late { late_ms, .. } if (late_ms - 61.0).abs() < 0.1),
            "{late}"
        );
    }

    #[test]
    fn a_stamp_that_jumps_is_named_by_its_direction() {
        let (mut age, begun) = steady();
        let now = begun + Duration::from_millis(1007);
        let ahead = age
            .clone()
            .see(1000 * MS + 300 * MS, SILENT, now)
            .unwrap_err();
        assert!(
            matches!(ahead, ArmError::JumpedAhead { ahead_ms, .. } if (ahead_ms - 300.0).abs() < 0.1)
        );
        assert_eq!(
            age.see(990 * MS, SILENT, now),
            Err(ArmError::WentBack { back_ms: 8.0 })
        );
    }

    #[test]
    fn a_silent_topic_and_one_that_says_the_same_again_are_told_apart() {
        let (mut age, begun) = steady();
        let at = |ms| begun + Duration::from_millis(ms);
        assert_eq!(
            age.patience(SILENT, at(1025)),
            Ok(Duration::from_millis(40))
        );
        let silent = age.patience(SILENT, at(1065)).unwrap_err();
        assert!(
            matches!(silent, ArmError::TopicSilent { silent_ms, .. } if silent_ms == 60.0),
            "{silent}"
        );
        assert_eq!(age.see(998 * MS, SILENT, at(1064)), Ok(false));
        assert_eq!(age.patience(SILENT, at(1065)), Err(ArmError::Stale));
    }

    /// 100 millionths are 360 ms in an hour.
    #[test]
    fn clocks_that_drift_apart_are_no_fault() {
        let begun = Instant::now();
        let mut age = TopicAge::new("t", begun);
        for second in 0..3600_u64 {
            let now = begun + Duration::from_secs(second);
            let stamp_ns = second as i64 * (1_000_000_000 - 100_000);
            assert_eq!(age.see(stamp_ns, SILENT, now), Ok(true), "{second} s");
        }
    }
}
