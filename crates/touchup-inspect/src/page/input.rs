//! Input of a report.

use crate::calibration::CalibrationLine;
use crate::params::PartPicture;
use crate::rows::Inspection;
use crate::source::InspectionSource;

/// Files and decisions.
pub(crate) struct ReportInput<'a> {
    pub inspected: &'a Inspection,
    pub source: &'a InspectionSource,
    pub calibration: &'a [CalibrationLine],
    pub picture: PartPicture,
}
