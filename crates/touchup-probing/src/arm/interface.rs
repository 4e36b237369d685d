//! Interface of an arm for probing: its state at a steady rate, and a few motions that can end at
//! any moment.
//!
//! No motion blocks. The caller requests the next state, checks it, and goes on or stops; so the
//! same loop drives a simulated arm in its own time and a real one at 500 Hz, and a stop never
//! waits behind a motion in a queue.

use nalgebra::{Isometry3, Vector3};

use super::joints::Joints;
use touchup_method::stylus::{StampedPose, StampedWrench, Wrench};

/// Maximum acceleration of a command, m/s².
const TOP_ACCELERATION: f64 = 10.0;
/// Minimum length of the axis of a press, a unit vector up to rounding.
const LEAST_AXIS: f64 = 0.5;

/// State of an arm at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmState {
    /// by the controller's clock, ns
    pub stamp_ns: i64,
    /// tip of the probe in the base B, origin in the centre of its ball, for an arm that does not
    /// bend
    pub pose_bt: Isometry3<f64>,
    /// wrench of the part on the tip, in the axes of B about the centre of the ball; without weight
    pub wrench_b: Wrench,
    /// raw wrench of the arm's sensor: contact, weight and bias, in the axes of the flange F about
    /// its origin
    pub raw_wrench_f: Wrench,
    /// joint angles, rad
    pub joints: Joints,
    /// safety state: a stop and its cause
    pub safety: Safety,
}

impl ArmState {
    /// Measurement of a probe at this moment: its pose in B, and the wrench in its own axes, as its
    /// sensor would have it.
    ///
    /// - `stamp_ns`: of both.
    pub fn as_probe(&self, stamp_ns: i64) -> (StampedPose, StampedWrench) {
        let wrench = self.wrench_b.turned(&self.pose_bt.rotation.inverse());
        (
            StampedPose {
                stamp_ns,
                pose_ot: self.pose_bt,
            },
            StampedWrench { stamp_ns, wrench },
        )
    }
}

/// State of an arm's safety system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, thiserror::Error)]
pub enum Safety {
    /// The arm may move.
    #[default]
    #[error("nothing stops it")]
    Normal,
    /// The arm stopped by itself: force, speed or a plane.
    #[error("protective stop (force, speed or a safety plane): look, then recover")]
    ProtectiveStop,
    /// An operator's stop: emergency stop button, or an open door.
    #[error("stopped by the operator (button or door): release it, then recover")]
    OperatorStop,
    /// A fault that no call can clear.
    #[error("its controller reports a fault: look at its panel")]
    Fault,
}

/// A command to an arm; it replaces the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Straight to a pose of the tip in B, with a stop there.
    Line {
        /// end pose of the tip, in B
        to: Isometry3<f64>,
        /// speed, m/s
        speed: f64,
        /// acceleration, m/s²
        acceleration: f64,
    },
    /// Motion of the tip with a velocity, m/s in B, without turning, until the next command.
    Velocity {
        /// velocity, m/s in B
        linear: Vector3<f64>,
        /// acceleration, m/s²
        acceleration: f64,
    },
    /// Presses along an axis with a force and moves across it with a velocity.
    Press {
        /// unit vector in B, into the part
        axis: Vector3<f64>,
        /// force of the arm on the part, N
        force: f64,
        /// velocity across the axis, m/s in B
        feed: Vector3<f64>,
        /// largest speed along the axis, m/s
        speed: f64,
    },
    /// Brakes to a stop.
    Stop {
        /// deceleration, m/s²
        deceleration: f64,
    },
}

