//! `touchup calibrate tip`: ball centre in the tracked stylus, from a swing about it, or in the
//! flange of an arm, from touches of one flat spot with a leaning probe.

use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;

use super::super::probing::arm::{CellArguments, Measurement, RobotName, TouchesOutput};
use super::super::probing::{KeptMeasurements, millimetres};
use super::super::{CliError, Losses};
use super::{CalibrationTarget, calibrated};
use touchup_session::calibration::{calibrate_tip, calibrate_tip_by_arm};
use touchup_session::replay::RecordedAs;
use touchup_session::scene::Scene;
use touchup_sim::ArmParams;

#[derive(Debug, Args)]
#[group(id = "swing", required = true, multiple = false, args = ["bag", "robot"])]
pub(in crate::cli) struct TipArguments {
    /// Recording of a swing of the stylus to all sides with the ball in a cone or divot
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["cell", "spot", "truth_tip_mm"])]
    bag: Option<PathBuf>,
    /// Arm that touches --spot with its probe leaning to all sides; needs --scene
    #[arg(long, value_name = "ARM", requires = "spot")]
    robot: Option<RobotName>,
    #[command(flatten)]
    cell: CellArguments,
    /// With --robot: flat spot on the part, clear for 20 mm around, in the frame of the scan, mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    spot: Option<String>,
    /// True ball centre of a simulated arm in the flange, mm; default: robot.tip_position_mm of the
    /// scene
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    truth_tip_mm: Option<String>,
    #[command(flatten)]
    output: TouchesOutput,
    #[command(flatten)]
    source: RecordedAs,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// Runs `touchup calibrate tip`.
pub(super) fn tip(arguments: &TipArguments) -> Result<Losses, CliError> {
    let TipArguments {
        bag,
        robot,
        spot,
        source,
        target,
        ..
    } = arguments;
    if let (Some(robot), Some(spot)) = (robot, spot) {
        return tip_by_arm(arguments, *robot, spot);
    }
    let bag = bag.as_ref().expect("one of --bag and --robot is there");
    let draft = target.open("--bag", bag)?;
    let calibration = calibrated(bag, source, &draft.scene, |recording, at_each| {
        calibrate_tip(recording, &draft.scene, at_each)
    })?;
    target.write(&draft, calibration)
}

/// - `spot`: text X,Y,Z in mm.
fn tip_by_arm(arguments: &TipArguments, robot: RobotName, spot: &str) -> Result<Losses, CliError> {
    let TipArguments {
        cell,
        truth_tip_mm,
        output,
        target,
        ..
    } = arguments;
    let kept = KeptMeasurements::Touches(output.touches_out.as_deref());
    let measurement = Measurement {
        stage: "touch",
        kept,
        spheres: &[],
    };
    let place = Point3::from(millimetres("--spot", spot)?);
    let (scene, draft) = target.open_for_arm()?;
    let truth = |arm: ArmParams, _: &Scene| {
        let Some(text) = truth_tip_mm else {
            return Ok(arm);
        };
        let off = millimetres("--truth-tip-mm", text)? - arm.pose_ft.translation.vector;
        Ok(ArmParams {
            ball_offset: arm.pose_ft.rotation.inverse() * off,
            ..arm
        })
    };
    let (measured, of_arm) = cell.measure(robot, scene, measurement, truth, |prober| {
        prober.measure_tip(&place)
    })?;
    target.write(
        &draft,
        calibrate_tip_by_arm(&measured, &of_arm).map_err(CliError::arm)?,
    )
}
