//! `touchup calibrate payload`: payload identification, from static segments: of a recording, or of an arm that turns by itself.
//!
//! The controller of an arm compensates the weight of the payload set there. So the result goes to its parameters:
//! `robot.payload_kg` and `robot.payload_centre_mm`. The bias is only printed: a sensor is zeroed before each touch.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use serde::Serialize;
use tracing::warn;

use super::super::arm::{CellArguments, Measurement, RobotName, TruePayload};
use super::super::probing::KeptMeasurements;
use super::super::{CliError, Losses, reported, require};
use super::{Calibrated, CalibrationRecording, CalibrationTarget, DraftScene, Vector, rounded};
use crate::calibrate::{
    PayloadError, PayloadFit, PayloadParams, StaticPose, StaticSegmentFinder, StaticSegmentParams, fit_payload,
};
use crate::io::static_poses::read_static_poses;
use crate::probing::execute::{NotReached, PayloadReadings};
use crate::scene::{GravityAxes, PayloadSection, Scene, Setting};
use crate::sim::ArmParams;
use crate::stylus::{Payload, SensorBias, WrenchFrame};

#[derive(Debug, Args)]
#[group(id = "poses", required = true, multiple = false, args = ["bag", "samples", "robot"])]
pub(in crate::cli) struct PayloadArguments {
    /// A recording in which the stylus is held still in free air in several orientations
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["cell", "true_payload"])]
    bag: Option<PathBuf>,
    /// Static poses, CSV: qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm
    #[arg(long, value_name = "CSV", conflicts_with_all = ["cell", "true_payload"])]
    samples: Option<PathBuf>,
    /// An arm that turns its probe in free air by itself; it needs --scene
    #[arg(long, value_name = "ARM")]
    robot: Option<RobotName>,
    #[command(flatten)]
    cell: CellArguments,
    #[command(flatten)]
    truth_payload: TruePayload,
    /// Output, with --robot: each static segment as it is measured, a line of CSV each as --samples reads them, so that none is lost
    /// whatever ends the measurement
    #[arg(long, value_name = "CSV", requires = "robot")]
    segments_out: Option<PathBuf>,
    /// Axes of the wrench; default: those of the recording, or the sensor's for --samples
    #[arg(long, value_name = "AXES", conflicts_with = "robot")]
    wrench_axes: Option<Axes>,
    /// Acceleration of gravity, by which the weight is divided
    #[arg(long, value_name = "G", default_value = "9.81")]
    gravity_m_per_s2: f64,
    #[command(flatten)]
    source: CalibrationRecording,
    #[command(flatten)]
    target: CalibrationTarget,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Axes {
    /// The sensor's own
    Sensor,
    /// Those of the poses
    Pose,
}

/// A residual over this many times the noise has another cause.
const UNEXPLAINED: f64 = 5.0;

/// The verb.
pub(super) fn payload(arguments: &PayloadArguments) -> Result<Losses, CliError> {
    let gravity = arguments.gravity()?;
    if let Some(robot) = arguments.robot {
        return payload_of_arm(arguments, robot, gravity);
    }
    let bag = arguments.bag.as_ref().map(|bag| ("--bag", bag));
    let samples = arguments.samples.as_ref().map(|samples| ("--samples", samples));
    let (flag, path) = bag.or(samples).expect("one of --bag, --samples and --robot is there");
    let draft = arguments.target.open(flag, path)?;
    let (poses, wrench_frame, losses) = arguments.poses(path, &draft)?;
    let mounted = draft.scene.compensator_params(wrench_frame).pose_ts.rotation;
    let params = PayloadParams { wrench_frame, r_ts: mounted, gravity };
    let fit = fit_payload(&poses, &params).map_err(|error| CliError::calibration(path, error))?;
    warn_of_residuals(&fit, "is the sensor mounted as compensation.sensor_orientation_xyzw says, ");
    arguments.target.write(&draft, &PayloadFound::of(&fit, ["sensor", "poses"]))?;
    Ok(losses)
}