impl Command {
    /// This command with a unit axis, refused if an arm may not get it.
    ///
    /// - `top_speed`: of the tip, m/s; `top_force`: of a press, N.
    ///
    /// # Errors
    /// [`ArmError::Refused`] for a speed, acceleration, force, pose or axis out of range.
    pub fn checked(self, top_speed: f64, top_force: f64) -> Result<Self, ArmError> {
        let (name, speeds, acceleration) = match self {
            Self::Line {
                speed,
                acceleration,
                ..
            } => ("a line", [speed; 2], acceleration),
            Self::Velocity {
                linear,
                acceleration,
            } => ("a velocity", [linear.norm(); 2], acceleration),
            // the arm has its own acceleration of a press
            Self::Press { feed, speed, .. } => ("a press", [feed.norm(), speed], TOP_ACCELERATION),
            Self::Stop { deceleration } => ("a stop", [0.0; 2], deceleration),
        };
        let refused = |reason: String| Err(ArmError::refused(name, reason));
        // NaN is in no range
        let is_slow = |speed: &f64| (0.0..=top_speed).contains(speed);
        if let Some(speed) = speeds.iter().find(|speed| !is_slow(speed)) {
            return refused(format!("{speed} m/s is not from 0 to {top_speed} m/s"));
        }
        if acceleration == 0.0 || !(0.0..=TOP_ACCELERATION).contains(&acceleration) {
            return refused(format!(
                "{acceleration} m/s² is not above 0 and up to {TOP_ACCELERATION} m/s²"
            ));
        }
        match self {
            Self::Line { to, .. } if !is_finite(&to) => refused("its end is no pose".to_owned()),
            Self::Press { force, .. } if !(0.0..=top_force).contains(&force) => {
                refused(format!("{force} N is not from 0 to {top_force} N"))
            }
            Self::Press {
                axis,
                force,
                feed,
                speed,
            } => match axis.try_normalize(LEAST_AXIS) {
                Some(axis) if axis.iter().all(|part| part.is_finite()) => Ok(Self::Press {
                    axis,
                    force,
                    feed,
                    speed,
                }),
                _ => refused("its axis is no direction".to_owned()),
            },
            _ => Ok(self),
        }
    }
}

fn is_finite(pose: &Isometry3<f64>) -> bool {
    let (place, turn) = (&pose.translation.vector, &pose.rotation.coords);
    place.iter().chain(turn).all(|part| part.is_finite())
}

/// Causes that slow an arm below its ordered speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedReduction {
    /// setting of the speed slider, %
    pub slider_percent: f64,
    /// whether the safety system is in reduced mode
    pub is_reduced: bool,
}

impl std::fmt::Display for SpeedReduction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            slider_percent,
            is_reduced,
        } = *self;
        match (slider_percent < 100.0, is_reduced) {
            (true, false) => write!(f, "its speed slider is at {slider_percent:.0} %"),
            (true, true) => write!(
                f,
                "its speed slider is at {slider_percent:.0} % and its safety in reduced mode"
            ),
            (false, _) => write!(f, "its safety is in reduced mode"),
        }
    }
}

