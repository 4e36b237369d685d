//! What can be wrong with a file of nominal values.

use std::path::PathBuf;

use crate::file_error::FileError;
use crate::table::TableError;

/// Why a file of nominal values is refused.
#[derive(Debug, thiserror::Error)]
pub enum NominalFileError {
    /// It could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// It is no table.
    #[error("{0}")]
    Table(#[from] TableError),
    /// It is no JSON, or has another form.
    #[error("{} is no file of nominal values: {source}; see docs/inspect.md", path.display())]
    Json {
        /// the file
        path: PathBuf,
        /// why, with line and column
        source: serde_json::Error,
    },
    /// A characteristic that is wrong.
    #[error("{}, {place}: {why}", path.display())]
    Characteristic {
        /// the file
        path: PathBuf,
        /// line of a table, or number of a characteristic
        place: String,
        /// what is wrong, and what to do
        why: String,
    },
    /// Nothing is in it.
    #[error("{}: it has no characteristic: add one line for each, or begin with touchup inspect … --write-nominal", .0.display())]
    Empty(PathBuf),
}
