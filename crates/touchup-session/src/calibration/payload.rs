//! Payload identification: weight, centre of mass and sensor bias, from static segments of a
//! recording, a table, or an arm.
//!
//! The controller of an arm compensates the weight of its configured payload. So the result goes to
//! its parameters: `robot.payload_kg` and `robot.payload_centre_mm`. The bias is for display only:
//! each touch begins with a zeroed sensor.

use std::fmt;
use std::path::Path;

use nalgebra::Vector3;
use serde::Serialize;
use touchup_features::calibrate::{
    PayloadFit, PayloadParams, StaticPose, StaticSegmentFinder, StaticSegmentParams, fit_payload,
};
use touchup_io::tables::static_poses::read_static_poses;
use touchup_method::stylus::WrenchFrame;
use touchup_probing::execute::{NotReached, PayloadReadings};

use super::calibrated::{Calibration, CalibrationResult};
use super::error::CalibrationError;
use super::recording::CalibrationRecording;
use super::vector::{Vector, rounded};
use crate::reported;
use crate::scene::{GravityAxes, Scene, Setting};

/// Ratio of residual to noise above which the residual has another cause.
const UNEXPLAINED: f64 = 5.0;

/// Parameters of a payload identification.
#[derive(Clone, Copy, Debug)]
pub struct PayloadCalibrationParams {
    /// Acceleration of gravity, m/s², which divides the weight. Default 9.81.
    pub gravity: f64,
    /// Axes of the wrench. Default: those that the recording names; for a table the sensor's own.
    pub wrench_frame: Option<WrenchFrame>,
}

impl Default for PayloadCalibrationParams {
    fn default() -> Self {
        Self {
            gravity: PayloadParams::default().gravity,
            wrench_frame: None,
        }
    }
}

/// Identifies the payload from a recording of the stylus held still in free air, in several
/// orientations.
///
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// [`CalibrationError`]
pub fn calibrate_payload(
    recording: CalibrationRecording,
    scene: &Scene,
    params: PayloadCalibrationParams,
    at_each: &mut dyn FnMut(),
) -> Result<Calibration<PayloadFound>, CalibrationError> {
    let path = recording.path().to_owned();
    let params = PayloadCalibrationParams {
        wrench_frame: params.wrench_frame.or(Some(recording.wrench_frame())),
        ..params
    };
    let mut finder = StaticSegmentFinder::new(StaticSegmentParams::default());
    let replayed = recording.replay(scene, at_each, |sample| finder.push(sample))?;
    let calibration = of_poses(&path, &finder.finish(), scene, params)?;
    Ok(Calibration {
        losses: replayed.losses,
        ..calibration
    })
}

/// Identifies the payload from a table of static poses ([`touchup_io::tables::static_poses`]).
///
/// # Errors
/// [`CalibrationError`]
pub fn calibrate_payload_by_table(
    path: &Path,
    scene: &Scene,
    params: PayloadCalibrationParams,
) -> Result<Calibration<PayloadFound>, CalibrationError> {
    let pose = |(r_wt, wrench)| StaticPose {
        r_wt,
        wrench,
        noise: None,
        samples: 1,
    };
    let poses: Vec<_> = read_static_poses(path)?.into_iter().map(pose).collect();
    of_poses(path, &poses, scene, params)
}

fn of_poses(
    path: &Path,
    poses: &[StaticPose],
    scene: &Scene,
    params: PayloadCalibrationParams,
) -> Result<Calibration<PayloadFound>, CalibrationError> {
    let wrench_frame = params.wrench_frame.unwrap_or_default();
    let mounted = scene.compensator_params(wrench_frame).pose_ts.rotation;
    let params = PayloadParams {
        wrench_frame,
        r_ts: mounted,
        gravity: params.gravity,
    };
    let bad = |error| CalibrationError::Payload {
        path: path.to_owned(),
        error,
    };
    let fit = fit_payload(poses, &params).map_err(bad)?;
    let besides = "is the sensor mounted as compensation.sensor_orientation_xyzw says, ";
    let doubts = doubt_of_residuals(&fit, besides).into_iter().collect();
    Ok(Calibration {
        found: PayloadFound::of(&fit, ["sensor", "poses"]),
        doubts,
        losses: Vec::new(),
    })
}

/// Identifies the payload from measurements of an arm that turns its probe in free air.
///
/// - `gravity`: m/s².
///
/// # Errors
/// [`CalibrationError::PayloadOfArm`]
pub fn calibrate_payload_by_arm(
    readings: &PayloadReadings,
    gravity: f64,
) -> Result<Calibration<WeighedFound>, CalibrationError> {
    let params = PayloadParams {
        gravity,
        ..PayloadParams::default()
    };
    let fit = fit_payload(&readings.segments, &params).map_err(CalibrationError::PayloadOfArm)?;
    let doubts = doubt_of_residuals(&fit, "does a hose pull, ")
        .into_iter()
        .collect();
    let payload = PayloadFound::of(&fit, ["flange", "base"]);
    let not_reached = readings
        .not_reached
        .iter()
        .map(NotReached::to_string)
        .collect();
    Ok(Calibration {
        found: WeighedFound {
            payload,
            not_reached,
        },
        doubts,
        losses: Vec::new(),
    })
}

/// - `besides`: other possible causes.
fn doubt_of_residuals(fit: &PayloadFit, besides: &str) -> Option<String> {
    let expected = fit
        .expected_force
        .filter(|expected| fit.rms_force > UNEXPLAINED * expected)?;
    Some(format!(
        "the residuals of {:.3} N are more than the noise explains ({expected:.3} N): does a cable pull, {besides}had it \
         settled?",
        fit.rms_force
    ))
}