/// Why an arm does not execute a command.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// No states arrive from the arm.
    #[error(
        "nothing has come from the arm for {silent_ms} ms: look at its controller and at the cable"
    )]
    Lost {
        /// duration of silence, ms
        silent_ms: u64,
    },
    /// The arm has closed a connection.
    #[error(
        "the connection for {what} was closed from the arm's side: look at its controller and at the cable"
    )]
    Dropped {
        /// purpose of the connection
        what: &'static str,
    },
    /// The states come with equal stamps.
    #[error("the arm's clock is stuck: its controller has stopped")]
    Stale,
    /// The stamps go back.
    #[error(
        "the arm's clock went back by {back_ms:.0} ms: its controller has started again, or two arms answer"
    )]
    WentBack {
        /// step back, ms
        back_ms: f64,
    },
    /// The commanding program is slower than the states of the arm.
    #[error(
        "touchup is {age_ms:.0} ms behind the states of the arm and does not catch up, so the arm was left to brake: end what else runs on this machine"
    )]
    Behind {
        /// age of the state that the last order would have followed, ms
        age_ms: f64,
    },
    /// The arm may not move.
    #[error("the arm is stopped: {safety}")]
    Stopped {
        /// cause of the stop
        safety: Safety,
    },
    /// The program on the controller has ended, and no safety system says why.
    #[error(
        "the program on the arm's controller has ended, at its panel, by its watchdog or by another client: look, then recover"
    )]
    ProgramEnded,
    /// The program on the controller was paused, and then ended so that a resume moves nothing.
    #[error(
        "the program on the arm's controller was paused, at its panel or by a safeguard, and ended then, so that nothing goes on by \
         itself: look, then recover"
    )]
    ProgramPaused,
    /// The program on the controller no longer counts its cycles; other means stopped the arm.
    #[error(
        "the program on the arm's controller hangs, or another runs in its place: it has counted no cycle for {silent_ms:.0} ms, where each \
         takes {cycle_ms:.0} ms; the arm was stopped: look, then recover"
    )]
    ProgramHangs {
        /// time since its last cycle, by the stamps of the states, ms
        silent_ms: f64,
        /// cycle of the controller, ms
        cycle_ms: f64,
    },
    /// The arm does not follow its orders; other means stopped it.
    #[error(
        "the arm moves with {mm_per_s:.0} mm/s and {deg_per_s:.0}°/s where {ordered_mm_per_s:.0} mm/s are ordered: its program hangs, or \
         somebody else commands it; it was stopped: look, then recover"
    )]
    Disobeys {
        /// speed of the tip, mm/s
        mm_per_s: f64,
        /// ordered speed of the tip, mm/s
        ordered_mm_per_s: f64,
        /// turn rate of the tip, °/s
        deg_per_s: f64,
    },
    /// A topic of the arm's state is silent, or old.
    #[error(
        "{topic} brings nothing new for {silent_ms:.0} ms: is its broadcaster active (`ros2 control list_controllers`), and the network up?"
    )]
    TopicSilent {
        /// name of the topic
        topic: String,
        /// duration of silence, ms
        silent_ms: f64,
    },
    /// The stamps run faster than time.
    #[error(
        "the stamps of {topic} jumped ahead by {ahead_ms:.0} ms: its clock was set, or two senders answer"
    )]
    JumpedAhead {
        /// name of the topic
        topic: String,
        /// jump ahead, ms
        ahead_ms: f64,
    },
    /// States come later than before.
    #[error(
        "{topic} comes {late_ms:.0} ms later than it did: the network, the controller or this machine is busy"
    )]
    Late {
        /// name of the topic
        topic: String,
        /// delay, ms
        late_ms: f64,
    },
    /// A message that cannot come from this arm.
    #[error("{topic}: {reason}")]
    Unreadable {
        /// name of the topic
        topic: String,
        /// defect of the message, and remedy
        reason: String,
    },
    /// The arm stands still against its orders.
    #[error(
        "the arm has moved {moved_deg:.2}° where {ordered_deg:.2}° were ordered: is the controller of {topic} active (`ros2 control \
         list_controllers`), and does it take velocities (docs/ros2_control.md)?"
    )]
    Ignores {
        /// topic of the orders
        topic: String,
        /// ordered travel of the joints, °
        ordered_deg: f64,
        /// measured travel of the joints, °
        moved_deg: f64,
    },
    /// The arm moves on after an order to stop.
    #[error(
        "the arm still moves with {mm_per_s:.0} mm/s after it was ordered to stop ({first}), and there is no other way to stop it from \
         here: press its emergency stop, then look what else commands it"
    )]
    GoesOn {
        /// speed of the tip, mm/s
        mm_per_s: f64,
        /// reason for the order to stop
        first: String,
    },
    /// The connection to the arm has failed; other means stopped the arm.
    #[error(
        "the program that speaks to the arm {reason}; the arm was stopped without it: look, then recover"
    )]
    Client {
        /// failure of the connecting program
        reason: String,
    },
    /// The arm does not support the command.
    #[error("the arm refuses {what}: {reason}")]
    Refused {
        /// the command
        what: &'static str,
        /// reason
        reason: String,
    },
}

impl ArmError {
    /// [`Self::Refused`]
    pub fn refused(what: &'static str, reason: impl Into<String>) -> Self {
        Self::Refused {
            what,
            reason: reason.into(),
        }
    }
}

/// Refuses the parameters of an arm if one is out of its range.
///
/// - `parameters`: name, value, minimum, maximum, and unit with a space in front, if it has one.
///
/// # Errors
/// [`ArmError::Refused`]
pub fn check_parameters(
    parameters: impl IntoIterator<Item = (&'static str, f64, f64, f64, &'static str)>,
) -> Result<(), ArmError> {
    // NaN is in no range
    let wrong = parameters
        .into_iter()
        .find(|(_, value, low, high, _)| !(low..=high).contains(&value));
    wrong.map_or(Ok(()), |(what, value, low, high, unit)| {
        let reason = format!("{what} is {value}{unit}; it must be from {low} to {high}{unit}");
        Err(ArmError::refused("its parameters", reason))
    })
}

/// An arm that holds a probe.
pub trait Arm {
    /// Waits for the next state.
    ///
    /// # Errors
    /// [`ArmError::Lost`], [`ArmError::Stale`].
    fn next_state(&mut self) -> Result<ArmState, ArmError>;

