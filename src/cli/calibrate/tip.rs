//! `touchup calibrate tip`: where the ball is: in the tracked stylus, from a swing about it; in the
//! flange of an arm, from touches of one flat spot with a probe that leans.

use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;

use super::super::arm::{CellArguments, Measurement, RobotName, TouchesOutput};
use super::super::probing::{KeptMeasurements, millimetres};
use super::super::{CliError, Losses};
use super::{CalibrationTarget, RecordingFlags};
use crate::calibration::{calibrate_tip, calibrate_tip_by_arm};
use crate::scene::Scene;
use crate::sim::ArmParams;

#[derive(Debug, Args)]
#[group(id = "swing", required = true, multiple = false, args = ["bag", "robot"])]
pub(in crate::cli) struct TipArguments {
    /// A recording in which the ball sits in a cone or divot while the stylus is swung to all sides
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["cell", "spot", "truth_tip_mm"])]
    bag: Option<PathBuf>,
    /// An arm that touches --spot with its probe leaning to all sides; it needs --scene
    #[arg(long, value_name = "ARM", requires = "spot")]
    robot: Option<RobotName>,
    #[command(flatten)]
    cell: CellArguments,
    /// With --robot: a flat place of the part with nothing within 20 mm, in the frame of the scan,
    /// mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    spot: Option<String>,
    /// True position of the ball of a simulated arm in the flange, mm; default:
    /// robot.tip_position_mm of the scene
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    truth_tip_mm: Option<String>,
    #[command(flatten)]
    output: TouchesOutput,
    #[command(flatten)]
    source: RecordingFlags,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// The verb.
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
    let calibration = source.calibrate(bag, &draft.scene, |recording, at_each| {
        calibrate_tip(recording, &draft.scene, at_each)
    })?;
    target.write(&draft, calibration)
}

/// - `spot`: as it was written, X,Y,Z in mm.
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
