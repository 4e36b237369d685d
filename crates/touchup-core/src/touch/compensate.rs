//! What the object does to the tip, from what the sensor feels.
//!
//! A sensor feels the contact, the weight of all that hangs on it, and its own bias:
//!
//! f_S = R_OSᵀ · (F + m g) + b_S,   τ_S likewise, about So
//!
//! The contact force is therefore F = R_OS · (f_S − b_S) − m g (paper, Eq 14, with weight and bias), and about the
//! centre of the ball To the torque is τ_T = τ_S + p_TS × F.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{Sample, SettingError, Wrench};

/// The axes in which the measured wrench is expressed. Its torque is about the sensor's origin So in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WrenchFrame {
    /// The sensor's own axes: the force turns with the stylus (Eq 14).
    #[default]
    Sensor,
    /// The axes of O: the driver has turned it already.
    Object,
}

/// What hangs on the sensor beyond its measuring plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// kg
    pub mass: f64,
    /// Centre of mass C from So, expressed in S, m.
    pub p_sc: Vector3<f64>,
    /// Acceleration of gravity, expressed in O, m/s²: (0, 0, −9.81) when z of O points up.
    pub gravity_o: Vector3<f64>,
}

impl Payload {
    /// Weight of the payload as the sensor feels it, in the axes of O.
    ///
    /// f = m g,   τ = (R_OS · p_SC) × f
    ///
    /// - `r_os`: orientation of the sensor frame S in O.
    /// - returns: wrench about So, expressed in O; N and N·m.
    pub fn weight_o(&self, r_os: &UnitQuaternion<f64>) -> Wrench {
        let force = self.gravity_o * self.mass;
        Wrench { force, torque: (r_os * self.p_sc).cross(&force) }
    }

    fn check(&self) -> Result<(), SettingError> {
        SettingError::check("payload mass (kg)", self.mass, self.mass >= 0.0, "0 or more")?;
        for x in self.p_sc.iter().chain(&self.gravity_o) {
            SettingError::check("payload centre (m) or gravity (m/s²)", *x, true, "finite")?;
        }
        Ok(())
    }
}

/// How the sensor is mounted and what it carries. The default is a sensor in the tip's axes that carries nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensatorParams {
    /// In which axes the wrench arrives.
    pub wrench_frame: WrenchFrame,
    /// Pose of S in T: orientation of the sensor, and its origin from the centre of the ball, m.
    pub pose_ts: Isometry3<f64>,
    /// What hangs on the sensor; `None` when the driver takes it off already.
    pub payload: Option<Payload>,
    /// What the sensor reads when nothing touches and nothing hangs on it, expressed in S.
    pub bias_s: Option<Wrench>,
}

/// The tip at one instant: where it is and what the object does to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    /// Pose of T in O, m.
    pub pose_ot: Isometry3<f64>,
    /// Contact force, expressed in O, N.
    pub force_o: Vector3<f64>,
    /// Contact torque about the centre of the ball, expressed in O, N·m.
    pub torque_o: Vector3<f64>,
}

/// Takes weight, bias and lever arm out of each sample. A part that is not given costs nothing.
#[derive(Clone, Copy, Debug)]
pub struct Compensator {
    params: CompensatorParams,
}

impl Compensator {
    /// Checks the settings once.
    ///
    /// # Errors
    /// [`SettingError`] for a negative mass and for anything not finite.
    pub fn new(params: CompensatorParams) -> Result<Self, SettingError> {
        for x in params.pose_ts.translation.vector.iter().chain(&params.pose_ts.rotation.coords) {
            SettingError::check("sensor pose in the tip frame (m, quaternion)", *x, true, "finite")?;
        }
        if let Some(payload) = &params.payload {
            payload.check()?;
        }
        if let Some(bias) = &params.bias_s {
            for x in bias.force.iter().chain(&bias.torque) {
                SettingError::check("bias (N, N·m)", *x, true, "finite")?;
            }
        }
        Ok(Self { params })
    }

    /// What the object does to the tip.
    #[inline]
    pub fn compensate(&self, sample: &Sample) -> Tip {
        let CompensatorParams { wrench_frame, pose_ts, payload, bias_s } = &self.params;
        let r_ot = &sample.pose_ot.rotation;
        let r_os = r_ot * pose_ts.rotation;
        let mut felt = match wrench_frame {
            WrenchFrame::Sensor => turned(&r_os, &sample.wrench),
            WrenchFrame::Object => sample.wrench,
        };
        for part in [bias_s.map(|bias| turned(&r_os, &bias)), payload.map(|p| p.weight_o(&r_os))].into_iter().flatten()
        {
            felt.force -= part.force;
            felt.torque -= part.torque;
        }
        let p_ts_o = r_ot * pose_ts.translation.vector;
        let torque_o = felt.torque + p_ts_o.cross(&felt.force);
        Tip { stamp_ns: sample.stamp_ns, pose_ot: sample.pose_ot, force_o: felt.force, torque_o }
    }
}

fn turned(rotation: &UnitQuaternion<f64>, wrench: &Wrench) -> Wrench {
    Wrench { force: rotation * wrench.force, torque: rotation * wrench.torque }
}
