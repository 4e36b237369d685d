//! A UR behind the trait [`Arm`]: commands become velocities, and reports become states.
//!
//! Every motion, lines included, is a velocity resent with each state (`speedL`): v = min(v_max,
//! √(2 η a d), d/T) towards the end, at distance d. So there is one kind of motion, no thread of
//! the controller's program to end before the next motion, and an arm that receives no orders has
//! nothing left to finish.

use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};

use super::client::Client;
use super::dashboard::Dashboard;
use super::error::UrError;
use super::guard::Halt;
use super::lateness::StartLateness;
use super::params::UrParams;
use super::priority;
use super::probe::probe;
use super::protocol::{OrderAction, PERIOD, UrState, pose_of, vector_of};
use touchup_method::stylus::Wrench;
use touchup_probing::arm::{
    Arm, ArmError, ArmState, Command, Freshness, Safety, SpeedReduction, velocity_towards,
};

/// Number of states at the start from which the rate is measured.
const RATED: usize = 5;
/// Maximum ratio of the least time between two states to the nominal period.
const SAME_PERIOD: f64 = 1.5;
/// Factor from `actual_TCP_force` to the force of the part on the tip, and likewise for
/// `ft_raw_wrench`. An assumption, not yet verified on a robot: docs/ur.md has the check.
const FORCE_SIGN: f64 = 1.0;
/// Time constant of the end of a line, s: four times the latency from a state to the motion that
/// answers it.
const SETTLING_TIME: f64 = 60e-3;
/// Acceleration of the feed while pressing, m/s².
const FEED_ACCELERATION: f64 = 0.5;

/// A UR arm that holds a probe.
///
/// Its client lives in a process of its own. After a fault of the client the dashboard stops the
/// arm or, if that does not answer, the watchdog of the controller. Every later call returns the
/// fault, until [`Arm::recover`].
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
        // a state may be missing
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
    /// [`ArmError::Refused`] if it cannot connect.
    pub fn recovered(params: &UrParams) -> Result<Self, ArmError> {
        Self::unlock(params)?;
        Self::connect(params).map_err(|error| ArmError::refused("to recover", error.to_string()))
    }

    /// Means by which the arm stopped at the last fault of its connection or client; `None`: no
    /// fault.
    pub fn halt(&mut self) -> Option<Halt> {
        self.client.halt()
    }

    /// Process number of the client.
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
                // the controller allows unlocking only some seconds after the stop
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
        // a stop is right at any time
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
        self.client.ask(OrderAction::Zero)?;
        self.client.forget_states();
        Ok(())
    }

    /// Always starts a new client: the program of the controller at once obeys registers left from
    /// before, and only a new client clears them first. Sets tool, payload and watchdog again. Does
    /// not zero the sensor, as the probe may still be pressed: back off, then
    /// [`touchup_probing::arm::SupervisedArm::zero`].
    fn recover(&mut self) -> Result<(), ArmError> {
        Self::unlock(&self.params)?;
        self.client
            .close("was ended for a restart, and that failed");
        *self = Self::connect(&self.params)
            .map_err(|error| ArmError::refused("to recover", error.to_string()))?;
        Ok(())
    }

    fn period(&self) -> f64 {
        PERIOD
    }

    fn slowed(&self) -> Option<SpeedReduction> {
        self.last.slowed()
    }
}

/// Arm state from a state of the controller.
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

/// Converts a command to an order.
///
/// - `last`: state that the command follows.
pub(super) fn order_of(
    command: &Command,
    last: &UrState,
    params: &UrParams,
) -> Result<OrderAction, ArmError> {
    Ok(match command.checked(params.top_speed, params.top_force)? {
        Command::Line {
            to,
            speed,
            acceleration,
        } => OrderAction::Move {
            twist: velocity_towards(
                &pose_of(last.pose),
                &to,
                [speed, acceleration],
                SETTLING_TIME,
            ),
            acceleration,
        },
        Command::Velocity {
            linear,
            acceleration,
        } => OrderAction::Move {
            twist: [linear.x, linear.y, linear.z, 0.0, 0.0, 0.0],
            acceleration,
        },
        Command::Press {
            axis,
            force,
            feed,
            speed,
        } => {
            let place = pose_of(last.pose).translation.vector;
            let across = feed - axis * feed.dot(&axis);
            OrderAction::Press {
                frame: vector_of(&Isometry3::from_parts(place.into(), frame_along(&axis))),
                force_n: force,
                speed,
                feed: across.into(),
                acceleration: FEED_ACCELERATION,
            }
        }
        Command::Stop { deceleration } => OrderAction::Stop { deceleration },
    })
}

/// An orientation in B with its z along the axis, a unit vector.
fn frame_along(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    let aside = if axis.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let across = aside.cross(axis).normalize();
    let turn = nalgebra::Matrix3::from_columns(&[axis.cross(&across) * -1.0, across, *axis]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn))
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
            let frame = frame_along(&axis);
            assert!((frame * Vector3::z() - axis).norm() < 1e-12, "{axis}");
        }
    }
}
