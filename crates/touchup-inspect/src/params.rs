//! Settings of an inspection, by the flags of the command line and by their names elsewhere.

use clap::{Args, Command, FromArgMatches};
use nalgebra::Vector3;

use super::InspectionError;
use super::drawing::DrawingParams;
use touchup_features::conformity::{DecisionParams, DecisionRule};
use touchup_io::mesh_file::MeshUnit;

/// Settings of an inspection.
#[derive(Clone, Debug, Args)]
pub struct InspectionParams {
    /// the drawing
    #[command(flatten)]
    pub drawing: DrawingParams,
    /// decisions and head of the report
    #[command(flatten)]
    pub report: ReportParams,
}

/// Settings of a report: its decisions, and the administrative data in its head.
#[derive(Clone, Debug, Args)]
pub struct ReportParams {
    /// Decision rule: guard bands, or the measured value alone
    #[arg(long, value_name = "RULE", default_value_t = DecisionParams::default().rule)]
    pub rule: DecisionRule,
    /// Minimum probability of conformity for a pass, and of nonconformity for a fail
    #[arg(long, value_name = "P", default_value_t = DecisionParams::default().confidence)]
    pub confidence: f64,
    /// Coverage factor of the expanded uncertainties U = k u
    // about 95 %, as on certificates
    #[arg(long = "k", value_name = "K", default_value_t = 2.0)]
    pub coverage_factor: f64,
    /// Name or number of the part
    #[arg(long, value_name = "NAME")]
    pub part: Option<String>,
    /// Serial number of the part
    #[arg(long, value_name = "S")]
    pub serial: Option<String>,
    /// Name of the inspector
    #[arg(long, value_name = "NAME")]
    pub operator: Option<String>,
}

/// Settings of the part's picture in the report.
#[derive(Clone, Copy, Debug, Default)]
pub struct PartPicture {
    /// unit of the coordinates in the mesh file
    pub mesh_unit: MeshUnit,
    /// direction of view; `None`: from the touched side
    pub view: Option<Vector3<f64>>,
}

impl ReportParams {
    /// Settings of the decisions.
    pub fn decision(&self) -> DecisionParams {
        DecisionParams {
            rule: self.rule,
            confidence: self.confidence,
        }
    }
}

impl InspectionParams {
    /// Settings by the names of their flags, `match_mm` for `--match-mm`; unnamed ones have their
    /// defaults.
    ///
    /// # Errors
    /// The words of the command line.
    pub fn named<'a>(
        settings: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, String> {
        let flags = settings
            .into_iter()
            .map(|(name, value)| format!("--{}={value}", name.replace('_', "-")));
        let command = Command::new("inspect")
            .no_binary_name(true)
            .disable_help_flag(true);
        let found = Self::augment_args(command)
            .try_get_matches_from(flags)
            .and_then(|matches| Self::from_arg_matches(&matches));
        found.map_err(|error| {
            let text = error.to_string();
            let first = text.split("\n\n").next().unwrap_or(&text);
            first.trim_start_matches("error: ").to_owned()
        })
    }

    /// Checks each setting; an error names the flag of the command line.
    ///
    /// # Errors
    /// [`InspectionError::Setting`]
    pub fn check(&self) -> Result<(), InspectionError> {
        let Self { drawing, report } = self;
        let lengths = [
            ("--k", Some(report.coverage_factor)),
            ("--match-mm", Some(drawing.match_mm)),
            ("--tolerance-mm", drawing.tolerance_mm),
            ("--position-mm", drawing.position_mm),
        ];
        let is_positive = |number: f64| number > 0.0 && number.is_finite();
        for (flag, number) in lengths
            .into_iter()
            .filter_map(|(flag, number)| Some((flag, number?)))
        {
            if !is_positive(number) {
                return Err(InspectionError::Setting(format!(
                    "{flag} {number} must be above 0"
                )));
            }
        }
        let confidence = report.confidence;
        if !(confidence > 0.5 && confidence < 1.0) {
            return Err(InspectionError::Setting(format!(
                "--confidence {confidence} must be above 0.5 and below 1"
            )));
        }
        Ok(())
    }
}
