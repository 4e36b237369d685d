//! A UR behind the trait [`Arm`]: commands become velocities, and reports become states.
//!
//! Every motion is a velocity that is sent again with each state (`speedL`), lines too: v =
//! min(v_max, √(2 η a d), d/T) towards the end, d away. So there is one kind of motion, no thread
//! of the controller's program that would have to be ended before the next one begins, and an arm
//! that hears nothing any more has nothing left to finish.

use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};

use super::client::Client;
use super::dashboard::Dashboard;
use super::error::UrError;
use super::guard::Halt;
use super::lateness::StartLateness;
use super::params::UrParams;
use super::priority;
use super::probe::probe;
use super::protocol::{Action, PERIOD, UrState, pose_of, vector_of};
use crate::probing::arm::{
    Arm, ArmError, ArmState, Command, Freshness, Safety, Slowed, velocity_towards,
};
use crate::stylus::Wrench;

/// States at the start whose rate is looked at.
const RATED: usize = 5;
/// The least time between two of them may be longer than it should be by this factor.
const SAME_PERIOD: f64 = 1.5;
/// `actual_TCP_force` times this is the force of the part on the tip, and `ft_raw_wrench` likewise.
/// An assumption, not yet verified on a robot: docs/ur.md has the check.
const FORCE_SIGN: f64 = 1.0;
/// A line comes to its end with this time constant, s: four times what passes from a state to the
/// motion that answers it.
const SETTLING_TIME: f64 = 60e-3;
/// Of the feed while pressing, m/s².
const FEED_ACCELERATION: f64 = 0.5;
/// Most that anything may ask for, m/s².
const TOP_ACCELERATION: f64 = 10.0;

/// A UR arm that holds a probe.
///
/// Its client lives in a process of its own. Whatever happens to it, the arm is stopped by the
/// dashboard, and where that does not answer by the watchdog of the controller. After such a fault
/// every call returns it, until [`Arm::recover`].
pub struct UrArm {
    params: UrParams,
    client: Client,
    last: UrState,
    freshness: Freshness,
}

impl UrArm {
    /// Connects to a controller and sets tool, payload and watchdog. Nothing moves.
    ///
    /// # Errors
    /// [`UrError`]
    pub fn connect(params: &UrParams) -> Result<Self, UrError> {
        params.check()?;
        let version = probe(&params.host, params.deadlines.dashboard)?;
        let mut dashboard = Dashboard::connect(&params.host, params.deadlines.dashboard)?;
        dashboard.check_remote()?;
        dashboard.check_power()?;
        let safety = dashboard.safety()?;
        if safety != Safety::Normal {
            return Err(UrError::Stopped(safety));
        }
        let client = Client::start(params, version, dashboard)?;
        let next = || {
            client
                .next_state(params.deadlines.connect)
                .map_err(|error| UrError::Client(error.to_string()))
        };
        let mut last = next()?;
        // one may be left out
        let mut least_s = f64::INFINITY;
        for _ in 0..RATED {
            let state = next()?;
            least_s = least_s.min(state.stamp_s - last.stamp_s);
            last = state;
        }
        if least_s > PERIOD * SAME_PERIOD {
            return Err(UrError::Rate {
                host: params.host.clone(),
                hz: 1.0 / least_s,
                needed_hz: 1.0 / PERIOD,
            });
        }
        if !client.is_lock_step {
            let late = loop {
                match client.late_at_start() {
                    Some(late) => break late,
                    None => last = next()?,
                }
            };
            let StartLateness { usual_ms, worst_ms } = late;
            if !late.is_tolerable() {
                return Err(UrError::Busy {
                    host: params.host.clone(),
                    usual_ms,
                    worst_ms,
                });
            }
            tracing::info!(usual_ms, worst_ms, "states of the arm come late by");
            if let Err(error) = priority::raise(priority::CALLER, false) {
                tracing::warn!("{}", priority::remedy(&error));
            }
        }
        if let Some(slowed) = last.slowed() {
            tracing::warn!(
                "{slowed}: links, searches and retractions take as much longer, and may end as not arrived"
            );
        }
        Ok(Self {
            params: params.clone(),
            client,
            last,
            freshness: Freshness::new(PERIOD),
        })
    }

