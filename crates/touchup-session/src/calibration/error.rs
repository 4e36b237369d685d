//! Errors of a calibration.

use std::path::PathBuf;

use touchup_features::align::PairsError;
use touchup_features::calibrate::{PayloadError, TipError};
use touchup_io::tables::table::TableError;
use touchup_method::stylus::SettingError;

use crate::replay::ReplayError;

/// Error of a calibration: the fault of its input, and how to make a better one.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The recording cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A scene parameter outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// An unreadable table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A swing does not determine the tip.
    #[error("{path}: {error}", path = path.display())]
    Tip {
        /// the recording
        path: PathBuf,
        /// in words
        error: TipError,
    },
    /// Static poses do not determine the payload.
    #[error("{path}: {error}", path = path.display())]
    Payload {
        /// the recording or the table
        path: PathBuf,
        /// in words
        error: PayloadError,
    },
    /// Static segments of an arm do not determine the payload.
    #[error("{}", advice(.0))]
    PayloadOfArm(PayloadError),
    /// Pairs do not determine the pose of the scan.
    #[error("{path}: {error}", path = path.display())]
    Pairs {
        /// the table
        path: PathBuf,
        /// in words
        error: PairsError,
    },
    /// The number of dwells of the stylus differs from the number of points picked on the scan.
    #[error(
        "{path}: {dwells} dwells of half a second in contact, and {points} points picked on the scan; they are matched in order: dwell \
         once on each, in the order of the file",
        path = path.display()
    )]
    Dwells {
        /// the recording
        path: PathBuf,
        /// number in the recording
        dwells: usize,
        /// number in the table
        points: usize,
    },
}

/// Why the static segments of an arm do not determine its payload.
fn advice(error: &PayloadError) -> String {
    match error {
        PayloadError::WrongAxes {
            rms_n, other_rms_n, ..
        } => format!(
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
