//! Input of a report.

use crate::calibration::CalibrationLine;
use crate::params::PartPicture;
use crate::rows::Inspected;
use crate::source::InspectionSource;

/// Files and decisions.
pub(crate) struct ReportInput<'a> {
    pub inspected: &'a Inspected,
    pub source: &'a InspectionSource,
    pub calibration: &'a [CalibrationLine],
    pub picture: PartPicture,
}
