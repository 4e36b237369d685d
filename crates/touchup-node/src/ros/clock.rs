//! The time of ROS, for stamps; deadlines use [`touchup_session::clock::Clock`].

use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::ros::messages::Time;

/// A stamp as one number, ns.
pub fn stamp_ns(time: Time) -> i64 {
    i64::from(time.sec) * 1_000_000_000 + i64::from(time.nanosec)
}

/// The nearest representable stamp of a message.
pub fn time(stamp_ns: i64) -> Time {
    let sec = stamp_ns
        .div_euclid(1_000_000_000)
        .clamp(i64::from(i32::MIN), i64::from(i32::MAX));
    Time {
        sec: sec as i32,
        nanosec: stamp_ns.rem_euclid(1_000_000_000) as u32,
    }
}

/// The time of ROS: the system's, or that of `/clock`.
#[derive(Debug)]
pub struct RosClock {
    is_simulated: bool,
    simulated_ns: AtomicI64,
}

impl RosClock {
    /// - `is_simulated`: the parameter `use_sim_time`.
    pub fn new(is_simulated: bool) -> Self {
        Self {
            is_simulated,
            simulated_ns: AtomicI64::new(0),
        }
    }

    /// Sets the time from `/clock`.
    pub fn set(&self, time: Time) {
        self.simulated_ns.store(stamp_ns(time), Ordering::Relaxed);
    }

    /// Now, ns; 0 before the first message of a simulated clock.
    pub fn now_ns(&self) -> i64 {
        if self.is_simulated {
            return self.simulated_ns.load(Ordering::Relaxed);
        }
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_nanos() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simulated_clock_says_what_it_was_set_to() {
        let clock = RosClock::new(true);
        assert_eq!(clock.now_ns(), 0);
        clock.set(Time { sec: 2, nanosec: 5 });
        assert_eq!(clock.now_ns(), 2_000_000_005);
        clock.set(Time { sec: 1, nanosec: 0 });
        assert_eq!(
            clock.now_ns(),
            1_000_000_000,
            "a recording that is played again"
        );
    }
}
