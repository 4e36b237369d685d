//! `touchup calibrate payload`: payload identification from static segments of a recording or of a
//! self-turning arm.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::super::probing::KeptMeasurements;
use super::super::probing::arm::{CellArguments, Measurement, RobotName, TruePayload};
use super::super::{CliError, Losses, require};
use super::{CalibrationTarget, calibrated};
use touchup_method::stylus::WrenchFrame;
use touchup_session::calibration::{
    PayloadCalibrationParams, calibrate_payload, calibrate_payload_by_arm,
    calibrate_payload_by_table,
};
use touchup_session::replay::RecordedAs;
use touchup_session::scene::Scene;
use touchup_sim::ArmParams;

#[derive(Debug, Args)]
#[group(id = "poses", required = true, multiple = false, args = ["bag", "samples", "robot"])]
pub(in crate::cli) struct PayloadArguments {
    /// Recording with the stylus held still in free air in several orientations
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["cell", "true_payload"])]
    bag: Option<PathBuf>,
    /// Static poses, CSV: qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm
    #[arg(long, value_name = "CSV", conflicts_with_all = ["cell", "true_payload"])]
    samples: Option<PathBuf>,
    /// Arm that turns its probe in free air by itself; needs --scene
    #[arg(long, value_name = "ARM")]
    robot: Option<RobotName>,
    #[command(flatten)]
    cell: CellArguments,
    #[command(flatten)]
    truth_payload: TruePayload,
    /// Output, with --robot: each static segment at once as a CSV line in the format of --samples,
    /// so that an aborted measurement loses none
    #[arg(long, value_name = "CSV", requires = "robot")]
    segments_out: Option<PathBuf>,
    /// Axes of the wrench; default: as in the recording, or the sensor's for --samples
    #[arg(long, value_name = "AXES", conflicts_with = "robot")]
    wrench_axes: Option<Axes>,
    /// Acceleration of gravity, to convert weight to mass
    #[arg(long, value_name = "G", default_value = "9.81")]
    gravity_m_per_s2: f64,
    #[command(flatten)]
    source: RecordedAs,
    #[command(flatten)]
    target: CalibrationTarget,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Axes {
    /// Axes of the sensor
    Sensor,
    /// Axes of the poses
    Pose,
}

/// Runs `touchup calibrate payload`.
pub(super) fn payload(arguments: &PayloadArguments) -> Result<Losses, CliError> {
    let PayloadArguments {
        bag,
        samples,
        source,
        target,
        ..
    } = arguments;
    let params = arguments.params()?;
    match (arguments.robot, bag, samples) {
        (Some(robot), ..) => payload_of_arm(arguments, robot, params.gravity),
        (_, Some(bag), _) => {
            let draft = target.open("--bag", bag)?;
            let calibration = calibrated(bag, source, &draft.scene, |recording, at_each| {
                calibrate_payload(recording, &draft.scene, params, at_each)
            })?;
            target.write(&draft, calibration)
        }
        (_, _, table) => {
            let table = table
                .as_ref()
                .expect("one of --bag, --samples and --robot is there");
            let draft = target.open("--samples", table)?;
            target.write(
                &draft,
                calibrate_payload_by_table(table, &draft.scene, params)?,
            )
        }
    }
}

/// - `gravity`: m/s².
fn payload_of_arm(
    arguments: &PayloadArguments,
    robot: RobotName,
    gravity: f64,
) -> Result<Losses, CliError> {
    let PayloadArguments {
        cell,
        truth_payload,
        target,
        segments_out,
        ..
    } = arguments;
    let kept = KeptMeasurements::Segments(segments_out.as_deref());
    let (scene, draft) = target.open_for_arm()?;
    let truth = |arm: ArmParams, scene: &Scene| truth_payload.held_by(arm, scene);
    let measurement = Measurement {
        stage: "identify the payload",
        kept,
        spheres: &[],
    };
    let (readings, _) = cell.measure(robot, scene, measurement, truth, |prober| {
        prober.measure_payload()
    })?;
    target.write(&draft, calibrate_payload_by_arm(&readings, gravity)?)
}

impl PayloadArguments {
    fn params(&self) -> Result<PayloadCalibrationParams, CliError> {
        let gravity = self.gravity_m_per_s2;
        let why = format!("--gravity-m-per-s2 is {gravity}; it must be 1 to 100 m/s²");
        require((1.0..=100.0).contains(&gravity), why)?;
        let wrench_frame = self.wrench_axes.map(|axes| match axes {
            Axes::Sensor => WrenchFrame::Sensor,
            Axes::Pose => WrenchFrame::Object,
        });
        Ok(PayloadCalibrationParams {
            gravity,
            wrench_frame,
        })
    }
}
