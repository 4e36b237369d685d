//! The controller as its client sees it: registers, the uploaded program, the safety system, and
//! faults.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use touchup_method::stylus::Payload;

use super::body::{Body, Force, HARD_STOP, Motion, PERIOD};
use super::record::Record;
use super::states::States;

/// From the end of an upload to the first cycle of the program, s.
const START: f64 = 20e-3;
/// Requests for a period that the clock refuses while a program plays and its client is silent.
const QUIET_LOOKS: u32 = 40;
/// The same while the arm moves and its next order may be late.
const QUIET_LOOKS_MOVING: u32 = 200;
/// Largest lead of the clock over the last word of the client, s: beyond the time at which the
/// client brakes for lack of orders, and below the time at which the watchdog stops the program.
const AHEAD: f64 = 80e-3;

/// Register of the main loop's cycle counter in the client's program, and the line that writes it.
const COUNT: usize = 19;
const COUNTS: &str = "write_output_integer_register(19, cycle)";

/// Status of the safety system.
#[derive(Clone, Copy, PartialEq)]
pub enum Safety {
    Normal,
    Protective,
    Emergency,
    /// a door is open
    Safeguard,
}

/// Faults of the connections.
#[derive(Clone, Copy, Default)]
pub struct Faults {
    /// no states go out
    pub is_silent: bool,
    /// nothing that comes in arrives
    pub is_deaf: bool,
    /// neither, and the dashboard does not answer
    pub is_unplugged: bool,
    /// the program hangs
    pub is_stuck: bool,
    /// its main loop hangs as soon as it is ready for the next command: it takes each and reads
    /// none, and its threads live
    pub is_hung: bool,
    /// periods of one cycle of its main loop, if more than one
    pub slow: u64,
    /// the thread of its motion has ended and its main loop lives: it reads commands and follows
    /// none
    pub is_tired: bool,
    /// the dashboard does not answer
    pub is_mute: bool,
    /// delay of states, s
    pub states_late: f64,
    /// so do orders, s
    pub orders_late: f64,
    /// the controller has lost its power
    pub is_dead: bool,
}

/// The interpreted part of the client's program.
#[derive(Default)]
struct Program {
    is_running: bool,
    /// nothing of it goes on, nor is anything forgotten
    is_paused: bool,
    /// s
    starts_at: Option<f64>,
    /// a finished command whose number is still in the register
    is_handled: bool,
    /// s; from `setWatchdog`
    watchdog: Option<f64>,
    force: Option<Force>,
    /// a motion that has to end before its command has: m/s² of braking
    braking: Option<f64>,
    velocity: Option<Motion>,
    /// state of the thread of `speedL`: the velocity, and the time of the next one, s; without a
    /// time, when it has reached that velocity
    speeding: Option<(Motion, Option<f64>)>,
    /// duration of one velocity, s
    speed_time: f64,
    /// cycles of its main loop; `None`: it does not count them
    count: Option<i32>,
}

/// A register that a client writes.
#[derive(Clone, Copy)]
pub enum Written {
    Int(usize, i32),
    Double(usize, f64),
}

pub struct Controller<'a> {
    pub body: Body<'a>,
    pub version: [u32; 3],
    pub safety: Safety,
    /// brakes open
    pub is_powered: bool,
    /// the panel lets others command
    pub is_remote: bool,
    pub faults: Faults,
    pub record: Record,
    pub ints_in: [i32; 48],
    pub doubles_in: [f64; 48],
    pub ints_out: [i32; 48],
    pub doubles_out: [f64; 48],
    /// when a command last came, s
    heard_at: f64,
    /// one has come since the last period
    is_heard: bool,
    /// refused requests of a silent client for a period since the last one
    quiet_looks: u32,
    /// time until which the clock runs unconditionally, s
    granted_until: f64,
    /// the connection whose inputs count
    pub owner: Option<u64>,
    /// the safety system keeps the arm slow
    pub is_reduced: bool,
    /// whether its watchdog counts while the program pauses; unknown of a real one
    pub watchdog_counts_paused: bool,
    /// periods between two states
    every: u64,
    periods: u64,
    /// not there yet: when they are, s
    coming_states: VecDeque<(f64, States)>,
    coming_orders: VecDeque<(f64, Vec<Written>)>,
    program: Program,
}

