//! Contact wrench on the tip, from the measured wrench.
//!
//! A sensor measures the contact, the weight of its payload, and its own bias:
//!
//! f_S = R_OSᵀ · (F + m g) + b_S,   τ_S likewise, about So
//!
//! The contact force is therefore F = R_OS · (f_S − b_S) − m g (paper, Eq 14, with weight and
//! bias), and about the centre of the ball To the torque is τ_T = τ_S + p_TS × F.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{Sample, SettingError, Wrench};
use crate::parameters;

/// Axes of the measured wrench. Its torque is about the sensor's origin So in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WrenchFrame {
    /// The sensor's own axes: the force turns with the stylus (Eq 14).
    #[default]
    Sensor,
    /// The axes of O: the driver has rotated the wrench already.
    Object,
}

parameters! {
    /// The payload beyond the measuring plane of the sensor.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Payload in "compensation.payload" {
        /// Mass of the payload.
        ///
        /// In kg.
        mass: f64 = 0.0, "mass_kg" [KG, 0, 1000];
        /// Centre of mass of the payload from the origin of the sensor, in the axes of the sensor.
        ///
        /// C from So, expressed in S, m.
        p_sc: Vector3<f64> = [0.0; 3], "centre_mm" [MM, -10000, 10000];
        /// Acceleration of gravity, in gravity_axes.
        ///
        /// Expressed in O, m/s²: (0, 0, −9.81) when z of O points up.
        gravity_o: Vector3<f64> = [0.0, 0.0, -9.81], "gravity_m_per_s2" [M_PER_S2, -100, 100];
    }
}

parameters! {
    /// Mount of the sensor on the stylus.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SensorMount in "compensation" {
        /// Origin of the sensor from the centre of the ball, in the axes of the tip (z: along the
        /// shaft, tip to handle).
        ///
        /// So from To, expressed in T, m.
        position: Vector3<f64> = [0.0; 3], "sensor_position_mm" [MM, -1e5, 1e5];
        /// Orientation of the sensor in the frame of the tip, as a quaternion x, y, z, w; left out:
        /// the axes of the tip.
        orientation_xyzw: Option<[f64; 4]> = None, "sensor_orientation_xyzw" [QUATERNION, 0.999, 1.001] like "[0, 0, 0, 1]";
    }
}

parameters! {
    /// Sensor reading without contact and payload, expressed in S.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SensorBias in "compensation.bias" {
        /// Force of the bias, in the axes of the sensor.
        ///
        /// In N.
        force: Vector3<f64> = [0.0; 3], "force_n" [N, -10000, 10000];
        /// Torque of the bias, in the axes of the sensor.
        ///
        /// In N·m.
        torque: Vector3<f64> = [0.0; 3], "torque_nm" [NM, -10000, 10000];
    }
}

impl Payload {
    /// Weight of the payload in the measurement, in the axes of O.
    ///
    /// f = m g,   τ = (R_OS · p_SC) × f
    ///
    /// - `r_os`: orientation of the sensor frame S in O.
    /// - returns: wrench about So, expressed in O; N and N·m.
    pub fn weight_o(&self, r_os: &UnitQuaternion<f64>) -> Wrench {
        let force = self.gravity_o * self.mass;
        Wrench {
            force,
            torque: (r_os * self.p_sc).cross(&force),
        }
    }
}

/// Mount and payload of the sensor. The default is a sensor in the tip's axes without payload.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensatorParams {
    /// Axes of the incoming wrench.
    pub wrench_frame: WrenchFrame,
    /// Pose of S in T: orientation of the sensor, and its origin from the centre of the ball, m.
    pub pose_ts: Isometry3<f64>,
    /// The payload of the sensor; `None` if the driver subtracts it already.
    pub payload: Option<Payload>,
    /// Sensor reading without contact and payload, expressed in S.
    pub bias_s: Option<Wrench>,
}

/// The tip at one instant: its pose and the action of the object on it.
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

/// Removes weight, bias and lever arm from each sample. An absent part costs nothing.
#[derive(Clone, Copy, Debug)]
pub struct Compensator {
    params: CompensatorParams,
}

impl Compensator {
    /// Checks the settings once.
    ///
    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn new(params: CompensatorParams) -> Result<Self, SettingError> {
        for c in &params.pose_ts.rotation.coords {
            SettingError::check("compensation.sensor_orientation_xyzw", *c, true, "finite")?;
        }
        SensorMount {
            position: params.pose_ts.translation.vector,
            orientation_xyzw: None,
        }
        .check()?;
        params.payload.iter().try_for_each(Payload::check)?;
        let bias = params
            .bias_s
            .map(|Wrench { force, torque }| SensorBias { force, torque });
        bias.iter().try_for_each(SensorBias::check)?;
        Ok(Self { params })
    }

    /// Action of the object on the tip.
    #[inline]
    pub fn compensate(&self, sample: &Sample) -> Tip {
        let CompensatorParams {
            wrench_frame,
            pose_ts,
            payload,
            bias_s,
        } = &self.params;
        let r_ot = &sample.pose_ot.rotation;
        let r_os = r_ot * pose_ts.rotation;
        let mut measured = match wrench_frame {
            WrenchFrame::Sensor => sample.wrench.turned(&r_os),
            WrenchFrame::Object => sample.wrench,
        };
        for part in [
            bias_s.map(|bias| bias.turned(&r_os)),
            payload.map(|p| p.weight_o(&r_os)),
        ]
        .into_iter()
        .flatten()
        {
            measured.force -= part.force;
            measured.torque -= part.torque;
        }
        let p_ts_o = r_ot * pose_ts.translation.vector;
        let torque_o = measured.torque + p_ts_o.cross(&measured.force);
        Tip {
            stamp_ns: sample.stamp_ns,
            pose_ot: sample.pose_ot,
            force_o: measured.force,
            torque_o,
        }
    }
}
