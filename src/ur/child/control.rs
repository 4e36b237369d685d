//! The one thread that commands the arm.
//!
//! It moves only while orders come: when they stay away it brakes, and then feeds the watchdog of the controller for as long as it
//! lives. A thread that hangs in a call feeds nothing, and the arm is stopped by that watchdog.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::error::{ChildError, failure};
use super::library::Control;
use super::shared::ChildShared;
use crate::clock::Clock;
use crate::ur::protocol::{Action, Begin, ClientReport, Link, Order};

/// Time without an order after which it acts by itself.
const TURN: Duration = Duration::from_millis(5);
/// Orders that stay away for this long leave the arm to brake.
const FRESH: Duration = Duration::from_millis(60);
/// With which it brakes then, m/s².
const BRAKE: f64 = 2.0;
/// The watchdog of the controller stops the arm when nothing has come for the tenth of a second.
const WATCHDOG_HZ: f64 = 10.0;
/// At rest it is fed this often.
const FEED: Duration = Duration::from_millis(20);
/// The tip counts as at rest below this speed, m/s and rad/s; what is left a hard stop takes.
const AT_REST: f64 = 1e-3;
/// Longest time from an order to the states that show its effect.
const REST_TIME: Duration = Duration::from_millis(20);
/// The hard stop of `speedStop`, m/s².
const HARD: f64 = 10.0;
/// The program of the controller starts within this time of its upload.
const UPLOAD: Duration = Duration::from_secs(5);
/// A call that was refused because the program has just ended: the state that says so comes within this time.
const EXCUSE: Duration = Duration::from_millis(40);
/// Force mode with a frame that stays as it is given.
const FIXED_FRAME: i32 = 2;
/// Two cycles of the controller: its program reads one command in each, and what comes sooner takes the place of the one before.
const CYCLES: Duration = Duration::from_millis(4);
/// Period in which a press is repeated, in case it was lost.
const REPEAT: Duration = Duration::from_millis(100);
/// Across the axis of a press the tip may be this far from where it should be, m and rad: what the feed and the friction make.
const ASIDE: [f64; 2] = [0.05, 0.2];
/// The tool that is read back may differ by this rounding, m and rad.
const SAME_TOOL: f64 = 1e-6;

/// The current motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    Resting,
    Moving,
    Pressing { frame: [f64; 6], force: f64, speed: f64 },
    Braking { deceleration: f64, since: Instant },
}

/// Why a driver ends before its orders do.
#[derive(Debug)]
pub enum DriverEnd {
    Lost(Link),
    NotReady(ChildError),
    BadTool(String),
}

/// Owner of the control interface.
pub struct Driver<'a, C> {
    control: &'a C,
    shared: &'a ChildShared,
    begin: &'a Begin,
    clock: Clock,
    doing: Doing,
    ordered: Instant,
    fed: Instant,
    pressed: Instant,
}

impl<'a, C: Control> Driver<'a, C> {
    /// - `clock`: on which all that is kept in time is kept.
    pub fn new(control: &'a C, shared: &'a ChildShared, begin: &'a Begin, clock: Clock) -> Self {
        let now = clock.now();
        Self { control, shared, begin, clock, doing: Doing::Resting, ordered: now, fed: now, pressed: now }
    }