    /// Begins a motion, in place of the one before.
    ///
    /// # Errors
    /// [`ArmError::Refused`], [`ArmError::Lost`].
    fn command(&mut self, command: &Command) -> Result<(), ArmError>;

    /// Zeroes the sensor. Call it at rest in free air.
    ///
    /// # Errors
    /// As [`Self::command`].
    fn zero_sensor(&mut self) -> Result<(), ArmError>;

    /// Allows motion again after a protective stop, once an operator has looked. Nothing else calls
    /// it, and it moves nothing.
    ///
    /// # Errors
    /// [`ArmError::Stopped`] while the cause of the stop persists, [`ArmError::Lost`].
    fn recover(&mut self) -> Result<(), ArmError>;

    /// Time between two states, s.
    fn period(&self) -> f64;

    /// Causes that slow the arm below its ordered speed, if it reports them.
    fn slowed(&self) -> Option<SpeedReduction> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn a_command_out_of_range_is_refused_with_its_number() {
        let (nan, z) = (f64::NAN, -Vector3::z());
        let reason = |command: Command| match command.checked(0.25, 50.0) {
            Err(ArmError::Refused { reason, .. }) => reason,
            other => format!("{other:?}"),
        };
        let velocity = |linear, acceleration| Command::Velocity {
            linear,
            acceleration,
        };
        let press = |axis, force, feed| Command::Press {
            axis,
            force,
            feed,
            speed: 0.01,
        };
        let line = |to| Command::Line {
            to,
            speed: 0.1,
            acceleration: 1.0,
        };
        let sideways = Vector3::x() * 0.01;
        for (command, words) in [
            (velocity(z, 1.0), "1 m/s is not from 0 to 0.25 m/s"),
            (velocity(z * nan, 1.0), "NaN m/s is not"),
            (velocity(z * 0.1, 0.0), "0 m/s² is not above 0"),
            (velocity(z * 0.1, 11.0), "11 m/s² is not"),
            (velocity(z * 0.1, nan), "NaN m/s² is not"),
            (Command::Stop { deceleration: -1.0 }, "-1 m/s² is not"),
            (line(Isometry3::translation(nan, 0.0, 0.0)), "its end is no"),
            (press(z, 51.0, sideways), "51 N is not from 0 to 50 N"),
            (press(z, 5.0, z), "1 m/s is not"),
            (press(z, 5.0, sideways * nan), "NaN m/s is not"),
            (press(z * 0.0, 5.0, sideways), "its axis is no direction"),
            (press(z * nan, 5.0, sideways), "its axis is no direction"),
        ] {
            assert!(reason(command).starts_with(words), "{}", reason(command));
        }
        for good in [
            line(Isometry3::identity()),
            velocity(z * 0.25, 10.0),
            press(z, 50.0, sideways),
            Command::Stop { deceleration: 10.0 },
        ] {
            assert_eq!(good.checked(0.25, 50.0), Ok(good));
        }
        let long = press(z * 2.0, 5.0, sideways).checked(0.25, 50.0);
        assert_eq!(long, Ok(press(z, 5.0, sideways)));
    }

    /// After a quarter turn about z, x of the base is −y of the probe.
    #[test]
    fn a_wrench_in_the_base_is_felt_in_the_axes_of_the_probe() {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let wrench_b = Wrench {
            force: Vector3::new(2.0, 0.0, 1.0),
            torque: Vector3::new(0.0, 0.3, 0.0),
        };
        let state = ArmState {
            stamp_ns: 4,
            pose_bt: Isometry3::from_parts(Vector3::new(0.4, 0.1, 0.2).into(), turn),
            wrench_b,
            raw_wrench_f: wrench_b,
            joints: [0.0; 6].into(),
            safety: Safety::Normal,
        };
        let (pose, wrench) = state.as_probe(9);
        assert_eq!(
            (pose.stamp_ns, pose.pose_ot, wrench.stamp_ns),
            (9, state.pose_bt, 9)
        );
        assert!(
            (wrench.wrench.force - Vector3::new(0.0, -2.0, 1.0)).norm() < 1e-15,
            "{:?}",
            wrench.wrench
        );
        assert!(
            (wrench.wrench.torque - Vector3::new(0.3, 0.0, 0.0)).norm() < 1e-15,
            "{:?}",
            wrench.wrench
        );
    }
}
