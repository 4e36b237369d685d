//! What a report is made of.

use crate::inspection::calibration::CalibrationLine;
use crate::inspection::params::PartPicture;
use crate::inspection::rows::Inspected;
use crate::inspection::source::InspectionSource;

/// … all that was read and decided.
pub(in crate::inspection) struct ReportInput<'a> {
    pub inspected: &'a Inspected,
    pub source: &'a InspectionSource,
    pub calibration: &'a [CalibrationLine],
    pub picture: PartPicture,
}