impl<'a> Controller<'a> {
    pub fn new(body: Body<'a>, version: [u32; 3], record: Record) -> Self {
        Self {
            body,
            version,
            safety: Safety::Normal,
            is_powered: true,
            is_remote: true,
            faults: Faults::default(),
            record,
            ints_in: [0; 48],
            doubles_in: [0.0; 48],
            ints_out: [0; 48],
            doubles_out: [0.0; 48],
            heard_at: 0.0,
            is_heard: false,
            quiet_looks: 0,
            granted_until: 0.0,
            owner: None,
            is_reduced: false,
            watchdog_counts_paused: false,
            every: 1,
            periods: 0,
            coming_states: VecDeque::new(),
            coming_orders: VecDeque::new(),
            program: Program::default(),
        }
    }

    pub fn is_playing(&self) -> bool {
        self.program.is_running && !self.program.is_paused
    }

    pub fn is_paused(&self) -> bool {
        self.program.is_paused
    }

    /// States come with this rate from now on, Hz.
    pub fn set_rate(&mut self, hz: f64) {
        self.every = (1.0 / (hz * PERIOD)).round().max(1.0) as u64;
    }

    /// The client has written some registers, the command last.
    pub fn write(&mut self, written: Vec<Written>) {
        if self.faults.is_deaf || self.faults.is_unplugged {
            return;
        }
        self.coming_orders
            .push_back((self.body.time + self.faults.orders_late, written));
        self.take_orders();
    }

    fn take_orders(&mut self) {
        while let Some(written) = due(&mut self.coming_orders, self.body.time) {
            for register in written {
                match register {
                    Written::Int(0, id) => self.hear(id),
                    Written::Int(at, value) => self.ints_in[at] = value,
                    Written::Double(at, value) => self.doubles_in[at] = value,
                }
            }
        }
    }

    /// The next states that have come to the client.
    pub fn sent(&mut self) -> Option<States> {
        due(&mut self.coming_states, self.body.time)
    }

    /// The client has written the register of commands.
    fn hear(&mut self, id: i32) {
        // an unread earlier command drops out
        if self.is_heard && matches!(self.ints_in[0], 6 | 10) && self.ints_in[0] != id {
            self.record
                .event(&format!("command {} is never read", self.ints_in[0]));
        }
        self.ints_in[0] = id;
        (self.heard_at, self.is_heard) = (self.body.time, true);
    }

    /// Lets some time pass unconditionally, s.
    pub fn grant(&mut self, seconds: f64) {
        self.granted_until = self.granted_until.max(self.body.time) + seconds;
    }

    /// Whether another period may pass. While a program of the client plays, one passes when the
    /// client has answered the last. During a command the client is silent, and now and then waits
    /// for another state first.
    pub fn may_tick(&mut self) -> bool {
        let id = self.ints_in[0];
        let is_at_work =
            self.program.braking.is_some() || !matches!(id, 0 | 6 | 10) && !self.program.is_handled;
        if !self.is_playing() || self.is_heard || is_at_work || self.body.time < self.granted_until
        {
            return true;
        }
        self.quiet_looks += 1;
        // with no client, or one that waits for a program that hangs, time passes all the same
        let is_in_vain = self.owner.is_none() || self.faults.is_stuck || self.faults.is_hung;
        let [linear, angular] = self.body.velocity();
        let moves = linear.norm() + angular.norm() > 0.0;
        let patience = if moves && !is_in_vain {
            QUIET_LOOKS_MOVING
        } else {
            QUIET_LOOKS
        };
        self.quiet_looks >= patience && (is_in_vain || self.body.time - self.heard_at < AHEAD)
    }

    /// One period: program, arm, states, record.
    pub fn tick(&mut self) {
        (self.is_heard, self.quiet_looks) = (false, 0);
        if self.safety == Safety::Normal && self.body.is_over_its_force() {
            self.stop_for(
                Safety::Protective,
                "force over the limit of the safety system",
            );
        }
        self.take_orders();
        self.start_program();
        if self.is_playing() {
            self.cycle();
        }
        self.body.tick();
        self.send_states();
        self.record.line(&self.body);
    }

