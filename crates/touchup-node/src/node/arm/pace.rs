//! A simulated arm paced by a clock.

use std::time::{Duration, Instant};

use touchup_probing::arm::{Arm, ArmError, ArmState, Command};
use touchup_session::clock::Clock;
use touchup_sim::SimArm;

/// Delay after which the pace restarts instead of catching up.
const LATE: Duration = Duration::from_millis(100);

/// A simulated arm that returns states at their due times.
pub struct PacedArm<'a> {
    clock: Clock,
    arm: SimArm<'a>,
    due: Instant,
}

impl<'a> PacedArm<'a> {
    /// Starts now.
    pub fn new(clock: Clock, arm: SimArm<'a>) -> Self {
        Self {
            arm,
            due: clock.now(),
            clock,
        }
    }
}

impl Arm for PacedArm<'_> {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        self.due += Duration::from_secs_f64(self.arm.period());
        let now = self.clock.now();
        if now > self.due + LATE {
            self.due = now;
        }
        self.clock.sleep(self.due.saturating_duration_since(now));
        self.arm.next_state()
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        self.arm.command(command)
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        let before = self.arm.time();
        let zeroed = self.arm.zero_sensor();
        self.due += Duration::from_secs_f64(self.arm.time() - before);
        zeroed
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        self.arm.recover()
    }

    fn period(&self) -> f64 {
        self.arm.period()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use touchup_sim::{ArmParams, Plate};

    /// It obeys each order as the arm does without a clock.
    #[test]
    fn every_order_reaches_the_arm() {
        let (clock, _hand) = Clock::lock_step();
        let (plate, params) = (Plate::default(), ArmParams::default());
        let start = params.pose_bo * Isometry3::translation(30e-3, 25e-3, 52e-3);
        let arm = || SimArm::new(&plate, params.clone(), &start).unwrap();
        let (mut paced, mut free) = (PacedArm::new(clock, arm()), arm());
        for order in 0..500 {
            // a lost order would leave the arm on another path
            let linear = Vector3::new(
                0.02 * f64::from(order).sin(),
                0.02 * f64::from(order).cos(),
                0.01,
            );
            let command = Command::Velocity {
                linear,
                acceleration: 2.0,
            };
            paced.command(&command).unwrap();
            free.command(&command).unwrap();
            assert_eq!(
                paced.next_state().unwrap(),
                free.next_state().unwrap(),
                "order {order}"
            );
        }
        let stop = Command::Stop { deceleration: 2.0 };
        paced.command(&stop).unwrap();
        free.command(&stop).unwrap();
        (0..100).for_each(|_| assert_eq!(paced.next_state().unwrap(), free.next_state().unwrap()));
    }

    #[test]
    fn states_come_when_they_are_due_and_late_ones_at_once_up_to_100_ms() {
        let (clock, hand) = Clock::lock_step();
        let (plate, params) = (Plate::default(), ArmParams::default());
        let start = params.pose_bo * Isometry3::translation(30e-3, 25e-3, 52e-3);
        let mut paced = PacedArm::new(
            clock.clone(),
            SimArm::new(&plate, params.clone(), &start).unwrap(),
        );
        let (begun, period) = (clock.now(), Duration::from_secs_f64(paced.period()));
        let mut next_at = || {
            paced.next_state().unwrap();
            clock.since(begun)
        };
        (1..=50u32).for_each(|k| assert_eq!(next_at(), k * period));
        // ten late states come at once, then the original pace continues
        hand.advance(10 * period);
        (51..=60).for_each(|_| assert_eq!(next_at(), 60 * period));
        assert_eq!(next_at(), 61 * period);
        // late enough for a restart of the pace
        let late = LATE + 2 * period;
        hand.advance(late);
        (0..2u32).for_each(|k| assert_eq!(next_at(), 61 * period + late + k * period));
    }
}
