//! The one thread that commands the arm.
//!
//! It moves the arm only while orders come, and brakes when they stop or a call fails. It concludes
//! rest from the states, and only then feeds the watchdog of the controller, for as long as it
//! lives and sees the arm stand. A thread that hangs in a call feeds nothing, and that watchdog
//! stops the arm. Once something has stopped the arm or its program, no order moves it: that takes
//! a new client.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::error::{ChildError, failure};
use super::library::Control;
use super::shared::ChildShared;
use crate::ur::protocol::{Begin, ClientReport, Order, OrderAction, RtdeConnection, UrState};
use touchup_session::clock::Clock;

/// Time without an order after which the thread acts by itself.
const TURN: Duration = Duration::from_millis(5);
/// Time without orders after which the arm brakes: ten of its periods.
const FRESH: Duration = Duration::from_millis(20);
/// Maximum age of a usable state.
const SEEN: Duration = Duration::from_millis(20);
/// Deceleration of braking without orders, m/s².
const BRAKE: f64 = 2.0;
/// Minimum rate of the watchdog: the controller stops the arm after a tenth of a second of silence.
const WATCHDOG_HZ: f64 = 10.0;
/// Period of feeding the watchdog at rest.
const FEED: Duration = Duration::from_millis(20);
/// Maximum speed of a tip at rest, m/s and rad/s; a hard stop takes the remainder.
const AT_REST: f64 = 1e-3;
/// Speed above which somebody else moves an arm that should be at rest, m/s and rad/s.
const STANDS: f64 = 5e-3;
/// Longest time from an order to the states that show its effect.
const REST_TIME: Duration = Duration::from_millis(20);
/// Deceleration of the hard stop, `speedStop`, m/s².
const HARD: f64 = 10.0;
/// Maximum time from the upload of the program to its start.
const UPLOAD: Duration = Duration::from_secs(5);
/// Time in which a state explains a refused call by the end of the program.
const EXCUSE: Duration = Duration::from_millis(40);
/// Type of force mode with a fixed frame.
const FIXED_FRAME: i32 = 2;
/// Two cycles of the controller: its program reads one command in each, and a second command before
/// that overwrites the first.
const CYCLES: Duration = Duration::from_millis(4);
/// Period in which a press is repeated, in case it was lost.
const REPEAT: Duration = Duration::from_millis(100);
/// Maximum deviation of the tip across the axis of a press, m and rad, from feed and friction.
const ASIDE: [f64; 2] = [0.05, 0.2];
/// Rounding tolerance of the tool read back, m and rad.
const SAME_TOOL: f64 = 1e-6;

/// The current motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MotionPhase {
    /// from the states, not assumed
    Resting,
    Moving,
    Braking {
        deceleration: f64,
        since: Instant,
    },
}

/// Force mode as requested; after a failed call its actual state is unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ForceMode {
    /// rotation of its frame: another axis, not another position, makes another press
    turn: [f64; 3],
    force: f64,
    speed: f64,
}

/// Reason why a driver ends before its orders.
#[derive(Debug)]
pub enum DriverEnd {
    Lost(RtdeConnection),
    NotReady(ChildError),
    BadTool(String),
}

/// Owner of the control interface.
pub struct Driver<'a, C> {
    control: &'a C,
    shared: &'a ChildShared,
    begin: &'a Begin,
    clock: Clock,
    doing: MotionPhase,
    force_mode: Option<ForceMode>,
    ordered: Instant,
    fed: Instant,
    pressed: Instant,
}

