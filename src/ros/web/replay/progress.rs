//! How far a replay is, and when its next message is due.

use std::time::{Duration, Instant};

use super::shown::{ReplayRequest, ReplayShown};

/// Longest wait without a look at the clock; whatever changes ends it at once.
pub(super) const LOOK: Duration = Duration::from_secs(60);

/// What a message that waits for its time is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReplayNext {
    /// now
    Go,
    /// the replay begins again
    Again,
    /// nobody looks any more
    Closed,
}

/// A replay's pace and place. Times are those along the recording without its long pauses, ns.
#[derive(Debug)]
pub(super) struct ReplayProgress {
    pub is_ready: bool,
    pub speed: f64,
    pub is_paused: bool,
    pub at_ns: i64,
    pub end_ns: i64,
    pub target_ns: Option<i64>,
    pub is_at_end: bool,
    pub damage: Option<String>,
    pub error: Option<String>,
    pub starts_again: bool,
    pub is_closed: bool,
    /// from when and where on it plays at this speed, once it does
    pace: Option<(Instant, i64)>,
    /// times that something was set
    pub changes: u64,
}

impl Default for ReplayProgress {
    /// Nothing is read yet; it will play at the recorded speed.
    fn default() -> Self {
        Self {
            is_ready: false,
            speed: 1.0,
            is_paused: false,
            at_ns: 0,
            end_ns: 0,
            target_ns: None,
            is_at_end: false,
            damage: None,
            error: None,
            starts_again: false,
            is_closed: false,
            pace: None,
            changes: 0,
        }
    }
}

impl ReplayProgress {
    /// The topic `replay` of a session of this name.
    pub fn shown(&self, session: &str) -> ReplayShown {
        // in tenths, so that a page hears no more often than it can show
        let seconds = |ns: i64| (ns as f64 * 1e-8).round() / 10.0;
        ReplayShown {
            session: session.to_owned(),
            is_ready: self.is_ready,
            speed: self.speed,
            is_paused: self.is_paused,
            at_s: seconds(self.at_ns),
            end_s: seconds(self.end_ns),
            target_s: self.target_ns.map(seconds),
            is_at_end: self.is_at_end,
            damage: self.damage.clone(),
            error: self.error.clone(),
        }
    }

    /// Goes on as pages want it.
    pub fn set(
        &mut self,
        ReplayRequest {
            speed,
            is_paused,
            at_s,
        }: ReplayRequest,
    ) {
        self.speed = speed.unwrap_or(self.speed);
        self.is_paused = is_paused.unwrap_or(self.is_paused);
        if let Some(at_s) = at_s {
            let at_ns = ((at_s * 1e9) as i64).min(self.end_ns);
            // a mesh does not go back: it is touched again from the scan on
            self.starts_again |= at_ns < self.at_ns;
            self.target_ns = Some(at_ns);
        }
        self.pace = None;
        self.changes += 1;
    }

    /// Whether what plays is to be left.
    pub fn left(&mut self) -> Option<ReplayNext> {
        if self.is_closed {
            return Some(ReplayNext::Closed);
        }
        if !std::mem::take(&mut self.starts_again) {
            return None;
        }
        (self.at_ns, self.is_at_end, self.pace) = (0, false, None);
        Some(ReplayNext::Again)
    }

    /// For how long the message of a time has to wait; `None`: not at all.
    pub fn wait_until(&mut self, at_ns: i64, now: Instant) -> Option<Duration> {
        if let Some(target_ns) = self.target_ns {
            if at_ns < target_ns {
                return None;
            }
            (self.target_ns, self.at_ns, self.pace) = (None, target_ns, None);
        }
        if self.is_paused {
            return Some(LOOK);
        }
        let (since, from_ns) = *self.pace.get_or_insert((now, self.at_ns));
        let passed = Duration::from_nanos(at_ns.saturating_sub(from_ns).max(0) as u64);
        let due = since + passed.div_f64(self.speed);
        Some(due.saturating_duration_since(now)).filter(|wait| !wait.is_zero())
    }
}