    /// Executes the command in the registers at once, even one of an earlier program.
    fn start_program(&mut self) {
        if self
            .program
            .starts_at
            .is_some_and(|at| at <= self.body.time)
            && self.safety == Safety::Normal
        {
            self.program = Program {
                is_running: true,
                count: self.program.count,
                ..Program::default()
            };
            self.heard_at = self.body.time;
            (self.ints_out[0], self.ints_out[2]) = (1, 0);
            self.record.event("program starts");
        }
    }

    /// A program has come on the script port.
    pub fn load(&mut self, program: &str) {
        if program.contains("def rtde_control") && !self.faults.is_dead {
            self.stop_program("a new program");
            self.program.starts_at = Some(self.body.time + START);
            self.program.count = program.contains(COUNTS).then_some(0);
        }
    }

    /// Ends the program, and with it the motion.
    pub fn stop_program(&mut self, why: &str) {
        if self.program.is_running {
            self.record.event(&format!("program stops: {why}"));
        }
        self.program = Program::default();
        self.body.brake();
    }

    /// Halts the arm; the program goes on after `resume`.
    pub fn pause(&mut self, why: &str) {
        if self.is_playing() {
            self.record.event(&format!("program pauses: {why}"));
            self.program.is_paused = true;
            self.body.brake();
        }
    }

    /// Continues its threads.
    pub fn resume(&mut self) {
        if self.program.is_paused && self.safety == Safety::Normal {
            self.record.event("program resumes");
            self.program.is_paused = false;
            if !self.watchdog_counts_paused {
                self.heard_at = self.body.time;
            }
        }
    }

    /// The safety system stops the arm.
    pub fn stop_for(&mut self, safety: Safety, why: &str) {
        self.safety = safety;
        self.stop_program(why);
    }

    fn cycle(&mut self) {
        let silent = self.body.time - self.heard_at;
        if self.program.watchdog.is_some_and(|after| silent > after) {
            self.stop_program(&format!("watchdog after {:.0} ms", silent * 1e3));
            return;
        }
        if self.faults.is_stuck {
            self.ints_out[0] = 0;
            return;
        }
        if self.faults.is_hung {
            self.ints_out[0] = 1;
            return self.speed();
        }
        if let Some(deceleration) = self.program.braking {
            let [linear, angular] = self.body.velocity();
            if linear.norm() + angular.norm() > 1e-9 {
                self.body.follow(Motion::rest(deceleration), None);
                self.program.speeding = None;
                return;
            }
            self.program.braking = None;
            self.ints_out[0] = 2;
        }
        if !self.periods.is_multiple_of(self.faults.slow.max(1)) {
            return self.speed();
        }
        if let Some(count) = &mut self.program.count {
            *count += 1;
            self.ints_out[COUNT] = *count;
        }
        let id = self.ints_in[0];
        match id {
            // the motion of a realtime command goes on
            0 => {
                self.program.is_handled = false;
                self.ints_out[0] = 1;
            }
            6 | 10 => self.realtime(id),
            255 => self.stop_program("requested by the client"),
            _ if self.program.is_handled => {}
            _ => {
                self.program.is_handled = true;
                self.ints_out[0] = 2;
                if self.program.count.is_some() {
                    self.ints_out[COUNT] = -1;
                }
                self.regular(id);
            }
        }
        if self.program.is_running && self.program.braking.is_none() {
            self.speed();
        }
    }

    /// The thread that `speedL` starts: it takes a new velocity only after the one before.
    fn speed(&mut self) {
        if self.faults.is_tired {
            return self.body.follow(Motion::rest(HARD_STOP), None);
        }
        let (now, body) = (self.body.time, &mut self.body);
        let Some(wanted) = self.program.velocity else {
            if self.program.force.is_some() {
                body.follow(Motion::rest(HARD_STOP), self.program.force);
            }
            return;
        };
        let [linear, angular] = body.velocity();
        let is_done = self
            .program
            .speeding
            .is_none_or(|(motion, until)| match until {
                Some(until) => until <= now,
                None => (motion.linear - linear).norm() + (motion.angular - angular).norm() < 1e-6,
            });
        if is_done {
            let until = (self.program.speed_time > 0.0).then_some(now + self.program.speed_time);
            self.program.speeding = Some((wanted, until));
        }
        if let Some((motion, _)) = self.program.speeding {
            body.follow(motion, self.program.force);
        }
    }

