//! What a report is made of.

use nalgebra::Vector3;

use crate::cli::inspect::calibration::CalibrationLine;
use crate::cli::inspect::rows::Inspected;
use crate::cli::inspect::source::InspectionSource;
use crate::io::mesh_file::MeshUnit;

/// … all that was read and decided.
pub(in crate::cli::inspect) struct ReportInput<'a> {
    pub inspected: &'a Inspected,
    pub source: &'a InspectionSource,
    pub calibration: &'a [CalibrationLine],
    /// of the mesh of the picture
    pub mesh_unit: MeshUnit,
    /// from where the picture is taken
    pub view: Option<Vector3<f64>>,
}
