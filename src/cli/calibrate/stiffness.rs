//! `touchup calibrate stiffness`: compliance of arm and probe, from presses on one spot.

use clap::Args;

use super::super::check::repeated;
use super::super::probing::arm::{ArmArguments, TouchesOutput};
use super::super::{CliError, Losses};
use super::CalibrationTarget;
use touchup_session::calibration::{Calibration, StiffnessFound};

#[derive(Debug, Args)]
pub(in crate::cli) struct StiffnessArguments {
    #[command(flatten)]
    arm: ArmArguments,
    /// Flat spot on a stiff part, clear for 15 mm around, in the frame of the scan, mm
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    spot: String,
    /// Number of presses
    #[arg(long, value_name = "N", default_value_t = 10)]
    touches: usize,
    #[command(flatten)]
    output: TouchesOutput,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// Runs `touchup calibrate stiffness`.
pub(super) fn stiffness(arguments: &StiffnessArguments) -> Result<Losses, CliError> {
    let StiffnessArguments {
        arm,
        spot,
        touches,
        output,
        target,
    } = arguments;
    let (scene, draft) = target.open_for_arm()?;
    let found = StiffnessFound::of(&repeated(arm, scene, spot, *touches, output)?);
    target.write(
        &draft,
        Calibration {
            found,
            doubts: Vec::new(),
            losses: Vec::new(),
        },
    )
}
