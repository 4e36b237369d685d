//! Passes on each state of the arm once, and a heartbeat if none comes.

use std::thread;
use std::time::{Duration, Instant};

use super::library::Receive;
use super::shared::ChildShared;
use crate::ur::protocol::{ClientReport, RtdeConnection, UrState};
use touchup_session::clock::{Clock, ManualClock};

/// Polling period: a fifth of the time between two states.
const LOOK: Duration = Duration::from_micros(400);
/// Period of the heartbeat without states.
const BEAT: Duration = Duration::from_millis(10);

/// Runs until the connection is lost.
///
/// - `clock`: of the driver; `hand`: moves it, if it follows the controller.
pub fn hand_on(
    receive: &Receive,
    shared: &ChildShared,
    clock: &Clock,
    hand: Option<&ManualClock>,
) -> ! {
    // the heartbeat of this process follows the time of this machine
    let machine = Clock::system();
    let mut last = LastReport {
        stamp_s: f64::INFINITY,
        at: machine.now(),
    };
    loop {
        if !receive.is_connected() {
            shared.lost(RtdeConnection::States);
        }
        let state = receive
            .stamp()
            .filter(|stamp| last.is_new(*stamp))
            .and_then(|_| receive.state(shared.number()));
        if let Some(state) = state {
            let passed = hand.map(|_| {
                Duration::try_from_secs_f64(state.stamp_s - last.stamp_s).unwrap_or_default()
            });
            shared.see(state, clock.now() + passed.unwrap_or_default());
            // waiting threads find the state
            hand.zip(passed)
                .iter()
                .for_each(|(hand, passed)| hand.advance(*passed));
        }
        if let Some(report) = last.next(state, shared.number(), machine.now()) {
            shared.report(&report);
        }
        thread::sleep(LOOK);
    }
}

/// The last report, and its time.
pub struct LastReport {
    pub stamp_s: f64,
    pub at: Instant,
}

impl LastReport {
    fn is_new(&self, stamp_s: f64) -> bool {
        stamp_s != self.stamp_s
    }

    /// The report due now.
    pub fn next(
        &mut self,
        state: Option<UrState>,
        served: u64,
        now: Instant,
    ) -> Option<ClientReport> {
        let report = match state {
            Some(state) => {
                self.stamp_s = state.stamp_s;
                ClientReport::State(Box::new(state))
            }
            None if now.saturating_duration_since(self.at) > BEAT => ClientReport::Beat { served },
            None => return None,
        };
        self.at = now;
        Some(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ur::protocol::tests::STATE;

    #[test]
    fn a_state_is_reported_at_once_and_where_none_comes_a_beat_each_10_ms() {
        let (clock, hand) = Clock::manual();
        let mut last = LastReport {
            stamp_s: f64::INFINITY,
            at: clock.now(),
        };
        assert!(last.is_new(0.0));
        let state = last.next(Some(STATE), 7, clock.now());
        assert_eq!(state, Some(ClientReport::State(Box::new(STATE))));
        assert!(!last.is_new(STATE.stamp_s));
        let mut beats = Vec::new();
        for ms in 1..=35 {
            hand.advance(Duration::from_millis(1));
            beats.extend(last.next(None, 7, clock.now()).map(|report| (ms, report)));
        }
        assert_eq!(
            beats,
            [11, 22, 33].map(|ms| (ms, ClientReport::Beat { served: 7 }))
        );
    }
}
