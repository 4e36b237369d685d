//! Pace and progress of a replay: pages set it, and the player follows.

use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::Duration;

use serde_json::{Value, json};

use super::progress::{LOOK, ReplayNext, ReplayProgress};
use super::shown::{ReplayRequest, ReplayShown};
use crate::ros::locked;
use touchup_session::clock::Clock;

/// Control that the pages of a replay share with its player.
#[derive(Debug)]
pub(in crate::page) struct ReplayControl {
    session: String,
    clock: Clock,
    progress: Mutex<ReplayProgress>,
    changed: Condvar,
}

impl ReplayControl {
    /// State before reading.
    ///
    /// - `session`: its name.
    pub fn new(session: &str, clock: Clock) -> Self {
        Self {
            session: session.to_owned(),
            clock,
            progress: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    /// Name of the session.
    pub fn session(&self) -> &str {
        &self.session
    }

    /// The present topic `replay`.
    pub fn shown(&self) -> ReplayShown {
        locked(&self.progress).shown(&self.session)
    }

    /// Answers `~/replay`.
    ///
    /// # Errors
    /// In words: an invalid request, which changes nothing.
    pub fn call(&self, request: Value) -> Result<Value, String> {
        let request = ReplayRequest::read(request)?;
        let mut progress = locked(&self.progress);
        if !progress.is_ready {
            return Err("the session is still being read: ask again when it plays".to_owned());
        }
        if let Some(error) = &progress.error {
            return Err(error.clone());
        }
        progress.set(request);
        self.changed.notify_all();
        Ok(json!({ "success": true, "message": "" }))
    }

    /// Ends the replay: no page follows it.
    pub fn close(&self) {
        locked(&self.progress).is_closed = true;
        self.changed.notify_all();
    }

    /// Whether no page follows the replay.
    pub(in crate::page) fn is_closed(&self) -> bool {
        locked(&self.progress).is_closed
    }

    /// Reading is complete.
    ///
    /// - `end_ns`: time of the last message.
    /// - `damage`: position of damage, at which the recording ends.
    pub(in crate::page) fn begin(&self, end_ns: i64, damage: Option<String>) {
        let mut progress = locked(&self.progress);
        (progress.is_ready, progress.end_ns, progress.damage) = (true, end_ns, damage);
    }

    /// Stops with an error; returns when no page follows the replay.
    pub(in crate::page) fn fail(&self, why: String) {
        let mut progress = locked(&self.progress);
        progress.error = Some(why);
        while !progress.is_closed {
            progress = self.wait(progress, LOOK);
        }
    }

    /// Returns when the message of a time is due.
    pub(in crate::page) fn wait_for(&self, at_ns: i64) -> ReplayNext {
        let mut progress = locked(&self.progress);
        loop {
            if let Some(next) = progress.left() {
                return next;
            }
            let wait = match progress.wait_until(at_ns, self.clock.now()) {
                None => {
                    progress.at_ns = at_ns;
                    return ReplayNext::Go;
                }
                Some(wait) => wait,
            };
            progress = self.wait(progress, wait);
        }
    }

    /// After the last message: returns when the replay restarts, or no page follows it.
    pub(in crate::page) fn wait_at_end(&self) -> ReplayNext {
        let mut progress = locked(&self.progress);
        progress.is_at_end = true;
        loop {
            if let Some(next) = progress.left() {
                return next;
            }
            (progress.target_ns, progress.at_ns) = (None, progress.end_ns);
            progress = self.wait(progress, LOOK);
        }
    }

    fn wait<'a>(
        &self,
        progress: MutexGuard<'a, ReplayProgress>,
        longest: Duration,
    ) -> MutexGuard<'a, ReplayProgress> {
        let changes = progress.changes;
        let is_same =
            |progress: &mut ReplayProgress| progress.changes == changes && !progress.is_closed;
        self.clock
            .wait_while(&self.changed, progress, longest, is_same)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, channel};
    use std::thread::spawn;

    use super::*;
    use touchup_session::clock::ManualClock;

    const S: i64 = 1_000_000_000;

    /// A replay of 100 s, ready to play.
    fn replay() -> (Arc<ReplayControl>, ManualClock) {
        let (clock, hand) = Clock::manual();
        let control = Arc::new(ReplayControl::new("monday", clock));
        control.begin(100 * S, None);
        (control, hand)
    }

    fn set(control: &ReplayControl, request: Value) {
        assert_eq!(control.call(request).unwrap()["success"], true);
    }

