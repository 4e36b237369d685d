//! What probing needs of an arm: its state at a steady rate, and a few motions that can be broken
//! off at any moment.
//!
//! No motion blocks. The caller asks for the next state, checks it, and goes on or stops; so the
//! same loop drives a simulated arm in its own time and a real one at 500 Hz, and a stop is never
//! behind a motion in a queue.

use nalgebra::{Isometry3, Vector3};

use super::joints::Joints;
use crate::stylus::{StampedPose, StampedWrench, Wrench};

/// What an arm says of itself at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmState {
    /// of the controller's clock, ns
    pub stamp_ns: i64,
    /// of the probe's tip, origin in the centre of its ball, in the base B; of an arm that does not
    /// bend
    pub pose_bt: Isometry3<f64>,
    /// what the part does to the tip, in the axes of B about the centre of the ball; weight is off
    pub wrench_b: Wrench,
    /// what the sensor of the arm has: contact, weight and bias, in the axes of the flange F about
    /// its origin
    pub raw_wrench_f: Wrench,
    /// rad
    pub joints: Joints,
    /// whether and why it is stopped
    pub safety: Safety,
}

impl ArmState {
    /// What a probe measures at this moment: its pose in B, and the wrench in its own axes, as its
    /// sensor would have it.
    ///
    /// - `stamp_ns`: of both.
    pub fn as_probe(&self, stamp_ns: i64) -> (StampedPose, StampedWrench) {
        let turned = |v| self.pose_bt.rotation.inverse() * v;
        let wrench = Wrench {
            force: turned(self.wrench_b.force),
            torque: turned(self.wrench_b.torque),
        };
        (
            StampedPose {
                stamp_ns,
                pose_ot: self.pose_bt,
            },
            StampedWrench { stamp_ns, wrench },
        )
    }
}

/// What the safety system of an arm says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, thiserror::Error)]
pub enum Safety {
    /// It may move.
    #[default]
    #[error("nothing stops it")]
    Normal,
    /// It stopped by itself: force, speed or a plane.
    #[error("protective stop (force, speed or a safety plane): look, then recover")]
    ProtectiveStop,
    /// The emergency stop button was pressed, or a door opened.
    #[error("stopped by the operator (button or door): release it, then recover")]
    OperatorStop,
    /// A fault that takes more than a call to be cleared.
    #[error("its controller reports a fault: look at its panel")]
    Fault,
}

/// A command to an arm; each replaces the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Straight to a pose of the tip in B, and to a stop there.
    Line {
        /// where the tip is then, in B
        to: Isometry3<f64>,
        /// m/s
        speed: f64,
        /// m/s²
        acceleration: f64,
    },
    /// On and on with a velocity of the tip, m/s in B, without turning. It ends with the next
    /// command.
    Velocity {
        /// m/s in B
        linear: Vector3<f64>,
        /// m/s²
        acceleration: f64,
    },
    /// Presses along an axis with a force and goes across it with a velocity.
    Press {
        /// unit vector in B, into the part
        axis: Vector3<f64>,
        /// N, what the arm does to the part
        force: f64,
        /// across the axis, m/s in B
        feed: Vector3<f64>,
        /// largest speed along the axis, m/s
        speed: f64,
    },
    /// To a stop.
    Stop {
        /// m/s²
        deceleration: f64,
    },
}

/// What makes an arm slower than it is ordered to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slowed {
    /// of the speed slider, %
    pub slider_percent: f64,
    /// whether its safety system is in reduced mode
    pub is_reduced: bool,
}

