//! Hands on what the arm says, once each; and a beat where it says nothing.

use std::sync::PoisonError;
use std::thread;
use std::time::{Duration, Instant};

use super::Shared;
use super::library::Receive;
use crate::robot::ur::protocol::{Link, Report};

/// Between two looks: a fifth of the time between two states.
const LOOK: Duration = Duration::from_micros(400);
/// Where no state comes, a sign of life each this often.
const BEAT: Duration = Duration::from_millis(10);

/// Until the connection is lost.
pub fn hand_on(receive: &Receive, shared: &Shared) -> ! {
    let mut last_stamp = f64::NEG_INFINITY;
    let mut said = Instant::now();
    loop {
        if !receive.is_connected() {
            shared.lost(Link::States);
        }
        match receive.stamp().filter(|stamp| *stamp != last_stamp).and_then(|_| receive.state(shared.number())) {
            Some(state) => {
                last_stamp = state.stamp_s;
                *shared.latest.lock().unwrap_or_else(PoisonError::into_inner) = Some(state);
                shared.report(&Report::State(Box::new(state)));
                said = Instant::now();
            }
            None if said.elapsed() > BEAT => {
                shared.report(&Report::Beat { served: shared.number() });
                said = Instant::now();
            }
            None => {}
        }
        thread::sleep(LOOK);
    }
}
