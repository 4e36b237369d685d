//! `touchup doctor`: checks a recording against its scan.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::common::progress::WorkProgress;
use super::common::recorded::RecordingFlags;
use super::common::told::{ToldFlags, ToldNumbers};
use super::{CliError, Losses, print_report};
use touchup_features::diagnose::InputFinding;
use touchup_io::mesh_file::MeshUnit;
use touchup_session::input_check::{InputCheck, check_input};
use touchup_session::refinement::{AcceptedFinding, InputNames, WrenchOffset, refuse_unsound};
use touchup_session::scan::read_scan;

#[derive(Debug, Args)]
pub(super) struct DoctorArguments {
    /// Scan: mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57)
    #[arg(value_name = "SCAN")]
    scan: PathBuf,
    /// Recording of the touches: MCAP or SQLite of ROS 2 (file or folder), bag of ROS 1, or table
    /// (CSV, log of a UR's RTDE)
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// Unit of the coordinates in the scan's file
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Scene with tip, frames, thresholds and pairing; the flags below override it
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    recorded: RecordingFlags,
    #[command(flatten)]
    told: ToldFlags,
    /// Prints the findings as one JSON object
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Diagnosis {
    /// Whether no finding is sure.
    is_sound: bool,
    /// Settings of tip and scan, and their sources.
    told: ToldNumbers,
    /// Clock offset from scene and recording together.
    wrench_offset: Option<WrenchOffset>,
    /// Findings, surest first, and the settings that take them off.
    findings: Vec<AcceptedFinding>,
}

/// Settings, then a line for each finding.
impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.told)?;
        if self.findings.is_empty() {
            return write!(f, "\nnothing speaks against scan and recording");
        }
        self.findings
            .iter()
            .try_for_each(|AcceptedFinding { finding, settings }| {
                write!(f, "\n{finding}")?;
                let mut settings = settings.iter();
                settings.try_for_each(|setting| write!(f, "\n  taken off by {setting}"))
            })
    }
}

/// Runs `touchup doctor`: replays, prints a line for each finding, and fails at a sure one.
pub(super) fn doctor(arguments: &DoctorArguments) -> Result<Losses, CliError> {
    let (scene, told) = arguments.told.scene(arguments.scene.as_deref())?;
    let scan = read_scan(&arguments.scan, arguments.mesh_unit)?.mesh;
    let (recording, markers) = arguments.recorded.open(&arguments.recording, &scene)?;
    let mut progress = WorkProgress::new("replay", recording.message_count());
    let found = check_input(recording, &scan, &scene, markers, &mut || progress.step())?;
    let InputCheck {
        findings,
        clock_offset,
        losses,
    } = found;
    let wrench_offset = clock_offset.map(|found| WrenchOffset::of(&found, &scene.sync_params()));
    let sure = findings.iter().filter(|finding| finding.is_sure).count();
    let accepted = |finding: &InputFinding| AcceptedFinding::of(finding.clone(), &scene);
    let diagnosis = Diagnosis {
        is_sound: sure == 0,
        told,
        wrench_offset,
        findings: findings.iter().map(accepted).collect(),
    };
    print_report(arguments.json, &diagnosis, || diagnosis.to_string())?;
    let names = InputNames {
        scan: &arguments.scan,
        recording: &arguments.recording,
    };
    refuse_unsound(&findings, names)?;
    Ok(losses)
}