    fn realtime(&mut self, id: i32) {
        self.ints_out[0] = 1;
        if id == 10 {
            let acceleration = self.doubles_in[6];
            let motion = Motion {
                linear: self.vector(0),
                angular: self.vector(3),
                acceleration,
            };
            let goes = |motion: &Motion| motion.linear.norm() + motion.angular.norm() > 0.0;
            if !goes(&motion) && self.program.velocity.as_ref().is_none_or(goes) {
                self.record
                    .event(&format!("stop requested with {acceleration} m/s²"));
            }
            self.program.speed_time = self.doubles_in[7];
            self.program.velocity = Some(motion);
            return;
        }
        let frame = UnitQuaternion::from_scaled_axis(self.vector(3));
        let selected: Vec<usize> = (0..6).filter(|i| self.ints_in[2 + i] != 0).collect();
        let [axis @ 0..3] = selected[..] else {
            self.stop_program("force mode along other than one axis is not simulated");
            return;
        };
        let (force, speed) = (self.doubles_in[6 + axis], self.doubles_in[12 + axis]);
        let along = frame * Vector3::ith(axis, force.signum());
        self.program.force = Some(Force {
            axis: along,
            force: force.abs(),
            speed,
        });
    }

    fn regular(&mut self, id: i32) {
        match id {
            // the thread of `speedL` goes on after it
            7 => (self.program.force, self.program.braking) = (None, Some(10.0)),
            15 => {
                (self.program.velocity, self.program.speeding) = (None, None);
                self.program.braking = Some(self.doubles_in[0]);
            }
            8 => self.body.zero_sensor(),
            29 => {
                let turn = UnitQuaternion::from_scaled_axis(self.vector(3));
                self.body.tcp = Isometry3::from_parts(Translation3::from(self.vector(0)), turn);
            }
            40 => {
                let (place, turn) = (
                    self.body.tcp.translation.vector,
                    self.body.tcp.rotation.scaled_axis(),
                );
                self.doubles_out[..3].copy_from_slice(place.as_slice());
                self.doubles_out[3..6].copy_from_slice(turn.as_slice());
            }
            17 => {
                let payload = Payload {
                    mass: self.doubles_in[0],
                    p_sc: self.vector(1),
                    ..self.body.configured_payload
                };
                self.body.configured_payload = payload;
                self.record.event(&format!("payload {} kg", payload.mass));
            }
            // the tuning of force mode has no model
            20 | 21 => self
                .record
                .event(&format!("set {id}: {:?}", &self.doubles_in[..4])),
            35 => self.program.watchdog = Some(1.0 / self.doubles_in[0]),
            31 => self.stop_for(Safety::Protective, "requested by the client"),
            _ => self.stop_program(&format!("command {id} is not simulated")),
        }
        if self.program.braking.is_some() {
            // done at rest
            self.ints_out[0] = 1;
        }
    }

    fn vector(&self, at: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.doubles_in[at..at + 3])
    }

    fn send_states(&mut self) {
        self.periods += 1;
        let Faults {
            is_silent,
            is_unplugged,
            is_dead,
            states_late,
            ..
        } = self.faults;
        if is_silent || is_unplugged || is_dead {
            self.coming_states.clear();
        } else if self.periods.is_multiple_of(self.every) {
            let states = States::read(self);
            self.coming_states
                .push_back((self.body.time + states_late, states));
        }
    }
}

/// The first one under way, if it is due.
fn due<T>(coming: &mut VecDeque<(f64, T)>, now: f64) -> Option<T> {
    let is_due = coming.front().is_some_and(|(at, _)| *at <= now);
    is_due
        .then(|| coming.pop_front())
        .flatten()
        .map(|(_, what)| what)
}
