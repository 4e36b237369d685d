//! Input of a report.

use crate::inspection::calibration::CalibrationLine;
use crate::inspection::params::PartPicture;
use crate::inspection::rows::Inspected;
use crate::inspection::source::InspectionSource;

/// Files and decisions.
pub(in crate::inspection) struct ReportInput<'a> {
    pub inspected: &'a Inspected,
    pub source: &'a InspectionSource,
    pub calibration: &'a [CalibrationLine],
    pub picture: PartPicture,
}