    /// Result for a message of a time, once decided.
    fn waiting(
        control: &Arc<ReplayControl>,
        hand: &ManualClock,
        at_ns: i64,
    ) -> Receiver<ReplayNext> {
        let (begun, control) = (hand.begun(), Arc::clone(control));
        let (to, next) = channel();
        spawn(move || to.send(control.wait_for(at_ns)));
        while hand.begun() == begun {
            std::thread::yield_now();
        }
        next
    }

    #[test]
    fn messages_come_at_their_times_and_faster_by_the_speed() {
        let (control, hand) = replay();
        assert_eq!(control.wait_for(0), ReplayNext::Go);
        let next = waiting(&control, &hand, 2 * S);
        hand.advance(Duration::from_millis(1999));
        assert!(next.try_recv().is_err());
        hand.advance(Duration::from_millis(1));
        assert_eq!(next.recv(), Ok(ReplayNext::Go));
        set(&control, json!({ "speed": 16 }));
        let next = waiting(&control, &hand, 18 * S);
        hand.advance(Duration::from_millis(999));
        assert!(next.try_recv().is_err());
        hand.advance(Duration::from_millis(1));
        assert_eq!(next.recv(), Ok(ReplayNext::Go));
        let shown = control.shown();
        assert_eq!((shown.at_s, shown.end_s, shown.speed), (18.0, 100.0, 16.0));
    }

    #[test]
    fn a_pause_holds_it_and_what_was_missed_is_not_made_up_for() {
        let (control, hand) = replay();
        assert_eq!(control.wait_for(0), ReplayNext::Go);
        set(&control, json!({ "is_paused": true }));
        let next = waiting(&control, &hand, S);
        hand.advance(Duration::from_secs(30));
        assert!(next.try_recv().is_err() && control.shown().is_paused);
        let begun = hand.begun();
        set(&control, json!({ "is_paused": false }));
        while hand.begun() == begun {
            std::thread::yield_now();
        }
        hand.advance(Duration::from_millis(999));
        assert!(next.try_recv().is_err());
        hand.advance(Duration::from_millis(1));
        assert_eq!(next.recv(), Ok(ReplayNext::Go));
    }

    #[test]
    fn it_runs_ahead_to_a_later_place_and_begins_again_for_an_earlier_one() {
        let (control, _hand) = replay();
        set(&control, json!({ "is_paused": true, "at_s": 50 }));
        for at_ns in [0, 20 * S, 50 * S - 1] {
            assert_eq!(control.wait_for(at_ns), ReplayNext::Go);
            assert_eq!(control.shown().target_s, Some(50.0));
        }
        set(&control, json!({ "at_s": 10.5 }));
        assert_eq!(control.wait_for(50 * S), ReplayNext::Again);
        let shown = control.shown();
        assert_eq!(
            (shown.at_s, shown.target_s, shown.is_paused),
            (0.0, Some(10.5), true)
        );
        assert_eq!(control.wait_for(10 * S), ReplayNext::Go);
        // times beyond the end are the end; the replay then goes back to the beginning
        set(&control, json!({ "is_paused": false, "at_s": 1e300 }));
        assert_eq!(control.wait_for(99 * S), ReplayNext::Go);
        set(&control, json!({ "at_s": 0 }));
        assert_eq!(control.wait_at_end(), ReplayNext::Again);
        assert!(!control.shown().is_at_end);
        assert_eq!(control.wait_for(0), ReplayNext::Go);
        assert_eq!(control.shown().target_s, None);
    }

    #[test]
    fn it_ends_when_nobody_looks() {
        let (control, hand) = replay();
        assert_eq!(control.wait_for(0), ReplayNext::Go);
        let next = waiting(&control, &hand, S);
        control.close();
        assert_eq!(next.recv(), Ok(ReplayNext::Closed));
        assert_eq!(control.wait_at_end(), ReplayNext::Closed);
    }

    #[test]
    fn what_is_wrong_with_a_request_is_said_and_changes_nothing() {
        let (control, _hand) = replay();
        let before = control.shown();
        for (request, words) in [
            (json!({ "speed": 0 }), "it may be 0.1 to 100"),
            (json!({ "speed": 1e9 }), "it may be 0.1 to 100"),
            (
                json!({ "at_s": -1, "is_paused": true }),
                "it may be 0 or more",
            ),
            (json!({ "at": 1 }), "unknown field"),
            (json!("all"), "invalid type"),
        ] {
            let why = control.call(request).unwrap_err();
            assert!(why.contains(words), "{why}");
        }
        assert_eq!(control.shown(), before);
        let unread = ReplayControl::new("monday", Clock::system());
        assert!(
            unread
                .call(json!({ "at_s": 1 }))
                .unwrap_err()
                .contains("still being read")
        );
    }
}
