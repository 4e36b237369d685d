//! Progress of a replay, and due times of its messages.

use std::time::{Duration, Instant};

use super::shown::{ReplayRequest, ReplayShown};

/// Maximum wait between clock readings; changes end it at once.
pub(super) const LOOK: Duration = Duration::from_secs(60);

/// Next action of the player.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::page) enum ReplayNext {
    /// send the message
    Go,
    /// restart the replay
    Again,
    /// end: no page follows
    Closed,
}

/// Pace and position of a replay. Times are along the recording without its long pauses, ns.
#[derive(Debug)]
pub(in crate::page) struct ReplayProgress {
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
    /// start of the present pace: clock and position
    pace: Option<(Instant, i64)>,
    /// number of changes
    pub changes: u64,
}

impl Default for ReplayProgress {
    /// Before reading, at the recorded speed.
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
    /// The topic `replay` of a session.
    pub fn shown(&self, session: &str) -> ReplayShown {
        // in tenths, to send visible changes only
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

    /// Applies the request of a page.
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
            // a mesh does not go back: the replay restarts from the scan
            self.starts_again |= at_ns < self.at_ns;
            self.target_ns = Some(at_ns);
        }
        self.pace = None;
        self.changes += 1;
    }

    /// Whether the present playback ends.
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

    /// Wait before the message of a time; `None`: send it now.
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
