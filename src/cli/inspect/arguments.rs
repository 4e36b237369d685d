//! The flags of `touchup inspect`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::pictures::view_from;
use crate::cli::progress::WorkProgress;
use crate::cli::{CliError, check_outputs};
use crate::conformity::{DecisionParams, DecisionRule, GeneralTolerance};
use crate::inspection::{
    AlignmentMethod, DrawingParams, InspectionParams, InspectionSource, ReportFiles, decision_rule,
    general_tolerance,
};
use crate::io::mesh_file::MeshUnit;

#[derive(Debug, Args)]
pub(in crate::cli) struct InspectArguments {
    /// The features, as refine, features and probe write them, or the folder of a session
    #[arg(value_name = "FEATURES|SESSION")]
    pub features: PathBuf,
    /// Nominal values and tolerances, CSV or JSON (docs/inspect.md), or a CAD mesh whose features
    /// are the nominal ones: PLY, STL, OBJ
    #[arg(long, value_name = "FILE", required_unless_present = "write_nominal")]
    pub nominal: Option<PathBuf>,
    /// Unit of the coordinates in the CAD mesh of --nominal
    #[arg(long, value_name = "U", default_value = "mm")]
    pub nominal_unit: MeshUnit,
    /// General tolerance for sizes that have none of their own
    #[arg(long, value_name = "CLASS", value_parser = general_tolerance, conflicts_with = "tolerance_mm")]
    pub general: Option<GeneralTolerance>,
    /// … or the same tolerance ± for all of them, mm
    #[arg(long, value_name = "T")]
    pub tolerance_mm: Option<f64>,
    /// With a CAD mesh: also the position of each hole, slot, pocket and boss, within a zone of
    /// this diameter, mm
    #[arg(long, value_name = "D")]
    pub position_mm: Option<f64>,
    /// A feature is the nominal one where its centre is no farther off than this across its axis,
    /// mm
    #[arg(long, value_name = "R", default_value_t = InspectionParams::default().match_mm)]
    pub match_mm: f64,
    /// Brings drawing and part into one frame: best-fit, over all features that both have; or
    /// datums=NAME,NAME,NAME with names of characteristics, primary to tertiary. Positions are then
    /// about the frame of the drawing
    #[arg(long, value_name = "HOW")]
    pub align: Option<AlignmentMethod>,
    /// Writes nominal values to be edited, CSV or JSON, from the CAD mesh of --nominal or else from
    /// FEATURES; inspects nothing
    #[arg(long, value_name = "FILE")]
    pub write_nominal: Option<PathBuf>,
    /// The touches behind the features; by default touches.csv beside them
    #[arg(long, value_name = "CSV")]
    pub touches: Option<PathBuf>,
    /// The mesh of the picture; by default refined.ply beside the features
    #[arg(long, value_name = "MESH")]
    pub mesh: Option<PathBuf>,
    /// Unit of its coordinates
    #[arg(long, value_name = "U", default_value = "mm")]
    pub mesh_unit: MeshUnit,
    /// The scene that was touched with, for the state of its calibration; by default that of the
    /// session
    #[arg(long, value_name = "YAML")]
    pub scene: Option<PathBuf>,
    /// How it is decided: guard bands, or the measured value alone
    #[arg(long, value_name = "RULE", value_parser = decision_rule, default_value = DecisionParams::default().rule.name())]
    pub rule: DecisionRule,
    /// Probability of conformity that a pass needs, and of nonconformity that a fail needs
    #[arg(long, value_name = "P", default_value_t = DecisionParams::default().confidence)]
    pub confidence: f64,
    /// Coverage factor of the expanded uncertainties U = k u
    #[arg(long, value_name = "K", default_value_t = InspectionParams::default().coverage_factor)]
    pub k: f64,
    /// Name or number of the part
    #[arg(long, value_name = "NAME")]
    pub part: Option<String>,
    /// Serial number of the part
    #[arg(long, value_name = "S")]
    pub serial: Option<String>,
    /// Who inspected
    #[arg(long, value_name = "NAME")]
    pub operator: Option<String>,
    /// From which direction the picture is taken; by default the side that was touched
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        num_args = 3,
        allow_negative_numbers = true
    )]
    pub view: Option<Vec<f64>>,
    /// Output: the report, one file of HTML that prints
    #[arg(long, value_name = "HTML")]
    pub out: Option<PathBuf>,
    /// Output: the characteristics as a table
    #[arg(long, value_name = "CSV")]
    pub csv: Option<PathBuf>,
    /// Output: the results as QIF 3.0
    #[arg(long, value_name = "QIF")]
    pub qif: Option<PathBuf>,
    /// Prints the results as JSON
    #[arg(long)]
    pub json: bool,
}

impl InspectArguments {
    /// Checks flags and places of outputs before the work begins.
    pub(super) fn check(&self) -> Result<(), CliError> {
        let outputs = [("--out", ".html", &self.out), ("--csv", ".csv", &self.csv)];
        let inputs = [
            Some(&self.features),
            self.nominal.as_ref(),
            self.touches.as_ref(),
            self.mesh.as_ref(),
            self.scene.as_ref(),
        ];
        check_outputs(&outputs, &inputs, "read: choose another place")?;
        let is_xml = self
            .qif
            .as_ref()
            .and_then(|path| path.extension())
            .is_some_and(|end| end.eq_ignore_ascii_case("xml"));
        let ending = if is_xml { ".xml" } else { ".qif" };
        check_outputs(
            &[("--qif", ending, &self.qif)],
            &inputs,
            "read: choose another place",
        )?;
        check_outputs(
            &[("--write-nominal", "", &self.write_nominal)],
            &inputs,
            "read: choose another place",
        )?;
        self.params().check()?;
        view_from(self.view.as_ref()).map(drop)
    }

    /// How it is inspected.
    pub(super) fn params(&self) -> InspectionParams {
        InspectionParams {
            drawing: DrawingParams {
                unit: self.nominal_unit,
                general: self.general,
                tolerance_mm: self.tolerance_mm,
                position_mm: self.position_mm,
            },
            decision: DecisionParams {
                rule: self.rule,
                confidence: self.confidence,
            },
            coverage_factor: self.k,
            match_mm: self.match_mm,
            align: self.align.clone(),
            part: self.part.clone(),
            serial: self.serial.clone(),
            operator: self.operator.clone(),
        }
    }

    /// Where the report goes; JSON goes to stdout.
    pub(super) fn files(&self) -> ReportFiles {
        ReportFiles {
            html: self.out.clone(),
            csv: self.csv.clone(),
            json: None,
            qif: self.qif.clone(),
        }
    }

    /// Reads what was measured.
    pub(super) fn source(&self) -> Result<InspectionSource, CliError> {
        let _reading = WorkProgress::stage("read");
        let named = [
            self.touches.as_deref(),
            self.mesh.as_deref(),
            self.scene.as_deref(),
        ];
        Ok(InspectionSource::read(&self.features, named)?)
    }
}
