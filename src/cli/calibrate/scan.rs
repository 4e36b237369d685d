//! `touchup calibrate scan`: registration of the scan in space from point pairs.

use std::path::PathBuf;

use clap::Args;

use super::super::{CliError, Losses, check_kept, require};
use super::{CalibrationTarget, calibrated};
use touchup_session::calibration::calibrate_scan;
use touchup_session::replay::RecordedAs;

#[derive(Debug, Args)]
pub(in crate::cli) struct ScanArguments {
    /// Point pairs, CSV: scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm, optional
    /// name, sigma_mm
    #[arg(long, value_name = "CSV")]
    pairs: PathBuf,
    /// Recording with a dwell of 1 s on each point in file order; it replaces the space columns
    #[arg(long, value_name = "RECORDING")]
    bag: Option<PathBuf>,
    /// Standard deviation of a pair per axis, mm; default: from the residuals
    #[arg(long, value_name = "S")]
    sigma_mm: Option<f64>,
    #[command(flatten)]
    source: RecordedAs,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// Runs `touchup calibrate scan`.
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
            calibrated(bag, source, &draft.scene, |recording, at_each| {
                calibrate_scan(pairs, Some(recording), &draft.scene, sigma, at_each)
            })?
        }
        None => calibrate_scan(pairs, None, &draft.scene, sigma, &mut || {})?,
    };
    target.write(&draft, calibration)
}