/// - `gravity`: m/s².
fn payload_of_arm(arguments: &PayloadArguments, robot: RobotName, gravity: f64) -> Result<Losses, CliError> {
    let PayloadArguments { cell, truth_payload, target, segments_out, .. } = arguments;
    let kept = KeptMeasurements::Segments(segments_out.as_deref());
    let (scene, draft) = target.open_for_arm()?;
    let truth = |arm: ArmParams, scene: &Scene| truth_payload.held_by(arm, scene);
    let measurement = Measurement { stage: "identify the payload", kept, spheres: &[] };
    let (readings, _) = cell.measure(robot, scene, measurement, truth, |prober| prober.measure_payload())?;
    let PayloadReadings { segments, not_reached } = readings;
    let params = PayloadParams { gravity, ..PayloadParams::default() };
    let fit = fit_payload(&segments, &params).map_err(|error| CliError::arm(advice(&error)))?;
    warn_of_residuals(&fit, "does a hose pull, ");
    let payload = PayloadFound::of(&fit, ["flange", "base"]);
    let not_reached = not_reached.iter().map(NotReached::to_string).collect();
    target.write(&draft, &WeighedFound { payload, not_reached })?;
    Ok(Losses::new())
}

/// - `besides`: other possible causes.
fn warn_of_residuals(fit: &PayloadFit, besides: &str) {
    if let Some(expected) = fit.expected_force.filter(|expected| fit.rms_force > UNEXPLAINED * expected) {
        warn!(
            "the residuals of {:.3} N are more than the noise explains ({expected:.3} N): does a cable pull, {besides}had it \
             settled?",
            fit.rms_force
        );
    }
}

impl PayloadArguments {
    /// The acceleration of gravity, m/s².
    fn gravity(&self) -> Result<f64, CliError> {
        let gravity = self.gravity_m_per_s2;
        let why = format!("--gravity-m-per-s2 is {gravity}; it must be 1 to 100 m/s²");
        require((1.0..=100.0).contains(&gravity), why).map(|()| gravity)
    }

    fn poses(&self, path: &Path, draft: &DraftScene) -> Result<(Vec<StaticPose>, WrenchFrame, Losses), CliError> {
        let named = self.wrench_axes.map(|axes| match axes {
            Axes::Sensor => WrenchFrame::Sensor,
            Axes::Pose => WrenchFrame::Object,
        });
        if self.samples.is_some() {
            let pose = |(r_wt, wrench)| StaticPose { r_wt, wrench, noise: None, samples: 1 };
            let poses = read_static_poses(path)?.into_iter().map(pose).collect();
            return Ok((poses, named.unwrap_or_default(), Losses::new()));
        }
        let mut finder = StaticSegmentFinder::new(StaticSegmentParams::default());
        let recording = self.source.open(path)?;
        let recorded = recording.wrench_frame;
        let replayed = self.source.replay(recording, &draft.scene, |sample| finder.push(sample))?;
        Ok((finder.finish(), named.unwrap_or(recorded), replayed.losses))
    }
}