    /// Clears the stop of an arm, as far as a call can, and connects as [`Self::connect`]. Nothing
    /// moves.
    ///
    /// # Errors
    /// [`ArmError::Stopped`] while the cause of the stop persists, [`ArmError::Lost`],
    /// [`ArmError::Refused`] where it cannot be connected.
    pub fn recovered(params: &UrParams) -> Result<Self, ArmError> {
        Self::unlock(params)?;
        Self::connect(params).map_err(|error| refused("to recover", error.to_string()))
    }

    /// How the arm was stopped at the last fault of its connection or of its client; `None`: there
    /// was none.
    pub fn halt(&mut self) -> Option<Halt> {
        self.client.halt()
    }

    /// Number of the process that speaks to the arm.
    pub fn client_id(&self) -> u32 {
        self.client.id
    }

    /// Clears the stop of the arm, as far as a call can.
    fn unlock(params: &UrParams) -> Result<(), ArmError> {
        let silent_ms = params.deadlines.dashboard.as_millis() as u64;
        let lost = |_: UrError| ArmError::Lost { silent_ms };
        let mut dashboard =
            Dashboard::connect(&params.host, params.deadlines.dashboard).map_err(lost)?;
        let clock = &params.clock;
        let begun = clock.now();
        loop {
            match dashboard.safety().map_err(lost)? {
                Safety::Normal => break,
                // the controller lets itself be unlocked some seconds after the stop, not before
                Safety::ProtectiveStop if clock.since(begun) < params.deadlines.connect => {
                    if !dashboard.unlock().map_err(lost)? {
                        clock.sleep(params.deadlines.dashboard);
                    }
                }
                safety => return Err(ArmError::Stopped { safety }),
            }
        }
        dashboard.stop().map_err(lost)
    }
}

impl Arm for UrArm {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        self.last = self.client.next_state(self.params.deadlines.connect)?;
        Ok(seen(&self.last))
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        let safety = self.last.safety();
        if safety != Safety::Normal && !matches!(command, Command::Stop { .. }) {
            return Err(ArmError::Stopped { safety });
        }
        let order = order_of(command, &self.last, &self.params)?;
        let is_stop = matches!(command, Command::Stop { .. });
        // a stop is right whenever it comes
        if is_stop
            || self
                .freshness
                .may_send(self.last.stamp_s, self.client.newest())?
        {
            self.client.order(order)?;
        }
        Ok(())
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        let safety = self.last.safety();
        if safety != Safety::Normal {
            return Err(ArmError::Stopped { safety });
        }
        self.client.ask(Action::Zero)?;
        self.client.forget_states();
        Ok(())
    }

    /// With a new client in any case: the program of the controller does at once what the registers
    /// hold from before, and only a new client clears them first. Tool, payload and watchdog are
    /// set again. The sensor is not zeroed, for the probe may still be pressed: back off, then
    /// [`crate::probing::arm::Watched::zero`].
    fn recover(&mut self) -> Result<(), ArmError> {
        Self::unlock(&self.params)?;
        self.client
            .close("was ended for a restart, and that failed");
        *self = Self::connect(&self.params)
            .map_err(|error| refused("to recover", error.to_string()))?;
        Ok(())
    }

    fn period(&self) -> f64 {
        PERIOD
    }

    fn slowed(&self) -> Option<Slowed> {
        self.last.slowed()
    }
}

fn refused(what: &'static str, reason: impl Into<String>) -> ArmError {
    ArmError::Refused {
        what,
        reason: reason.into(),
    }
}

