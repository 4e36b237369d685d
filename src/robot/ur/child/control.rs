//! The one thread that tells the arm what to do.
//!
//! It moves only while orders come: when they stay away it brakes, and then feeds the watchdog of the controller for as long as it
//! lives. A thread that hangs in a call feeds nothing, and the arm is stopped by that watchdog.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use super::library::Control;
use super::{ChildError, Shared, failure, leave};
use crate::robot::ur::protocol::{Begin, Link, Order, Report, What};

/// How long it waits for an order before it looks after the arm by itself.
const TURN: Duration = Duration::from_millis(5);
/// Orders that stay away for this long leave the arm to brake.
const FRESH: Duration = Duration::from_millis(60);
/// With which it brakes then, m/s².
const BRAKE: f64 = 2.0;
/// The watchdog of the controller stops the arm when nothing has come for the tenth of a second.
const WATCHDOG_HZ: f64 = 10.0;
/// At rest it is fed this often.
const FEED: Duration = Duration::from_millis(20);
/// The tip stands below this speed, m/s and rad/s; what is left a hard stop takes.
const STANDING: f64 = 1e-3;
/// From an order to the states that show what came of it, at the most.
const SETTLED: Duration = Duration::from_millis(20);
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
/// A press is said again this often, should it have been lost.
const REPEAT: Duration = Duration::from_millis(100);
/// Across the axis of a press the tip may be this far from where it should be, m and rad: what the feed and the friction make.
const ASIDE: [f64; 2] = [0.05, 0.2];
/// The tool that is read back may differ by this rounding, m and rad.
const SAME_TOOL: f64 = 1e-6;

/// What the arm is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    Resting,
    Moving,
    Pressing { frame: [f64; 6], force: f64, speed: f64 },
    Braking { deceleration: f64, since: Instant },
}

/// Owner of the control interface.
pub struct Driver<'a> {
    control: &'a Control,
    shared: &'a Shared,
    begin: &'a Begin,
    doing: Doing,
    ordered: Instant,
    fed: Instant,
    pressed: Instant,
}

impl<'a> Driver<'a> {
    pub fn new(control: &'a Control, shared: &'a Shared, begin: &'a Begin) -> Self {
        let now = Instant::now();
        Self { control, shared, begin, doing: Doing::Resting, ordered: now, fed: now, pressed: now }
    }

    /// Until the orders end.
    pub fn run(mut self, orders: &Receiver<Order>) {
        match self.prepare() {
            Ok(()) => self.shared.report(&Report::Ready),
            Err(error) => {
                self.shared.report(&failure(&error));
                leave(5)
            }
        }
        loop {
            if !self.control.is_connected() {
                self.shared.lost(Link::Control);
            }
            let order = match orders.recv_timeout(TURN) {
                Ok(order) => newest(order, orders),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(error) = self.look_after() {
                        self.failed(&error);
                    }
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => break,
            };
            self.ordered = Instant::now();
            match self.serve(&order.what) {
                Ok(()) if order.what == What::Zero => {
                    self.shared.report(&Report::Done { number: order.number });
                }
                Ok(()) => {}
                Err(error) => self.failed(&error),
            }
            self.shared.served.store(order.number, Ordering::Release);
        }
        self.end();
    }

    fn serve(&mut self, what: &What) -> Result<(), ChildError> {
        match *what {
            What::Move { twist, acceleration } => {
                self.end_press()?;
                self.doing = Doing::Moving;
                self.control.speed(twist, acceleration)
            }
            What::Press { frame, force_n, speed, feed: [x, y, z], acceleration } => {
                let doing = Doing::Pressing { frame, force: force_n, speed };
                // the axis, not the place, is what makes it another press
                let is_same = matches!(self.doing, Doing::Pressing { frame: [.., a, b, c], force, speed: most }
                    if [a, b, c] == frame[3..] && force == force_n && most == speed);
                if !is_same || self.pressed.elapsed() > REPEAT {
                    let [far, turned] = ASIDE;
                    self.control.press(frame, force_n, FIXED_FRAME, [far, far, speed, turned, turned, turned])?;
                    (self.doing, self.pressed) = (doing, Instant::now());
                    thread::sleep(CYCLES);
                }
                self.control.speed([x, y, z, 0.0, 0.0, 0.0], acceleration)
            }
            What::Stop { deceleration } => self.brake(deceleration),
            What::Zero => {
                self.rest()?;
                self.control.zero()
            }
        }
    }

