//! What can be wrong with an inspection.

use std::io;
use std::path::PathBuf;

use super::alignment::AlignmentError;
use crate::io::features_file::FeaturesFileError;
use crate::io::file_error::FileError;
use crate::io::mesh_file::MeshFileError;
use crate::io::nominal_file::NominalFileError;
use crate::io::touches_file::TouchesFileError;
use crate::scan::ScanError;
use crate::scene::SceneError;

/// Why a part is not inspected.
#[derive(Debug, thiserror::Error)]
pub enum InspectionError {
    /// A setting that cannot be, by its flag.
    #[error("{0}")]
    Setting(String),
    /// A folder without anything that was measured.
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
    /// The system did not read a file.
    #[error("{}: {source}", path.display())]
    File {
        /// the file
        path: PathBuf,
        /// what the system reports
        source: io::Error,
    },
    /// The file of a probing is none.
    #[error("{}: {source}", path.display())]
    Probed {
        /// the file
        path: PathBuf,
        /// why, with line and column
        source: serde_json::Error,
    },
    /// Features are read from a file that is none.
    #[error(transparent)]
    Features(#[from] FeaturesFileError),
    /// Touches are read from a file that is none.
    #[error(transparent)]
    Touches(#[from] TouchesFileError),
    /// Touches and features that are not of one measurement.
    #[error("{} has {count} touches and the features name touch {named}: it is of another measurement", path.display())]
    OtherTouches {
        /// the touches
        path: PathBuf,
        /// how many there are
        count: usize,
        /// number of the last touch that a feature names, from 0 on
        named: usize,
    },
    /// Nominal values are read from a file that is none.
    #[error(transparent)]
    Nominal(#[from] NominalFileError),
    /// The drawing lacks something.
    #[error("{}: {why}", path.display())]
    Drawing {
        /// the file
        path: PathBuf,
        /// what, and what to do
        why: String,
    },
    /// The CAD mesh of the drawing cannot be read.
    #[error("{}", .0.to_string().replace("--mesh-unit", "--nominal-unit"))]
    DrawingMesh(#[source] ScanError),
    /// Drawing and part are not brought into one frame.
    #[error(transparent)]
    Alignment(#[from] AlignmentError),
    /// The mesh of the picture cannot be read.
    #[error(transparent)]
    Mesh(#[from] ScanError),
    /// … or what is known of its vertices.
    #[error(transparent)]
    Columns(#[from] MeshFileError),
    /// The scene that was touched with is none.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file of the report cannot be written.
    #[error(transparent)]
    NotWritten(#[from] FileError),
}
