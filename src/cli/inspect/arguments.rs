//! Flags of `touchup inspect`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::common::pictures::ViewFlag;
use crate::cli::common::progress::WorkProgress;
use crate::cli::{CliError, check_outputs};
use touchup_inspect::{
    DrawingParams, InspectionParams, InspectionSource, ReportFiles, ReportParams,
};
use touchup_io::file_kind::FileKind;
use touchup_io::mesh_file::MeshUnit;

#[derive(Debug, Args)]
pub(in crate::cli) struct InspectArguments {
    /// Features, as refine, features and probe write them, or the folder of a session
    #[arg(value_name = "FEATURES|SESSION")]
    pub features: PathBuf,
    /// Nominal values and tolerances, CSV or JSON (docs/inspect.md), or a CAD mesh (PLY, STL, OBJ)
    /// with the nominal features
    #[arg(long, value_name = "FILE", required_unless_present = "write_nominal")]
    pub nominal: Option<PathBuf>,
    #[command(flatten)]
    drawing: DrawingParams,
    /// Writes nominal values for editing, CSV or JSON, from the CAD mesh of --nominal or else from
    /// FEATURES; inspects nothing
    #[arg(long, value_name = "FILE")]
    pub write_nominal: Option<PathBuf>,
    /// Touches behind the features; default: touches.csv beside them
    #[arg(long, value_name = "CSV")]
    pub touches: Option<PathBuf>,
    /// Mesh of the picture; default: refined.ply beside the features
    #[arg(long, value_name = "MESH")]
    pub mesh: Option<PathBuf>,
    /// Unit of the coordinates in the file of --mesh
    #[arg(long, value_name = "U", default_value = "mm")]
    pub mesh_unit: MeshUnit,
    /// Scene of the touches, for the state of its calibration; default: the session's
    #[arg(long, value_name = "YAML")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    report: ReportParams,
    #[command(flatten)]
    pub view: ViewFlag,
    #[command(flatten)]
    pub files: ReportFiles,
    /// Prints the results as JSON
    #[arg(long)]
    pub json: bool,
}

impl InspectArguments {
    /// Checks flags and outputs before the work begins.
    pub(super) fn check(&self) -> Result<(), CliError> {
        let ReportFiles { html, csv, qif, .. } = &self.files;
        let outputs = [("--out", ".html", html), ("--csv", ".csv", csv)];
        let inputs = [
            Some(&self.features),
            self.nominal.as_ref(),
            self.touches.as_ref(),
            self.mesh.as_ref(),
            self.scene.as_ref(),
        ];
        check_outputs(&outputs, &inputs, "read: choose another place")?;
        let ending = match qif.as_deref().and_then(FileKind::of) {
            Some(FileKind::Xml) => ".xml",
            _ => ".qif",
        };
        check_outputs(
            &[("--qif", ending, qif)],
            &inputs,
            "read: choose another place",
        )?;
        check_outputs(
            &[("--write-nominal", "", &self.write_nominal)],
            &inputs,
            "read: choose another place",
        )?;
        self.params().check()?;
        self.view.direction().map(drop)
    }

    /// Parameters of the inspection.
    pub(super) fn params(&self) -> InspectionParams {
        InspectionParams {
            drawing: self.drawing.clone(),
            report: self.report.clone(),
        }
    }

    /// Reads the measured features and their companions.
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
