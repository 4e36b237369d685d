//! Faults of a file of nominal values.

use std::path::PathBuf;

use crate::file_error::FileError;
use crate::tables::table::TableError;

/// Why a file of nominal values is refused.
#[derive(Debug, thiserror::Error)]
pub enum NominalFileError {
    /// A failed read or write.
    #[error(transparent)]
    File(#[from] FileError),
    /// An invalid table.
    #[error("{0}")]
    Table(#[from] TableError),
    /// Invalid JSON, or another form.
    #[error("{} is no file of nominal values: {source}; see docs/inspect.md", path.display())]
    Json {
        /// the file
        path: PathBuf,
        /// why, with line and column
        source: serde_json::Error,
    },
    /// An invalid characteristic.
    #[error("{}, {place}: {why}", path.display())]
    Characteristic {
        /// the file
        path: PathBuf,
        /// line of a table, or number of a characteristic
        place: String,
        /// the fault, and the remedy
        why: String,
    },
    /// An empty file.
    #[error("{}: it has no characteristic: add one line for each, or begin with touchup inspect … --write-nominal", .0.display())]
    Empty(PathBuf),
}
