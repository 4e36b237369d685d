//! What can be wrong with any file: it cannot be read or written, and the place of what is wrong in
//! it.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::atomic::{AtomicFile, write_atomically};

/// Why the system did not read or write a file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// the file
        path: PathBuf,
        /// what the system reports
        source: io::Error,
    },
    /// It could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// the file
        path: PathBuf,
        /// what the system reports
        source: io::Error,
    },
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePlace {
    /// counted from 1
    Line(usize),
    /// counted from 0; in a recording the offset of the record (for a chunk: of the whole chunk) in
    /// the MCAP stream
    Byte(u64),
    /// `id` in the table `messages`; what fails inside SQLite is placed at the last row that could
    /// be read
    Row(i64),
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(offset) => write!(f, "byte {offset}"),
            Self::Row(id) => write!(f, "row {id}"),
        }
    }
}

/// Longest file that is read as a whole: its numbers take several times that.
pub(super) const MAX_FILE_BYTES: u64 = 4 << 30;
/// … and longest input whose end is not known before, as that of a pipe.
const MAX_STREAM_BYTES: u64 = 256 << 20;

/// All bytes of a file, or of a pipe, that is not longer than `limit`, nor than
/// [`MAX_STREAM_BYTES`] where its end is not known before.
pub(super) fn read_up_to(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let info = file.metadata()?;
    let mut bytes = Vec::new();
    let limit = if info.is_file() {
        bytes.try_reserve(info.len().min(limit) as usize + 1)?;
        limit
    } else {
        limit.min(MAX_STREAM_BYTES)
    };
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let why = format!(
            "it is longer than {} MiB, and no end is near: reduce it first",
            limit >> 20
        );
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, why));
    }
    Ok(bytes)
}

/// All bytes of a file that is not longer than [`MAX_FILE_BYTES`].
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, FileError> {
    read_up_to(path, MAX_FILE_BYTES).map_err(|source| FileError::Read {
        path: path.to_owned(),
        source,
    })
}

/// As [`write_atomically`].
pub(super) fn write_file(
    path: &Path,
    write: impl FnOnce(&mut AtomicFile) -> io::Result<()>,
) -> Result<(), FileError> {
    write_atomically(path, write).map_err(|source| FileError::Write {
        path: path.to_owned(),
        source,
    })
}