    /// Until the orders end.
    pub fn run(mut self, orders: &Receiver<Order>) -> Result<(), DriverEnd> {
        self.prepare()?;
        self.shared.report(&ClientReport::Ready);
        loop {
            self.check_connection()?;
            // how often it looks is no deadline: it looks in real time also where its clock waits for it
            match orders.recv_timeout(TURN) {
                Ok(order) => self.turn(Some(newest(order, orders)))?,
                Err(RecvTimeoutError::Timeout) => self.turn(None)?,
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        self.end();
        Ok(())
    }

    fn check_connection(&self) -> Result<(), DriverEnd> {
        if self.control.is_connected() { Ok(()) } else { Err(DriverEnd::Lost(Link::Control)) }
    }

    /// Executes an order, or the action due without one.
    fn turn(&mut self, order: Option<Order>) -> Result<(), DriverEnd> {
        let Some(order) = order else {
            return self.look_after().or_else(|error| self.failed(&error));
        };
        self.ordered = self.clock.now();
        match self.serve(&order.what) {
            Ok(()) if order.what == Action::Zero => self.shared.report(&ClientReport::Done { number: order.number }),
            Ok(()) => {}
            Err(error) => self.failed(&error)?,
        }
        self.shared.served.store(order.number, Ordering::Release);
        Ok(())
    }

    fn serve(&mut self, what: &Action) -> Result<(), ChildError> {
        match *what {
            Action::Move { twist, acceleration } => {
                self.end_press()?;
                self.doing = Doing::Moving;
                self.control.speed(twist, acceleration)
            }
            Action::Press { frame, force_n, speed, feed: [x, y, z], acceleration } => {
                let doing = Doing::Pressing { frame, force: force_n, speed };
                // the axis, not the place, is what makes it another press
                let is_same = matches!(self.doing, Doing::Pressing { frame: [.., a, b, c], force, speed: most }
                    if [a, b, c] == frame[3..] && force == force_n && most == speed);
                if !is_same || self.clock.since(self.pressed) > REPEAT {
                    let [far, turned] = ASIDE;
                    self.control.press(frame, force_n, FIXED_FRAME, [far, far, speed, turned, turned, turned])?;
                    (self.doing, self.pressed) = (doing, self.clock.now());
                    self.clock.sleep(CYCLES);
                }
                self.control.speed([x, y, z, 0.0, 0.0, 0.0], acceleration)
            }
            Action::Stop { deceleration } => self.brake(deceleration),
            Action::Zero => {
                self.rest()?;
                self.control.zero()
            }
        }
    }

    /// Everything that a newly started program does not know.
    fn prepare(&mut self) -> Result<(), DriverEnd> {
        let begun = self.clock.now();
        while !self.control.is_running() && self.clock.since(begun) < UPLOAD {
            self.clock.sleep(TURN);
        }
        self.doing = Doing::Resting;
        let found = self.set_up().map_err(DriverEnd::NotReady)?;
        let tool = &self.begin.tool;
        if found.iter().zip(tool).any(|(found, set)| (found - set).abs() > SAME_TOOL) {
            return Err(DriverEnd::BadTool(format!("{found:?} and not {tool:?}")));
        }
        // last, for what is above takes its time
        self.control.set_watchdog(WATCHDOG_HZ).map_err(DriverEnd::NotReady)?;
        self.fed = self.clock.now();
        Ok(())
    }

    /// Returns the TCP as read back.
    fn set_up(&self) -> Result<[f64; 6], ChildError> {
        let Begin { tool, mass_kg, centre_m, damping, gain, .. } = self.begin;
        self.control.set_payload(*mass_kg, *centre_m)?;
        self.control.set_tool(*tool)?;
        let found = self.control.tool()?;
        self.control.set_force_mode(*damping, *gain)?;
        Ok(found)
    }

    /// The action without an order.
    fn look_after(&mut self) -> Result<(), ChildError> {
        match self.doing {
            Doing::Resting if self.clock.since(self.fed) >= FEED => self.feed(),
            Doing::Resting => Ok(()),
            Doing::Braking { deceleration, .. } => self.brake(deceleration),
            Doing::Moving | Doing::Pressing { .. } if self.clock.since(self.ordered) > FRESH => self.brake(BRAKE),
            Doing::Moving | Doing::Pressing { .. } => Ok(()),
        }
    }

    fn feed(&mut self) -> Result<(), ChildError> {
        if !self.control.is_running() {
            return Ok(());
        }
        self.fed = self.clock.now();
        self.control.feed()
    }

    /// One turn of braking: the velocity goes to zero with the deceleration, and what is left by a hard stop. At rest the controller
    /// hears that there was an order.
    fn brake(&mut self, deceleration: f64) -> Result<(), ChildError> {
        self.end_press()?;
        if self.doing == Doing::Resting {
            return self.feed();
        }
        let since = if let Doing::Braking { since, .. } = self.doing { since } else { self.clock.now() };
        self.doing = Doing::Braking { deceleration, since };
        self.control.speed([0.0; 6], deceleration)?;
        let speed = |velocity: [f64; 6]| velocity.iter().map(|part| part * part).sum::<f64>().sqrt();
        let is_at_rest = self.shared.latest().is_some_and(|state| speed(state.velocity) < AT_REST);
        // the first states may still be those of an arm that has not begun to move
        if is_at_rest && self.clock.since(since) > REST_TIME {
            self.control.hard_stop(HARD)?;
            self.doing = Doing::Resting;
        }
        Ok(())
    }

    /// The feed is stopped first: the thread that drives it outlives the end of force mode.
    fn end_press(&mut self) -> Result<(), ChildError> {
        if matches!(self.doing, Doing::Pressing { .. }) {
            self.control.hard_stop(HARD)?;
            self.control.end_press()?;
            self.doing = Doing::Resting;
        }
        Ok(())
    }

    /// Brakes until the arm is at rest.
    fn rest(&mut self) -> Result<(), ChildError> {
        let begun = self.clock.now();
        while self.doing != Doing::Resting && self.clock.since(begun) < UPLOAD {
            self.brake(BRAKE)?;
            self.clock.sleep(TURN);
        }
        Ok(())
    }

    /// A call was refused. When the program has ended or the arm is not allowed to move, the states say so.
    fn failed(&mut self, error: &ChildError) -> Result<(), DriverEnd> {
        self.doing = Doing::Resting;
        let begun = self.clock.now();
        while self.clock.since(begun) < EXCUSE {
            self.check_connection()?;
            if self.shared.latest().is_some_and(|state| !state.is_playing) {
                return Ok(());
            }
            self.clock.sleep(TURN);
        }
        self.shared.report(&failure(error));
        Ok(())
    }

    /// Orders have ended.
    fn end(&mut self) {
        // what fails here the watchdog does
        let _ = self.rest().and_then(|()| self.control.end_program());
    }
}

/// The last of the orders that wait, or the first of them that is to be done whatever comes after it.
fn newest(mut order: Order, orders: &Receiver<Order>) -> Order {
    while order.what != Action::Zero {
        match orders.try_recv() {
            Ok(next) => order = next,
            Err(_) => break,
        }
    }
    order
}

#[cfg(test)]
mod tests;