reported! {
    /// Weight, centre of mass and bias; `named`: owner of the sensor's axes, and of the poses'
    /// axes.
    #[derive(Clone)]
    pub struct PayloadFound, fn of(fit: &PayloadFit, named: [&'static str; 2]) {
        #[serde(skip)]
        axes: [&'static str; 2] = named,
        static_segments: usize = fit.poses,
        /// indices of outliers, from 0
        left_out: Vec<usize> = fit.rejected.clone(),
        tilt_deg: f64 = fit.tilt.to_degrees(),
        weight_n: f64 = fit.weight[0],
        weight_std_n: f64 = fit.weight[1],
        mass_kg: f64 = fit.payload().mass,
        mass_std_kg: f64 = fit.payload().mass * fit.weight[1] / fit.weight[0],
        /// in the axes of the sensor; for an arm those of its flange
        centre_mm: Vector = Vector::of(&fit.p_sc, 1e3),
        /// in the axes of the poses; for an arm those of its base
        gravity_m_per_s2: [f64; 3] = fit.payload().gravity_o.into(),
        bias_force_n: Vector = Vector::of(&fit.bias_force, 1.0),
        bias_torque_nm: Vector = Vector::of(&fit.bias_torque, 1.0),
        residual_force_n: f64 = fit.rms_force,
        residual_torque_nm: f64 = fit.rms_torque,
        /// expected from the noise of the sensor
        expected_residual_n: Option<f64> = fit.expected_force,
    }
}

impl CalibrationResult for PayloadFound {
    fn settings(&self) -> (Vec<Setting>, String) {
        let list = |path, values: &[f64; 3], digits| {
            Setting::list(path, &values.map(|x| rounded(x, digits)))
        };
        let [force_n, torque_nm] = [&self.bias_force_n.value, &self.bias_torque_nm.value];
        let settings = vec![
            Setting::number("compensation.payload.mass_kg", rounded(self.mass_kg, 10)),
            list("compensation.payload.centre_mm", &self.centre_mm.value, 7),
            list(
                "compensation.payload.gravity_m_per_s2",
                &self.gravity_m_per_s2,
                10,
            ),
            Setting::word("compensation.payload.gravity_axes", GravityAxes::Space),
            list("compensation.bias.force_n", force_n, 10),
            list("compensation.bias.torque_nm", torque_nm, 10),
        ];
        let remark = format!(
            "payload: {} static segments, residuals {:.3} N and {:.4} N·m rms",
            self.static_segments, self.residual_force_n, self.residual_torque_nm
        );
        (settings, remark)
    }
}

impl fmt::Display for PayloadFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let down = Vector3::from(self.gravity_m_per_s2);
        let [x, y, z]: [f64; 3] = (down / down.norm()).into();
        let (phases, left_out, tilt) = (self.static_segments, self.left_out.len(), self.tilt_deg);
        writeln!(
            f,
            "static segments: {phases}, left out: {left_out}; tilted by {tilt:.0}° or more about every axis"
        )?;
        writeln!(
            f,
            "weight      {:.4} ± {:.4} N",
            self.weight_n, self.weight_std_n
        )?;
        writeln!(
            f,
            "mass        {:.5} ± {:.5} kg",
            self.mass_kg, self.mass_std_kg
        )?;
        let [of_sensor, of_poses] = self.axes;
        writeln!(
            f,
            "centre      {} mm, in the axes of the {of_sensor}",
            self.centre_mm
        )?;
        writeln!(
            f,
            "down        ({x:+.4}, {y:+.4}, {z:+.4}), in the axes of the {of_poses}"
        )?;
        writeln!(f, "bias        {} N", self.bias_force_n)?;
        writeln!(f, "            {:.5} N·m", self.bias_torque_nm)?;
        write!(
            f,
            "residuals   {:.4} N, {:.5} N·m rms",
            self.residual_force_n, self.residual_torque_nm
        )?;
        self.expected_residual_n
            .iter()
            .try_for_each(|n| write!(f, "; {n:.4} N by the noise of the sensor"))
    }
}

/// Weight and centre of mass as measured by an arm.
#[derive(Clone, Debug, Serialize)]
pub struct WeighedFound {
    #[serde(flatten)]
    payload: PayloadFound,
    /// unreachable orientations, and why
    not_reached: Vec<String>,
}

impl CalibrationResult for WeighedFound {
    fn settings(&self) -> (Vec<Setting>, String) {
        let PayloadFound {
            static_segments,
            residual_force_n,
            residual_torque_nm,
            ..
        } = self.payload;
        let payload_kg = rounded(self.payload.mass_kg, 10);
        let payload_centre_mm = self.payload.centre_mm.value.map(|mm| rounded(mm, 7));
        let settings = vec![
            Setting::number("robot.payload_kg", payload_kg),
            Setting::list("robot.payload_centre_mm", &payload_centre_mm),
        ];
        let remark = format!(
            "payload: {static_segments} orientations, residuals {residual_force_n:.3} N and {residual_torque_nm:.4} N·m rms"
        );
        (settings, remark)
    }
}

impl fmt::Display for WeighedFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.not_reached
            .iter()
            .try_for_each(|line| writeln!(f, "left out    {line}"))?;
        write!(f, "{}", self.payload)
    }
}
