//! Check that an order follows the newest state of the arm.
//!
//! A delayed caller finds queued states. Orders by them would follow a past position and force:
//! they stay unsent, and without orders the child brakes. Orders go out again once the caller has
//! taken the queue.

use super::interface::ArmError;

/// Maximum age of the followed state relative to the newest, in periods of the arm.
const OLD: f64 = 2.0;
/// Rounding of stamps, added to this age, s.
const ROUNDING: f64 = 0.5e-3;
/// Maximum duration of a lag, s: a caller that does not catch up is too slow for the arm.
const CATCHES_UP: f64 = 0.2;

/// Lag of a caller behind the arm.
#[derive(Clone, Copy, Debug)]
pub struct Freshness {
    /// maximum age of the followed state relative to the newest, s
    old: f64,
    /// stamp of the newest state at the first unsent order, s
    behind_since_s: Option<f64>,
}

impl Freshness {
    /// - `period`: between two states of the arm, s.
    pub fn new(period: f64) -> Self {
        Self {
            old: OLD * period + ROUNDING,
            behind_since_s: None,
        }
    }

    /// Whether an order may go out.
    ///
    /// - `followed_s`: stamp of the state that the order follows; `newest_s`: stamp of the newest
    ///   state, s; `late_s`: its delay, s.
    ///
    /// # Errors
    /// [`ArmError::Behind`] for a caller that does not catch up.
    pub fn may_send(
        &mut self,
        followed_s: f64,
        (newest_s, late_s): (f64, f64),
    ) -> Result<bool, ArmError> {
        let age = newest_s - followed_s + late_s;
        if age.is_nan() || age <= self.old {
            self.behind_since_s = None;
            return Ok(true);
        }
        let since = *self.behind_since_s.get_or_insert(newest_s);
        if newest_s - since > CATCHES_UP {
            self.behind_since_s = None;
            return Err(ArmError::Behind { age_ms: age * 1e3 });
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orders of a caller that takes one state per cycle from an arm with one state per 2 ms, after
    /// an initial delay: time of each order, ms, and whether it went out.
    fn orders(held_ms: u64, cycle_us: u64) -> (Vec<(f64, bool)>, Option<ArmError>) {
        let (mut freshness, mut orders, mut followed_s) = (Freshness::new(2e-3), Vec::new(), 0.0);
        let mut now_us = held_ms * 1000;
        while now_us < 1_000_000 {
            let newest_s = (now_us / 2000) as f64 * 2e-3;
            // an up-to-date caller waits for the next state
            followed_s = f64::min(followed_s + 2e-3, newest_s.max(followed_s));
            match freshness.may_send(followed_s, (newest_s, 0.0)) {
                Ok(went) => orders.push((now_us as f64 * 1e-3, went)),
                Err(error) => return (orders, Some(error)),
            }
            now_us += cycle_us;
        }
        (orders, None)
    }

    #[test]
    fn a_caller_that_keeps_up_is_never_held_back() {
        let (orders, error) = orders(0, 2000);
        assert!(error.is_none() && orders.len() == 500 && orders.iter().all(|(_, went)| *went));
    }

    /// 50 ms are 25 states; at a tenth of a millisecond each the caller takes them within 2.5 ms,
    /// in which one more comes.
    #[test]
    fn a_caller_that_was_held_for_50_ms_orders_nothing_until_it_has_caught_up() {
        let (orders, error) = orders(50, 100);
        assert_eq!(error, None);
        let first = orders.iter().find(|(_, went)| *went).unwrap().0;
        assert!((52.0..54.0).contains(&first), "{first} ms");
        assert!(
            orders
                .iter()
                .skip_while(|(_, went)| !went)
                .all(|(_, went)| *went)
        );
    }

    /// One state of 2 ms per 3 ms: the caller is 4 ms behind after some 15 ms, and never nearer.
    #[test]
    fn a_caller_that_is_slower_than_the_arm_orders_nothing_more_and_is_named() {
        let (orders, error) = orders(0, 3000);
        let last = orders.iter().rposition(|(_, went)| *went).unwrap();
        assert!(
            orders[last].0 < 30.0 && orders.len() - last > 50,
            "{:?}",
            orders[last]
        );
        let error = error.unwrap();
        assert!(
            matches!(error, ArmError::Behind { age_ms } if age_ms > 50.0),
            "{error}"
        );
    }

    #[test]
    fn an_order_by_the_newest_state_is_not_sent_where_that_came_late() {
        let mut freshness = Freshness::new(2e-3);
        assert_eq!(freshness.may_send(3.0, (3.0, 4e-3)), Ok(true));
        assert_eq!(freshness.may_send(3.0, (3.0, 40e-3)), Ok(false));
        assert_eq!(freshness.may_send(3.1, (3.1, 40e-3)), Ok(false));
        let behind = freshness.may_send(3.25, (3.25, 40e-3));
        assert!(
            matches!(behind, Err(ArmError::Behind { age_ms }) if (age_ms - 40.0).abs() < 1e-6),
            "{behind:?}"
        );
    }

    #[test]
    fn a_stamp_that_goes_back_holds_nothing_back() {
        let mut freshness = Freshness::new(2e-3);
        assert_eq!(freshness.may_send(10.0, (3.0, 0.0)), Ok(true));
        assert_eq!(freshness.may_send(f64::NAN, (3.0, 0.0)), Ok(true));
    }
}
