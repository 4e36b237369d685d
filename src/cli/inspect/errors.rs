//! Errors of an inspection, with the exit code of each kind.

use crate::cli::CliError;
use touchup_inspect::InspectionError;

impl From<InspectionError> for CliError {
    fn from(error: InspectionError) -> Self {
        use InspectionError as Why;
        let kind = match error {
            Why::Setting(_) | Why::NoFeatures(_) | Why::NoTolerance => return Self::usage(error),
            Why::Features(error) => return error.into(),
            Why::Touches(error) => return error.into(),
            Why::Nominal(error) => return error.into(),
            Why::Mesh(error) => return error.into(),
            Why::Columns(error) => return error.into(),
            Why::Scene(error) => return error.into(),
            Why::NotWritten(error) => return Self::not_written(error),
            Why::File { .. } => "inspection",
            Why::Probed { .. } => "features",
            Why::OtherTouches { .. } => "touches",
            Why::Alignment(_) => "alignment",
            Why::Drawing { .. } | Why::DrawingMesh(_) => "nominal",
        };
        Self::new((kind, 3), &error, Some(&error))
    }
}
