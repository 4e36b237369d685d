//! The one thread that commands the arm.
//!
//! It moves only while orders come: when they stay away it brakes, and so it does when a call
//! fails. That the arm is at rest it takes from the states, and only then it feeds the watchdog of
//! the controller, for as long as it lives and sees the arm stand. A thread that hangs in a call
//! feeds nothing, and the arm is stopped by that watchdog. Once something has stopped the arm or
//! its program, no order moves it any more: that takes a new client.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::error::{ChildError, failure};
use super::library::Control;
use super::shared::ChildShared;
use crate::clock::Clock;
use crate::ur::protocol::{Action, Begin, ClientReport, Link, Order, UrState};

/// Time without an order after which it acts by itself.
const TURN: Duration = Duration::from_millis(5);
/// Orders that stay away for this long leave the arm to brake: ten of its periods.
const FRESH: Duration = Duration::from_millis(20);
/// A state that is older tells nothing of now.
const SEEN: Duration = Duration::from_millis(20);
/// With which it brakes then, m/s².
const BRAKE: f64 = 2.0;
/// The watchdog of the controller stops the arm when nothing has come for the tenth of a second.
const WATCHDOG_HZ: f64 = 10.0;
/// At rest it is fed this often.
const FEED: Duration = Duration::from_millis(20);
/// The tip counts as at rest below this speed, m/s and rad/s; what is left a hard stop takes.
const AT_REST: f64 = 1e-3;
/// An arm that is at rest and yet goes faster than this is moved by somebody else, m/s and rad/s.
const STANDS: f64 = 5e-3;
/// Longest time from an order to the states that show its effect.
const REST_TIME: Duration = Duration::from_millis(20);
/// The hard stop of `speedStop`, m/s².
const HARD: f64 = 10.0;
/// The program of the controller starts within this time of its upload.
const UPLOAD: Duration = Duration::from_secs(5);
/// A call that was refused because the program has just ended: the state that says so comes within
/// this time.
const EXCUSE: Duration = Duration::from_millis(40);
/// Force mode with a frame that stays as it is given.
const FIXED_FRAME: i32 = 2;
/// Two cycles of the controller: its program reads one command in each, and what comes sooner takes
/// the place of the one before.
const CYCLES: Duration = Duration::from_millis(4);
/// Period in which a press is repeated, in case it was lost.
const REPEAT: Duration = Duration::from_millis(100);
/// Across the axis of a press the tip may be this far from where it should be, m and rad: what the
/// feed and the friction make.
const ASIDE: [f64; 2] = [0.05, 0.2];
/// The tool that is read back may differ by this rounding, m and rad.
const SAME_TOOL: f64 = 1e-6;

/// The current motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    /// seen, not assumed
    Resting,
    Moving,
    Braking {
        deceleration: f64,
        since: Instant,
    },
}

/// Force mode, as it was asked for: whether it is there is not known when that call failed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ForceMode {
    /// turn of its frame: the axis, not the place, is what makes it another press
    turn: [f64; 3],
    force: f64,
    speed: f64,
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
    force_mode: Option<ForceMode>,
    ordered: Instant,
    fed: Instant,
    pressed: Instant,
}

impl<'a, C: Control> Driver<'a, C> {
    /// - `clock`: on which all that is kept in time is kept.
    pub fn new(control: &'a C, shared: &'a ChildShared, begin: &'a Begin, clock: Clock) -> Self {
        let now = clock.now();
        let (doing, force_mode) = (Doing::Resting, None);
        Self {
            control,
            shared,
            begin,
            clock,
            doing,
            force_mode,
            ordered: now,
            fed: now,
            pressed: now,
        }
    }

