//! `touchup calibrate`: parameters of scan, sensor and tip, identified and written into the scene.

mod payload;
mod recording;
mod scan;
mod stiffness;
mod target;
mod tip;

use clap::Subcommand;

use self::recording::calibrated;
use self::target::CalibrationTarget;
use super::{CliError, Losses};

#[derive(Debug, Subcommand)]
pub(super) enum CalibrateArguments {
    /// Registration of the scan in the frame of the recorded poses, from points picked in both
    Scan(scan::ScanArguments),
    /// Weight, centre of mass and sensor bias, from static segments in free air of a recording or
    /// an arm
    Payload(payload::PayloadArguments),
    /// Centre of the ball: in the tracked stylus, from a swing about it; in the flange of an arm,
    /// from touches of one spot
    Tip(tip::TipArguments),
    /// Compliance of arm and probe, from an arm's presses on one spot
    Stiffness(stiffness::StiffnessArguments),
}

/// Runs `touchup calibrate`.
pub(super) fn calibrate(arguments: &CalibrateArguments) -> Result<Losses, CliError> {
    match arguments {
        CalibrateArguments::Scan(arguments) => scan::scan(arguments),
        CalibrateArguments::Payload(arguments) => payload::payload(arguments),
        CalibrateArguments::Tip(arguments) => tip::tip(arguments),
        CalibrateArguments::Stiffness(arguments) => stiffness::stiffness(arguments),
    }
}