/// What a state says of the arm.
pub(super) fn seen(state: &UrState) -> ArmState {
    let wrench = |[x, y, z, a, b, c]: [f64; 6]| Wrench {
        force: Vector3::new(x, y, z) * FORCE_SIGN,
        torque: Vector3::new(a, b, c) * FORCE_SIGN,
    };
    ArmState {
        stamp_ns: (state.stamp_s * 1e9).round() as i64,
        pose_bt: pose_of(state.pose),
        wrench_b: wrench(state.wrench),
        raw_wrench_f: wrench(state.raw_wrench),
        joints: state.joints.into(),
        safety: state.safety(),
    }
}

/// The order that a command is.
///
/// - `last`: the state that it follows.
#[expect(clippy::too_many_lines)]
pub(super) fn order_of(
    command: &Command,
    last: &UrState,
    params: &UrParams,
) -> Result<Action, ArmError> {
    match *command {
        Command::Line {
            to,
            speed,
            acceleration,
        } => {
            check(params, "a line", speed, acceleration)?;
            let is_pose = vector_of(&to).iter().all(|part| part.is_finite());
            if !is_pose {
                return Err(refused("a line", "its end is no pose"));
            }
            Ok(Action::Move {
                twist: velocity_towards(
                    &pose_of(last.pose),
                    &to,
                    [speed, acceleration],
                    SETTLING_TIME,
                ),
                acceleration,
            })
        }
        Command::Velocity {
            linear,
            acceleration,
        } => {
            check(params, "a velocity", linear.norm(), acceleration)?;
            Ok(Action::Move {
                twist: [linear.x, linear.y, linear.z, 0.0, 0.0, 0.0],
                acceleration,
            })
        }
        Command::Press {
            axis,
            force,
            feed,
            speed,
        } => {
            check(params, "a press", feed.norm().max(speed), FEED_ACCELERATION)?;
            if !(0.0..=params.top_force).contains(&force) {
                let most = params.top_force;
                return Err(refused(
                    "a press",
                    format!("{force} N is not from 0 to {most} N"),
                ));
            }
            let Some(frame) = frame_along(&axis) else {
                return Err(refused("a press", "its axis is no direction"));
            };
            let place = pose_of(last.pose).translation.vector;
            let frame = Isometry3::from_parts(place.into(), frame);
            let across = feed - axis * feed.dot(&axis);
            Ok(Action::Press {
                frame: vector_of(&frame),
                force_n: force,
                speed,
                feed: across.into(),
                acceleration: FEED_ACCELERATION,
            })
        }
        Command::Stop { deceleration } => {
            check(params, "a stop", 0.0, deceleration)?;
            Ok(Action::Stop { deceleration })
        }
    }
}

fn check(
    params: &UrParams,
    what: &'static str,
    speed: f64,
    acceleration: f64,
) -> Result<(), ArmError> {
    let most = params.top_speed;
    if !(0.0..=most).contains(&speed) {
        return Err(refused(
            what,
            format!("{speed} m/s is not from 0 to {most} m/s"),
        ));
    }
    if acceleration.is_nan() || acceleration <= 0.0 || acceleration > TOP_ACCELERATION {
        return Err(refused(
            what,
            format!("{acceleration} m/s² is not above 0 and up to {TOP_ACCELERATION} m/s²"),
        ));
    }
    Ok(())
}

/// Some orientation in B whose z is a direction; `None`: it is none.
fn frame_along(axis: &Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    let axis = axis
        .try_normalize(0.5)
        .filter(|axis| axis.iter().all(|part| part.is_finite()))?;
    let aside = if axis.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let across = aside.cross(&axis).normalize();
    let turn = nalgebra::Matrix3::from_columns(&[axis.cross(&across) * -1.0, across, axis]);
    Some(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(turn),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_of_a_press_has_its_z_along_the_axis() {
        for axis in [
            -Vector3::z(),
            Vector3::x(),
            -Vector3::y(),
            Vector3::new(0.6, 0.0, -0.8),
        ] {
            let frame = frame_along(&axis).unwrap();
            assert!((frame * Vector3::z() - axis).norm() < 1e-12, "{axis}");
        }
        assert!(frame_along(&Vector3::zeros()).is_none());
        assert!(frame_along(&Vector3::new(f64::NAN, 0.0, 1.0)).is_none());
    }
}
