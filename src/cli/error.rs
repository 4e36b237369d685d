//! What a verb ends with: an error, or the losses of work that was done.

use std::error::Error;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::io::features_file::FeaturesFileError;
use crate::io::file_error::FileError;
use crate::io::mesh_file::MeshFileError;
use crate::io::recording::RecordingError;
use crate::io::touches_file::TouchesFileError;
use crate::replay::ReplayError;
#[cfg(any(feature = "ros", feature = "r2r"))]
use crate::ros::node::NodeError;
use crate::session::OutcomeError;
use crate::sim::SimError;

/// Losses of work that was done; empty: none.
pub(super) type Losses = Vec<String>;

/// Error of a verb.
#[derive(Debug, thiserror::Error)]
pub(super) enum CliError {
    /// A well-formed flag with an impossible value.
    #[error("{0}; see --help")]
    Usage(String),
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    #[error(transparent)]
    ReadMesh(MeshFileError),
    /// The same of the true part, which has a flag of its own.
    #[error("{}", .0.to_string().replace("--mesh-unit", "--truth-unit"))]
    ReadTruth(#[source] MeshFileError),
    #[error(transparent)]
    ReadRecording(RecordingError),
    #[error(transparent)]
    WriteMesh(MeshFileError),
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    WriteRecording(RecordingError),
    #[error(transparent)]
    Session(#[from] crate::session::SessionError),
    #[error(transparent)]
    Touches(#[from] TouchesFileError),
    #[error(transparent)]
    Features(#[from] FeaturesFileError),
    #[error(transparent)]
    Simulate(#[from] SimError),
    #[error(transparent)]
    Mesh(#[from] crate::mesh::MeshError),
    #[error(transparent)]
    Setting(#[from] crate::stylus::SettingError),
    #[error("cannot read stdin or write stdout: {0}")]
    Stream(#[from] std::io::Error),
    #[error("the scan cannot be refined: {0}")]
    Refine(#[from] crate::haptic::RefineError),
    #[error(transparent)]
    Table(#[from] crate::io::table::TableError),
    #[error("{path}: {error}", path = path.display())]
    Calibration { path: PathBuf, error: Box<dyn Error + Send + Sync> },
    #[error(transparent)]
    Live(#[from] crate::live::LiveError),
    #[error("the mesh cannot be aligned with the truth: {0}")]
    Align(#[from] crate::align::IcpError),
    #[error(transparent)]
    AlignFeatures(#[from] crate::align::FeaturesError),
    #[error("{0}")]
    Arm(String),
    #[error("feature {0}: {1}")]
    Explore(u32, crate::probing::plan::ExploreError),
    #[error(transparent)]
    Report(#[from] NoReport),
    #[error("the two cannot be compared: {0}")]
    Compare(#[from] crate::compare::CompareError),
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[error(transparent)]
    RosArguments(#[from] crate::ros::arguments::ArgumentError),
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[error(transparent)]
    Node(#[from] NodeError),
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[error(transparent)]
    Ros(#[from] crate::ros::RosError),
    #[cfg(feature = "ur")]
    #[error(transparent)]
    UrSetup(#[from] crate::ur::SetupError),
    #[cfg(feature = "ur")]
    #[error(transparent)]
    UrChild(#[from] crate::ur::child::ChildError),
}

impl From<ReplayError> for CliError {
    fn from(error: ReplayError) -> Self {
        match error {
            ReplayError::Markers(what) => Self::Usage(what),
            ReplayError::Read(error) => Self::ReadRecording(error),
            ReplayError::Setting(error) => Self::Setting(error),
        }
    }
}

impl From<OutcomeError> for CliError {
    fn from(error: OutcomeError) -> Self {
        match error {
            OutcomeError::WriteMesh(error) => Self::WriteMesh(error),
            OutcomeError::ReadMesh(error) => Self::ReadMesh(error),
            OutcomeError::Touches(error) => Self::Touches(error),
            OutcomeError::Features(error) => Self::Features(error),
            OutcomeError::Mesh(error) => Self::Mesh(error),
        }
    }
}

impl CliError {
    /// What is wrong in a file of a calibration.
    pub fn calibration(path: &Path, error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Calibration { path: path.to_owned(), error: error.into() }
    }

    /// What an arm, or its work, came to.
    pub fn arm(error: impl Display) -> Self {
        Self::Arm(error.to_string())
    }

    /// Kind of the error, as `--json` names it, and exit code.
    pub fn kind_and_exit_code(&self) -> (&'static str, u8) {
        match self {
            Self::Usage(_) => ("usage", 2),
            Self::WriteMesh(_) | Self::WriteRecording(_) | Self::Write { .. } | Self::Stream(_) => ("not_written", 1),
            Self::Touches(TouchesFileError::File(FileError::Write { .. })) => ("not_written", 1),
            Self::Features(FeaturesFileError::File(FileError::Write { .. })) => ("not_written", 1),
            // settings come from a scene file: its flags are checked before
            Self::Scene(_) | Self::Setting(_) => ("scene", 3),
            Self::ReadMesh(_) | Self::ReadTruth(_) | Self::Mesh(_) => ("mesh", 3),
            Self::ReadRecording(_) => ("recording", 3),
            Self::Session(_) => ("session", 3),
            Self::Touches(_) => ("touches", 3),
            Self::Features(_) => ("features", 3),
            Self::Simulate(SimError::BadParameter { .. } | SimError::TooFine { .. } | SimError::TooCoarse { .. }) => {
                ("simulation", 2)
            }
            Self::Simulate(_) => ("simulation", 3),
            Self::Refine(_) | Self::Live(_) => ("refinement", 3),
            Self::Table(_) | Self::Calibration { .. } => ("calibration", 3),
            Self::Align(_) | Self::AlignFeatures(_) => ("alignment", 3),
            Self::Arm(_) => ("arm", 1),
            Self::Explore(..) => ("plan", 2),
            Self::Report(_) => ("report", 1),
            Self::Compare(_) => ("comparison", 3),
            #[cfg(any(feature = "ros", feature = "r2r"))]
            Self::RosArguments(_) => ("usage", 2),
            #[cfg(any(feature = "ros", feature = "r2r"))]
            Self::Ros(_) => ("ros", 1),
            #[cfg(any(feature = "ros", feature = "r2r"))]
            Self::Node(error) => match error {
                NodeError::NoScan | NodeError::RegionWithRobot => ("node", 2),
                NodeError::Scene(_) | NodeError::Scan(_) | NodeError::NothingMoves => ("node", 3),
                NodeError::Setting(_) | NodeError::Refine(_) | NodeError::Live(_) => ("node", 3),
                _ => ("node", 1),
            },
            #[cfg(feature = "ur")]
            Self::UrSetup(_) | Self::UrChild(_) => ("arm", 1),
        }
    }
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum NoReport {
    /// It is not installed.
    #[error(
        "touchup-report is neither beside this program nor on the path: `cargo install --locked --path crates/touchup-report` in \
         touchup's folder puts it there, `cargo run --release -p touchup-report -- --out out` does without"
    )]
    Missing,
    /// It does not start.
    #[error("cannot start {}: {source}", path.display())]
    Start {
        /// the program
        path: PathBuf,
        /// why not
        source: std::io::Error,
    },
}
