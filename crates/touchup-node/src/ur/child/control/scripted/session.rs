//! Touches on a plate with links between them until a fault, and the continuation after it.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::chain::{ScriptedArm, ScriptedChain};
use touchup_probing::arm::{
    Arm, ArmState, Limits, Observer, ProbeError, SupervisedArm, TouchOutcome, TouchParams,
    TouchTarget,
};
use touchup_sim::ArmParams;

/// Top of the plate, m in O.
const TOP: f64 = 12e-3;
/// Touched positions, m in O.
const PLACES: [[f64; 2]; 2] = [[45e-3, 8e-3], [8e-3, 6e-3]];
/// Speed and distance of backing off after a fault, m/s and m.
const BACK_OFF_SPEED: f64 = 10e-3;
const BACK_OFF: f64 = 8e-3;

/// Counts the states that the observer did not get.
#[derive(Default)]
pub struct MissedStateCounter {
    last_ns: Option<i64>,
    pub missing: i64,
}

impl Observer for MissedStateCounter {
    fn on_state(&mut self, state: &ArmState) {
        let periods = self
            .last_ns
            .map_or(1, |last| (state.stamp_ns - last + 1_000_000) / 2_000_000);
        self.missing += periods - 1;
        self.last_ns = Some(state.stamp_ns);
    }
}

/// An arm and its touches.
pub struct ProbingSession<'a, 'b> {
    world: &'b ScriptedChain<'a>,
    pub arm: ScriptedArm<'a, 'b>,
    pub heard: MissedStateCounter,
    pub touches: usize,
}

pub fn limits() -> Limits {
    Limits {
        lowest: Point3::new(-0.6, -0.3, 0.0),
        highest: Point3::new(-0.2, 0.2, 0.4),
        ..Limits::default()
    }
}

impl<'a, 'b> ProbingSession<'a, 'b> {
    pub fn new(world: &'b ScriptedChain<'a>, arm: ScriptedArm<'a, 'b>) -> Self {
        Self {
            world,
            arm,
            heard: MissedStateCounter::default(),
            touches: 0,
        }
    }

    /// Zeroes the sensor, and touches until some time of the model, s.
    pub fn probe(&mut self, until: f64) -> Result<(), ProbeError> {
        self.zero()?;
        while self.world.now() < until {
            self.touch()?;
        }
        Ok(())
    }

    fn zero(&mut self) -> Result<(), ProbeError> {
        SupervisedArm::new(&mut self.arm, limits(), &mut self.heard).zero()?;
        // states of that time are discarded
        self.heard.last_ns = None;
        Ok(())
    }

    /// Touches the next position; returns the surface height relative to nominal, m; `None`: no
    /// contact.
    fn touch(&mut self) -> Result<Option<f64>, ProbeError> {
        let [x, y] = PLACES[self.touches % PLACES.len()];
        let params = ArmParams::default();
        let standoff = params.pose_bo * Point3::new(x, y, TOP + 5e-3);
        let standoff_bt = Isometry3::from_parts(standoff.coords.into(), UnitQuaternion::identity());
        let target = TouchTarget {
            standoff_bt,
            direction: -Vector3::z_axis(),
            search: 8e-3,
            expected: None,
        };
        let mut watched = SupervisedArm::new(&mut self.arm, limits(), &mut self.heard);
        let record = watched.touch(&target, &TouchParams::default())?;
        self.touches += 1;
        let TouchOutcome::Contact { centre, .. } = record.outcome else {
            return Ok(None);
        };
        Ok(Some(
            params.pose_bo.inverse_transform_point(&centre).z - TOP - params.radius,
        ))
    }

    /// After a recovery: backs off, zeroes, and touches once; returns the surface error, m.
    pub fn go_on(&mut self) -> Result<Option<f64>, ProbeError> {
        self.back_off()?;
        self.zero()?;
        self.touch()
    }

    fn back_off(&mut self) -> Result<(), ProbeError> {
        let doing = "backing off";
        let state = self
            .arm
            .next_state()
            .map_err(|error| ProbeError::Arm { doing, error })?;
        let mut above = state.pose_bt;
        above.translation.vector.z += BACK_OFF;
        self.heard.last_ns = None;
        let touch = TouchParams::default();
        SupervisedArm::new(&mut self.arm, limits(), &mut self.heard).leave(
            doing,
            &above,
            BACK_OFF_SPEED,
            &touch,
        )
    }
}