    /// Everything that a newly started program does not know.
    fn prepare(&mut self) -> Result<(), ChildError> {
        let begun = Instant::now();
        while !self.control.is_running() && begun.elapsed() < UPLOAD {
            thread::sleep(TURN);
        }
        self.doing = Doing::Resting;
        let Begin { tool, mass_kg, centre_m, damping, gain, .. } = self.begin;
        self.control.set_payload(*mass_kg, *centre_m)?;
        self.control.set_tool(*tool)?;
        let found = self.control.tool()?;
        if found.iter().zip(tool).any(|(found, told)| (found - told).abs() > SAME_TOOL) {
            self.shared.report(&Report::BadTool { reason: format!("{found:?} and not {tool:?}") });
            leave(4);
        }
        self.control.set_force_mode(*damping, *gain)?;
        // last, for what is above takes its time
        self.control.set_watchdog(WATCHDOG_HZ)?;
        self.fed = Instant::now();
        Ok(())
    }

    /// What is to be done when no order comes.
    fn look_after(&mut self) -> Result<(), ChildError> {
        match self.doing {
            Doing::Resting => self.feed(),
            Doing::Braking { deceleration, .. } => self.brake(deceleration),
            Doing::Moving | Doing::Pressing { .. } if self.ordered.elapsed() > FRESH => self.brake(BRAKE),
            Doing::Moving | Doing::Pressing { .. } => Ok(()),
        }
    }

    fn feed(&mut self) -> Result<(), ChildError> {
        if self.fed.elapsed() < FEED || !self.control.is_running() {
            return Ok(());
        }
        self.fed = Instant::now();
        self.control.feed()
    }

    /// One turn of braking: the velocity goes to zero with the deceleration, and what is left by a hard stop.
    fn brake(&mut self, deceleration: f64) -> Result<(), ChildError> {
        self.end_press()?;
        if self.doing == Doing::Resting {
            return self.feed();
        }
        let since = if let Doing::Braking { since, .. } = self.doing { since } else { Instant::now() };
        self.doing = Doing::Braking { deceleration, since };
        self.control.speed([0.0; 6], deceleration)?;
        let speed = |velocity: [f64; 6]| velocity.iter().map(|part| part * part).sum::<f64>().sqrt();
        let is_standing = self.shared.latest().is_some_and(|state| speed(state.velocity) < STANDING);
        // the first states may still be those of an arm that has not begun to move
        if is_standing && since.elapsed() > SETTLED {
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

    /// Brakes until the arm stands.
    fn rest(&mut self) -> Result<(), ChildError> {
        let begun = Instant::now();
        while self.doing != Doing::Resting && begun.elapsed() < UPLOAD {
            self.brake(BRAKE)?;
            thread::sleep(TURN);
        }
        Ok(())
    }

    /// A call was refused. When the program has ended or the arm is not allowed to move, the states say so.
    fn failed(&mut self, error: &ChildError) {
        self.doing = Doing::Resting;
        let begun = Instant::now();
        while begun.elapsed() < EXCUSE {
            if !self.control.is_connected() {
                self.shared.lost(Link::Control);
            }
            if self.shared.latest().is_some_and(|state| !state.is_playing) {
                return;
            }
            thread::sleep(TURN);
        }
        self.shared.report(&failure(error));
    }

    /// Nobody gives orders any more.
    fn end(&mut self) {
        // what fails here the watchdog does
        let _ = self.rest().and_then(|()| self.control.end_program());
    }
}

/// The last of the orders that wait, or the first of them that is to be done whatever comes after it.
fn newest(mut order: Order, orders: &Receiver<Order>) -> Order {
    while order.what != What::Zero {
        match orders.try_recv() {
            Ok(next) => order = next,
            Err(_) => break,
        }
    }
    order
}