impl<'a, C: Control> Driver<'a, C> {
    /// - `clock`: clock of all times and deadlines.
    pub fn new(control: &'a C, shared: &'a ChildShared, begin: &'a Begin, clock: Clock) -> Self {
        let now = clock.now();
        let (doing, force_mode) = (MotionPhase::Resting, None);
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

    /// Runs until the orders end.
    pub fn run(mut self, orders: &Receiver<Order>) -> Result<(), DriverEnd> {
        self.prepare()?;
        self.shared.is_ready.store(true, Ordering::Release);
        self.shared.report(&ClientReport::Ready);
        loop {
            self.check_connection()?;
            // the polling period is no deadline: it is real time even if the clock waits for this
            // thread
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
            Err(DriverEnd::Lost(RtdeConnection::Control))
        }
    }

    /// Executes an order, or the action due without one.
    fn turn(&mut self, order: Option<Order>) -> Result<(), DriverEnd> {
        let Some(order) = order else {
            return self.look_after().or_else(|error| self.failed(&error));
        };
        self.ordered = self.clock.now();
        match self.serve(&order.what) {
            Ok(()) if order.what == OrderAction::Zero => self.shared.report(&ClientReport::Done {
                number: order.number,
            }),
            Ok(()) => {}
            Err(error) => self.failed(&error)?,
        }
        self.shared.served.store(order.number, Ordering::Release);
        Ok(())
    }

    fn serve(&mut self, what: &OrderAction) -> Result<(), ChildError> {
        match *what {
            // a stopped motion does not restart, whoever resumes the program
            OrderAction::Move { .. } | OrderAction::Press { .. }
                if self.shared.has_halted.load(Ordering::Acquire) =>
            {
                self.brake(BRAKE)
            }
            OrderAction::Move {
                twist,
                acceleration,
            } => {
                self.doing = MotionPhase::Moving;
                self.end_press()?;
                self.control.speed(twist, acceleration)
            }
            OrderAction::Press {
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
                self.doing = MotionPhase::Moving;
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
            OrderAction::Stop { deceleration } => self.brake(deceleration),
            OrderAction::Zero => {
                self.rest()?;
                self.control.zero()
            }
        }
    }

    /// Sets everything that a newly started program lacks.
    fn prepare(&mut self) -> Result<(), DriverEnd> {
        let begun = self.clock.now();
        while !self.control.is_running() && self.clock.since(begun) < UPLOAD {
            self.control.wait(&self.clock, TURN);
        }
        self.doing = MotionPhase::Resting;
        let found = self.set_up().map_err(DriverEnd::NotReady)?;
        let tool = &self.begin.tool;
        if found
            .iter()
            .zip(tool)
            .any(|(found, set)| (found - set).abs() > SAME_TOOL)
        {
            return Err(DriverEnd::BadTool(format!("{found:?} and not {tool:?}")));
        }
        // last, as the calls above take time
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
            MotionPhase::Resting if self.clock.since(self.fed) >= FEED => self.feed(),
            MotionPhase::Resting => Ok(()),
            MotionPhase::Braking { deceleration, .. } => self.brake(deceleration),
            MotionPhase::Moving if self.clock.since(self.ordered) > FRESH => self.brake(BRAKE),
            MotionPhase::Moving => Ok(()),
        }
    }

    /// The last state, unless it is stale.
    fn seen(&self) -> Option<UrState> {
        self.shared
            .latest()
            .filter(|latest| self.clock.since(latest.at) <= SEEN)
            .map(|latest| latest.state)
    }

    /// Feeds the watchdog only if the newest state shows the arm at rest under our command.
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

    /// One turn of braking: the velocity goes to zero with the deceleration, then a hard stop takes
    /// the remainder. At rest it feeds the watchdog.
    fn brake(&mut self, deceleration: f64) -> Result<(), ChildError> {
        if self.doing == MotionPhase::Resting && self.force_mode.is_none() {
            return self.feed();
        }
        let since = if let MotionPhase::Braking { since, .. } = self.doing {
            since
        } else {
            self.clock.now()
        };
        // before any call: after a failed call it still brakes
        self.doing = MotionPhase::Braking {
            deceleration,
            since,
        };
        let state = self.seen();
        // a paused program receives nothing; braking starts as soon as it resumes
        if state.is_some_and(|state| !state.is_playing()) {
            // after resumption the first states show an arm that does not move yet
            self.doing = MotionPhase::Braking {
                deceleration,
                since: self.clock.now(),
            };
            return Ok(());
        }
        self.end_press()?;
        self.control.speed([0.0; 6], deceleration)?;
        let is_at_rest = state.is_some_and(|state| state.speed() < AT_REST);
        // the first states may still show an arm that has not begun to move
        if is_at_rest && self.clock.since(since) > REST_TIME {
            self.control.hard_stop(HARD)?;
            self.doing = MotionPhase::Resting;
        }
        Ok(())
    }

    /// Stops the feed first: its thread outlives the end of force mode.
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
        while self.doing != MotionPhase::Resting && self.clock.since(begun) < UPLOAD {
            self.brake(BRAKE)?;
            self.control.wait(&self.clock, TURN);
        }
        if self.doing == MotionPhase::Resting {
            Ok(())
        } else {
            Err(ChildError::Moves { after: UPLOAD })
        }
    }

    /// Handles a refused call. If the program has ended or the arm may not move, the states tell;
    /// the arm may still execute the previous order, so it brakes until the states show rest.
    fn failed(&mut self, error: &ChildError) -> Result<(), DriverEnd> {
        let begun = self.clock.now();
        if self.doing == MotionPhase::Moving {
            self.doing = MotionPhase::Braking {
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

    /// Ends after the last order.
    fn end(&mut self) {
        // on failure the watchdog stops the arm
        let _ = self.rest();
        let _ = self.control.end_program();
    }
}

/// The last waiting order, or the first `Zero` among them.
fn newest(mut order: Order, orders: &Receiver<Order>) -> Order {
    while order.what != OrderAction::Zero {
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