    /// Until the orders end.
    pub fn run(mut self, orders: &Receiver<Order>) -> Result<(), DriverEnd> {
        self.prepare()?;
        self.shared.is_ready.store(true, Ordering::Release);
        self.shared.report(&ClientReport::Ready);
        loop {
            self.check_connection()?;
            // how often it looks is no deadline: it looks in real time also where its clock waits
            // for it
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
        if self.control.is_connected() {
            Ok(())
        } else {
            Err(DriverEnd::Lost(Link::Control))
        }
    }

    /// Executes an order, or the action due without one.
    fn turn(&mut self, order: Option<Order>) -> Result<(), DriverEnd> {
        let Some(order) = order else {
            return self.look_after().or_else(|error| self.failed(&error));
        };
        self.ordered = self.clock.now();
        match self.serve(&order.what) {
            Ok(()) if order.what == Action::Zero => self.shared.report(&ClientReport::Done {
                number: order.number,
            }),
            Ok(()) => {}
            Err(error) => self.failed(&error)?,
        }
        self.shared.served.store(order.number, Ordering::Release);
        Ok(())
    }

    fn serve(&mut self, what: &Action) -> Result<(), ChildError> {
        match *what {
            // what was stopped is not set going again, whoever resumes it
            Action::Move { .. } | Action::Press { .. }
                if self.shared.has_halted.load(Ordering::Acquire) =>
            {
                self.brake(BRAKE)
            }
            Action::Move {
                twist,
                acceleration,
            } => {
                self.doing = Doing::Moving;
                self.end_press()?;
                self.control.speed(twist, acceleration)
            }
            Action::Press {
                frame,
                force_n,
                speed,
                feed: [x, y, z],
                acceleration,
            } => {
                let [.., a, b, c] = frame;
                let force_mode = Some(ForceMode {
                    turn: [a, b, c],
                    force: force_n,
                    speed,
                });
                self.doing = Doing::Moving;
                if self.force_mode != force_mode || self.clock.since(self.pressed) > REPEAT {
                    let [far, turned] = ASIDE;
                    self.force_mode = force_mode;
                    self.control.press(
                        frame,
                        force_n,
                        FIXED_FRAME,
                        [far, far, speed, turned, turned, turned],
                    )?;
                    self.pressed = self.clock.now();
                    self.control.wait(&self.clock, CYCLES);
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
            self.control.wait(&self.clock, TURN);
        }
        self.doing = Doing::Resting;
        let found = self.set_up().map_err(DriverEnd::NotReady)?;
        let tool = &self.begin.tool;
        if found
            .iter()
            .zip(tool)
            .any(|(found, set)| (found - set).abs() > SAME_TOOL)
        {
            return Err(DriverEnd::BadTool(format!("{found:?} and not {tool:?}")));
        }
        // last, for what is above takes its time
        self.control
            .set_watchdog(WATCHDOG_HZ)
            .map_err(DriverEnd::NotReady)?;
        self.fed = self.clock.now();
        Ok(())
    }

    /// Returns the TCP as read back.
    fn set_up(&self) -> Result<[f64; 6], ChildError> {
        let Begin {
            tool,
            mass_kg,
            centre_m,
            damping,
            gain,
            ..
        } = self.begin;
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
            Doing::Moving if self.clock.since(self.ordered) > FRESH => self.brake(BRAKE),
            Doing::Moving => Ok(()),
        }
    }

    /// The last state, when it is of now.
    fn seen(&self) -> Option<UrState> {
        self.shared
            .latest()
            .filter(|latest| self.clock.since(latest.at) <= SEEN)
            .map(|latest| latest.state)
    }

    /// Nothing is fed that was not just seen to stand, at our command.
    fn feed(&mut self) -> Result<(), ChildError> {
        let stands = self
            .seen()
            .is_some_and(|state| state.may_move() && state.speed() < STANDS);
        if !stands || self.shared.has_halted.load(Ordering::Acquire) || !self.control.is_running() {
            return Ok(());
        }
        self.fed = self.clock.now();
        self.control.feed()
    }

    /// One turn of braking: the velocity goes to zero with the deceleration, and what is left by a
    /// hard stop. At rest the controller hears that there was an order.
    fn brake(&mut self, deceleration: f64) -> Result<(), ChildError> {
        if self.doing == Doing::Resting && self.force_mode.is_none() {
            return self.feed();
        }
        let since = if let Doing::Braking { since, .. } = self.doing {
            since
        } else {
            self.clock.now()
        };
        // before any call: one that fails leaves it braking
        self.doing = Doing::Braking {
            deceleration,
            since,
        };
        let state = self.seen();
        // a program that is paused hears nothing; the arm is braked as soon as it is resumed
        if state.is_some_and(|state| !state.is_playing()) {
            // where it is resumed its first states are those of an arm that does not move yet
            self.doing = Doing::Braking {
                deceleration,
                since: self.clock.now(),
            };
            return Ok(());
        }
        self.end_press()?;
        self.control.speed([0.0; 6], deceleration)?;
        let is_at_rest = state.is_some_and(|state| state.speed() < AT_REST);
        // the first states may still be those of an arm that has not begun to move
        if is_at_rest && self.clock.since(since) > REST_TIME {
            self.control.hard_stop(HARD)?;
            self.doing = Doing::Resting;
        }
        Ok(())
    }

    /// The feed is stopped first: the thread that drives it outlives the end of force mode.
    fn end_press(&mut self) -> Result<(), ChildError> {
        if self.force_mode.is_some() {
            self.control.hard_stop(HARD)?;
            self.control.end_press()?;
            self.force_mode = None;
        }
        Ok(())
    }

    /// Brakes until the arm is at rest.
    fn rest(&mut self) -> Result<(), ChildError> {
        let begun = self.clock.now();
        while self.doing != Doing::Resting && self.clock.since(begun) < UPLOAD {
            self.brake(BRAKE)?;
            self.control.wait(&self.clock, TURN);
        }
        if self.doing == Doing::Resting {
            Ok(())
        } else {
            Err(ChildError::Moves { after: UPLOAD })
        }
    }

    /// A call was refused. When the program has ended or the arm is not allowed to move, the states
    /// say so; and the arm may still do what it was ordered before, so it is braked until it is
    /// seen at rest.
    fn failed(&mut self, error: &ChildError) -> Result<(), DriverEnd> {
        let begun = self.clock.now();
        if self.doing == Doing::Moving {
            self.doing = Doing::Braking {
                deceleration: BRAKE,
                since: begun,
            };
        }
        while self.clock.since(begun) < EXCUSE {
            self.check_connection()?;
            if self
                .shared
                .latest()
                .is_some_and(|latest| !latest.state.may_move())
            {
                return Ok(());
            }
            self.control.wait(&self.clock, TURN);
        }
        self.shared.report(&failure(error));
        Ok(())
    }

    /// Orders have ended.
    fn end(&mut self) {
        // what fails here the watchdog does
        let _ = self.rest();
        let _ = self.control.end_program();
    }
}

/// The last of the orders that wait, or the first of them that is to be done whatever comes after
/// it.
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
mod scripted;
#[cfg(test)]
mod tests;
