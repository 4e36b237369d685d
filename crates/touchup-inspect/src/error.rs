//! Errors of an inspection.

use std::io;
use std::path::PathBuf;

use super::alignment::AlignmentError;
use touchup_io::features_file::FeaturesFileError;
use touchup_io::file_error::FileError;
use touchup_io::mesh_file::MeshFileError;
use touchup_io::nominal_file::NominalFileError;
use touchup_io::touches_file::TouchesFileError;
use touchup_session::scan::ScanError;
use touchup_session::scene::SceneError;

/// Reason for a failed inspection.
#[derive(Debug, thiserror::Error)]
pub enum InspectionError {
    /// An impossible setting, by its flag.
    #[error("{0}")]
    Setting(String),
    /// A folder without measured features.
    #[error(
        "{} has no features.json: refine --features-out, features --out and probe write one; a session has it once it was saved",
        .0.display()
    )]
    NoFeatures(PathBuf),
    /// A CAD mesh alone.
    #[error(
        "a CAD mesh has no tolerances: name a general one by --general iso2768-m or --tolerance-mm"
    )]
    NoTolerance,
    /// The system failed to read a file.
    #[error("{}: {source}", path.display())]
    File {
        /// the file
        path: PathBuf,
        /// error of the system
        source: io::Error,
    },
    /// The file is no probing file.
    #[error("{}: {source}", path.display())]
    Probed {
        /// the file
        path: PathBuf,
        /// cause, with line and column
        source: serde_json::Error,
    },
    /// The file is no features file.
    #[error(transparent)]
    Features(#[from] FeaturesFileError),
    /// The file is no touches file.
    #[error(transparent)]
    Touches(#[from] TouchesFileError),
    /// Touches and features come from different measurements.
    #[error("{} has {count} touches and the features name touch {named}: it is of another measurement", path.display())]
    OtherTouches {
        /// touches file
        path: PathBuf,
        /// number of touches
        count: usize,
        /// number of the last touch that a feature names, from 0 on
        named: usize,
    },
    /// The file is no file of nominal values.
    #[error(transparent)]
    Nominal(#[from] NominalFileError),
    /// The drawing lacks something.
    #[error("{}: {why}", path.display())]
    Drawing {
        /// the file
        path: PathBuf,
        /// cause and remedy
        why: String,
    },
    /// The CAD mesh of the drawing is unreadable.
    #[error("{}", .0.to_string().replace("--mesh-unit", "--nominal-unit"))]
    DrawingMesh(#[source] ScanError),
    /// The alignment of drawing and part failed.
    #[error(transparent)]
    Alignment(#[from] AlignmentError),
    /// The mesh of the picture is unreadable.
    #[error(transparent)]
    Mesh(#[from] ScanError),
    /// The vertex data of the picture's mesh is unreadable.
    #[error(transparent)]
    Columns(#[from] MeshFileError),
    /// The scene file is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file of the report could not be written.
    #[error(transparent)]
    NotWritten(#[from] FileError),
}
