//! A simulated arm in the time of a clock.

use std::time::{Duration, Instant};

use crate::clock::Clock;
use crate::robot::{Arm, ArmError, ArmState, Command};
use crate::sim::SimArm;

/// So late it begins to count anew: it does not run after the time.
const LATE: Duration = Duration::from_millis(100);

/// Hands states out when they are due.
pub struct Paced<'a> {
    clock: Clock,
    arm: SimArm<'a>,
    due: Instant,
}

impl<'a> Paced<'a> {
    /// From now on.
    pub fn new(clock: Clock, arm: SimArm<'a>) -> Self {
        Self { arm, due: clock.now(), clock }
    }
}

impl Arm for Paced<'_> {
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