impl std::fmt::Display for Slowed {
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
    /// No states arrive from it.
    #[error(
        "nothing has come from the arm for {silent_ms} ms: look at its controller and at the cable"
    )]
    Lost {
        /// ms
        silent_ms: u64,
    },
    /// It has closed a connection.
    #[error(
        "the connection for {what} was closed from the arm's side: look at its controller and at the cable"
    )]
    Dropped {
        /// what it was for
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
        /// ms
        back_ms: f64,
    },
    /// Who commands it is slower than its states.
    #[error(
        "touchup is {age_ms:.0} ms behind the states of the arm and does not catch up, so the arm was left to brake: end what else runs on this machine"
    )]
    Behind {
        /// of the state that the last order would have followed, ms
        age_ms: f64,
    },
    /// It is not allowed to move.
    #[error("the arm is stopped: {safety}")]
    Stopped {
        /// why
        safety: Safety,
    },
    /// What it runs for us has ended, and no safety system says why.
    #[error(
        "the program on the arm's controller has ended, at its panel, by its watchdog or by another client: look, then recover"
    )]
    ProgramEnded,
    /// What it runs for us was paused; it was ended then, so that nothing goes on when somebody
    /// resumes it.
    #[error(
        "the program on the arm's controller was paused, at its panel or by a safeguard, and ended then, so that nothing goes on by \
         itself: look, then recover"
    )]
    ProgramPaused,
    /// What it runs for us counts its cycles no more; it was stopped by other means.
    #[error(
        "the program on the arm's controller hangs, or another runs in its place: it has counted no cycle for {silent_ms:.0} ms, where each \
         takes {cycle_ms:.0} ms; the arm was stopped: look, then recover"
    )]
    ProgramHangs {
        /// since its last cycle, by the stamps of the states, ms
        silent_ms: f64,
        /// of the controller, ms
        cycle_ms: f64,
    },
    /// It does not do what it is ordered to; it was stopped by other means.
    #[error(
        "the arm moves with {mm_per_s:.0} mm/s and {deg_per_s:.0}°/s where {ordered_mm_per_s:.0} mm/s are ordered: its program hangs, or \
         somebody else commands it; it was stopped: look, then recover"
    )]
    Disobeys {
        /// of the tip, mm/s
        mm_per_s: f64,
        /// by the order, mm/s
        ordered_mm_per_s: f64,
        /// of its turning, °/s
        deg_per_s: f64,
    },
    /// One of the topics that its state comes on is silent, or old.
    #[error(
        "{topic} brings nothing new for {silent_ms:.0} ms: is its broadcaster active (`ros2 control list_controllers`), and the network up?"
    )]
    TopicSilent {
        /// its name
        topic: String,
        /// ms
        silent_ms: f64,
    },
    /// The stamps go on faster than time.
    #[error(
        "the stamps of {topic} jumped ahead by {ahead_ms:.0} ms: its clock was set, or two senders answer"
    )]
    JumpedAhead {
        /// its name
        topic: String,
        /// ms
        ahead_ms: f64,
    },
    /// States come later than they did.
    #[error(
        "{topic} comes {late_ms:.0} ms later than it did: the network, the controller or this machine is busy"
    )]
    Late {
        /// its name
        topic: String,
        /// ms
        late_ms: f64,
    },
    /// A message of the arm that cannot be its own.
    #[error("{topic}: {reason}")]
    Unreadable {
        /// its name
        topic: String,
        /// what is wrong with it, and what to do
        reason: String,
    },
    /// It stands though it is ordered to move.
    #[error(
        "the arm has moved {moved_deg:.2}° where {ordered_deg:.2}° were ordered: is the controller of {topic} active (`ros2 control \
         list_controllers`), and does it take velocities (docs/ros2_control.md)?"
    )]
    Ignores {
        /// where orders go
        topic: String,
        /// way of the joints by the orders, °
        ordered_deg: f64,
        /// way of the joints as measured, °
        moved_deg: f64,
    },
    /// It was ordered to stop and goes on.
    #[error(
        "the arm still moves with {mm_per_s:.0} mm/s after it was ordered to stop ({first}), and there is no other way to stop it from \
         here: press its emergency stop, then look what else commands it"
    )]
    GoesOn {
        /// of the tip, mm/s
        mm_per_s: f64,
        /// why it was ordered to stop
        first: String,
    },
    /// The connection to the arm has failed; the arm was stopped by other means.
    #[error(
        "the program that speaks to the arm {reason}; the arm was stopped without it: look, then recover"
    )]
    Client {
        /// what happened to it
        reason: String,
    },
    /// It does not support the command.
    #[error("the arm refuses {what}: {reason}")]
    Refused {
        /// the command
        what: &'static str,
        /// why
        reason: String,
    },
}

/// An arm that holds a probe.
pub trait Arm {
    /// Waits for the next state.
    ///
    /// # Errors
    /// [`ArmError::Lost`], [`ArmError::Stale`].
    fn next_state(&mut self) -> Result<ArmState, ArmError>;

    /// Begins a motion, instead of the one before.
    ///
    /// # Errors
    /// [`ArmError::Refused`], [`ArmError::Lost`].
    fn command(&mut self, command: &Command) -> Result<(), ArmError>;

    /// Zeroes the sensor. To be called at rest in free air.
    ///
    /// # Errors
    /// As [`Self::command`].
    fn zero_sensor(&mut self) -> Result<(), ArmError>;

    /// Lets it move again after a protective stop, once an operator has looked. Nothing else calls
    /// it, and it moves nothing.
    ///
    /// # Errors
    /// [`ArmError::Stopped`] while the cause of the stop persists, [`ArmError::Lost`].
    fn recover(&mut self) -> Result<(), ArmError>;

    /// Time between two states, s.
    fn period(&self) -> f64;

    /// What makes it slower than it is ordered to be, as far as it says so.
    fn slowed(&self) -> Option<Slowed> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    /// Turned by a quarter about z, x of the base is −y of the probe.
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
