//! `touchup calibrate scan`: where the scan lies in space, from picked pairs.

use std::path::PathBuf;

use clap::Args;

use super::super::{CliError, Losses, check_kept, require};
use super::{CalibrationTarget, RecordingFlags};
use crate::calibration::calibrate_scan;

#[derive(Debug, Args)]
pub(in crate::cli) struct ScanArguments {
    /// Pairs of points, CSV: scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm, where
    /// wanted name, sigma_mm
    #[arg(long, value_name = "CSV")]
    pairs: PathBuf,
    /// A recording in which the stylus dwells on each point for a second, in the order of the file,
    /// which then needs no columns of space
    #[arg(long, value_name = "RECORDING")]
    bag: Option<PathBuf>,
    /// Standard deviation of a pair per axis, mm; default: from the residuals
    #[arg(long, value_name = "S")]
    sigma_mm: Option<f64>,
    #[command(flatten)]
    source: RecordingFlags,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// The verb.
pub(super) fn scan(arguments: &ScanArguments) -> Result<Losses, CliError> {
    let ScanArguments {
        pairs,
        bag,
        sigma_mm,
        source,
        target,
    } = arguments;
    if let Some(sigma) = sigma_mm {
        require(
            (1e-6..=1e3).contains(sigma),
            format!("--sigma-mm is {sigma}; it must be 1e-6 to 1000 mm"),
        )?;
    }
    let sigma = sigma_mm.map(|sigma| sigma / 1e3);
    let draft = target.open("--pairs", pairs)?;
    let calibration = match bag {
        Some(bag) => {
            check_kept("--bag", bag, &target.out)?;
            draft.require_radius()?;
            source.calibrate(bag, &draft.scene, |recording, at_each| {
                calibrate_scan(pairs, Some(recording), &draft.scene, sigma, at_each)
            })?
        }
        None => calibrate_scan(pairs, None, &draft.scene, sigma, &mut || {})?,
    };
    target.write(&draft, calibration)
}