reported! {
    /// What `--json` prints; `named`: whose axes are those of the sensor, and whose those of the poses.
    struct PayloadFound, fn of(fit: &PayloadFit, named: [&'static str; 2]) {
        #[serde(skip)]
        axes: [&'static str; 2] = named,
        static_segments: usize = fit.poses,
        /// those that did not fit, from 0 on
        left_out: Vec<usize> = fit.rejected.clone(),
        tilt_deg: f64 = fit.tilt.to_degrees(),
        weight_n: f64 = fit.weight[0],
        weight_std_n: f64 = fit.weight[1],
        mass_kg: f64 = fit.payload().mass,
        mass_std_kg: f64 = fit.payload().mass * fit.weight[1] / fit.weight[0],
        /// in the axes of the sensor, which of an arm are those of its flange
        centre_mm: Vector = Vector::of(&fit.p_sc, 1e3),
        /// in the axes of the poses, which of an arm are those of its base
        gravity_m_per_s2: [f64; 3] = fit.payload().gravity_o.into(),
        bias_force_n: Vector = Vector::of(&fit.bias_force, 1.0),
        bias_torque_nm: Vector = Vector::of(&fit.bias_torque, 1.0),
        residual_force_n: f64 = fit.rms_force,
        residual_torque_nm: f64 = fit.rms_torque,
        /// expected from the noise of the sensor
        expected_residual_n: Option<f64> = fit.expected_force,
    }
}

impl Calibrated for PayloadFound {
    fn set_in(&self, scene: &mut Scene) -> (Vec<Setting>, String) {
        let digits = |values: &[f64; 3], digits| values.map(|x| rounded(x, digits));
        let (mass_kg, gravity_m_per_s2) = (rounded(self.mass_kg, 10), digits(&self.gravity_m_per_s2, 10));
        let centre_mm = digits(&self.centre_mm.value, 7);
        let [force_n, torque_nm] = [&self.bias_force_n, &self.bias_torque_nm].map(|bias| digits(&bias.value, 10));
        let settings = vec![
            Setting::scalar("compensation.payload.mass_kg", mass_kg),
            Setting::list("compensation.payload.centre_mm", &centre_mm),
            Setting::list("compensation.payload.gravity_m_per_s2", &gravity_m_per_s2),
            Setting::scalar("compensation.payload.gravity_axes", GravityAxes::Space.name()),
            Setting::list("compensation.bias.force_n", &force_n),
            Setting::list("compensation.bias.torque_nm", &torque_nm),
        ];
        let compensation = scene.compensation.get_or_insert_default();
        let p_sc = Vector3::from(centre_mm) / 1e3;
        let payload = Payload { mass: mass_kg, p_sc, gravity_o: gravity_m_per_s2.into() };
        compensation.payload = Some(PayloadSection { gravity_axes: GravityAxes::Space, payload });
        compensation.bias = Some(SensorBias { force: force_n.into(), torque: torque_nm.into() });
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
        writeln!(f, "static segments: {phases}, left out: {left_out}; tilted by {tilt:.0}° or more about every axis")?;
        writeln!(f, "weight      {:.4} ± {:.4} N", self.weight_n, self.weight_std_n)?;
        writeln!(f, "mass        {:.5} ± {:.5} kg", self.mass_kg, self.mass_std_kg)?;
        let [of_sensor, of_poses] = self.axes;
        writeln!(f, "centre      {} mm, in the axes of the {of_sensor}", self.centre_mm)?;
        writeln!(f, "down        ({x:+.4}, {y:+.4}, {z:+.4}), in the axes of the {of_poses}")?;
        writeln!(f, "bias        {} N", self.bias_force_n)?;
        writeln!(f, "            {:.5} N·m", self.bias_torque_nm)?;
        write!(f, "residuals   {:.4} N, {:.5} N·m rms", self.residual_force_n, self.residual_torque_nm)?;
        self.expected_residual_n.iter().try_for_each(|n| write!(f, "; {n:.4} N by the noise of the sensor"))
    }
}

/// Why the static segments of an arm do not determine its payload.
fn advice(error: &PayloadError) -> String {
    match error {
        PayloadError::WrongAxes { rms_n, other_rms_n, .. } => format!(
            "the raw wrench of this arm is not in the axes of its flange: residuals are {rms_n:.3} N, and {other_rms_n:.3} N in \
             those of its base; identify its payload from a recording or a scale"
        ),
        PayloadError::NoWeight { weight_n, sigma_n } => format!(
            "the weight is {weight_n:.3} N, no more than three times its uncertainty of {sigma_n:.3} N: nothing hangs on the \
             flange, or the arm reports no raw wrench"
        ),
        PayloadError::Inconsistent { rejected, poses } => format!(
            "{rejected} of {poses} static segments do not fit the others: the probe must touch nothing, and no hose or cable may pull it"
        ),
        error => error.to_string(),
    }
}

/// What `--json` prints of an arm.
#[derive(Debug, Serialize)]
struct WeighedFound {
    #[serde(flatten)]
    payload: PayloadFound,
    /// unreachable orientations, and why
    not_reached: Vec<String>,
}

impl Calibrated for WeighedFound {
    fn set_in(&self, scene: &mut Scene) -> (Vec<Setting>, String) {
        let PayloadFound { static_segments, residual_force_n, residual_torque_nm, .. } = self.payload;
        let payload_kg = rounded(self.payload.mass_kg, 10);
        let payload_centre_mm = self.payload.centre_mm.value.map(|mm| rounded(mm, 7));
        let robot = scene.robot.get_or_insert_default();
        (robot.payload_mass, robot.payload_centre) = (payload_kg, Vector3::from(payload_centre_mm) / 1e3);
        let settings = vec![
            Setting::scalar("robot.payload_kg", payload_kg),
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
        self.not_reached.iter().try_for_each(|line| writeln!(f, "left out    {line}"))?;
        write!(f, "{}", self.payload)
    }
}
