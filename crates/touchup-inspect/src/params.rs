//! Settings of an inspection, and the report's administrative data.

use nalgebra::Vector3;

use super::InspectionError;
use super::alignment::AlignmentMethod;
use super::drawing::DrawingParams;
use touchup_features::conformity::{DecisionParams, DecisionRule, GeneralTolerance};
use touchup_io::mesh_file::MeshUnit;

/// Settings of an inspection.
#[derive(Clone, Debug)]
pub struct InspectionParams {
    /// additions to the nominal values
    pub drawing: DrawingParams,
    /// decision rule
    pub decision: DecisionParams,
    /// k of the expanded uncertainties U = k u. Default 2: about 95 %, as on certificates.
    pub coverage_factor: f64,
    /// Largest distance of a feature's centre from its nominal place, across the axis, mm. Default
    /// 1.5: less than the distance between neighbours on most parts.
    pub match_mm: f64,
    /// alignment with the drawing; `None`: the drawing frame is the mesh frame
    pub align: Option<AlignmentMethod>,
    /// name or number of the part
    pub part: Option<String>,
    /// serial number of this part
    pub serial: Option<String>,
    /// name of the inspector
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

impl Default for InspectionParams {
    fn default() -> Self {
        Self {
            drawing: DrawingParams::default(),
            decision: DecisionParams::default(),
            coverage_factor: 2.0,
            match_mm: 1.5,
            align: None,
            part: None,
            serial: None,
            operator: None,
        }
    }
}

impl InspectionParams {
    /// Checks each setting; an error names the flag of the command line.
    ///
    /// # Errors
    /// [`InspectionError::Setting`]
    pub fn check(&self) -> Result<(), InspectionError> {
        let Self {
            drawing,
            decision,
            coverage_factor,
            match_mm,
            ..
        } = self;
        let lengths = [
            ("--k", Some(*coverage_factor)),
            ("--match-mm", Some(*match_mm)),
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
        let confidence = decision.confidence;
        if !(confidence > 0.5 && confidence < 1.0) {
            return Err(InspectionError::Setting(format!(
                "--confidence {confidence} must be above 0.5 and below 1"
            )));
        }
        Ok(())
    }
}

/// General tolerance by name.
///
/// # Errors
/// A text with the available names.
pub fn general_tolerance(name: &str) -> Result<GeneralTolerance, String> {
    let class = GeneralTolerance::of_name(name);
    class.ok_or_else(|| {
        format!(
            "take one of {}",
            GeneralTolerance::ALL.map(GeneralTolerance::name).join(", ")
        )
    })
}

/// Decision rule by name.
///
/// # Errors
/// As [`general_tolerance`].
pub fn decision_rule(name: &str) -> Result<DecisionRule, String> {
    let rule = DecisionRule::of_name(name);
    rule.ok_or_else(|| {
        format!(
            "take one of {}",
            DecisionRule::ALL.map(DecisionRule::name).join(", ")
        )
    })
}
