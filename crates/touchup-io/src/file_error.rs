//! Errors common to all files: failed reads and writes, and the place of a fault in a file.

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Take};
use std::path::{Path, PathBuf};

use super::atomic::{AtomicFile, write_atomically};

/// Why the system did not read or write a file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// A failed read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// the file
        path: PathBuf,
        /// the system's error
        source: io::Error,
    },
    /// A failed write.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// the file
        path: PathBuf,
        /// the system's error
        source: io::Error,
    },
}

/// Place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePlace {
    /// counted from 1
    Line(usize),
    /// counted from 0; in a recording the offset of the record (for a chunk: of the whole chunk) in
    /// the MCAP stream
    Byte(u64),
    /// `id` in the table `messages`; for failures inside SQLite the last readable row
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

/// Longest file for a read as a whole: its numbers take several times that.
pub(super) const MAX_FILE_BYTES: u64 = 4 << 30;
/// Longest input of unknown length, such as a pipe.
const MAX_STREAM_BYTES: u64 = 256 << 20;

/// A file or a pipe, with an error in place of bytes beyond a limit.
pub(super) struct LimitedFile {
    file: Take<File>,
    bytes: u64,
    limit: u64,
}

/// Opens a file no longer than `limit`, nor than [`MAX_STREAM_BYTES`] if its length is unknown.
pub(super) fn open_up_to(path: &Path, limit: u64) -> io::Result<LimitedFile> {
    let file = File::open(path)?;
    let info = file.metadata()?;
    let (bytes, limit) = match info.is_file() {
        true => (info.len(), limit),
        false => (0, limit.min(MAX_STREAM_BYTES)),
    };
    if bytes > limit {
        return Err(too_long(limit));
    }
    Ok(LimitedFile {
        file: file.take(limit + 1),
        bytes,
        limit,
    })
}

impl Read for LimitedFile {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(into)?;
        if read > 0 && self.file.limit() == 0 {
            return Err(too_long(self.limit));
        }
        Ok(read)
    }
}

fn too_long(limit: u64) -> io::Error {
    let why = format!("it is longer than {} MiB: reduce it first", limit >> 20);
    io::Error::new(io::ErrorKind::FileTooLarge, why)
}

/// All bytes behind [`open_up_to`].
pub(super) fn read_up_to(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut file = open_up_to(path, limit)?;
    let mut bytes = Vec::new();
    bytes.try_reserve(file.bytes as usize + 1)?;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// All bytes of a file no longer than [`MAX_FILE_BYTES`].
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_end_or_is_too_long_is_refused_with_the_limit() {
        let said = |read: io::Result<Vec<u8>>| read.unwrap_err().to_string();
        let endless = Path::new("/dev/zero");
        let wanted = "it is longer than 3 MiB: reduce it first";
        assert_eq!(said(read_up_to(endless, 3 << 20)), wanted);
        let stream = open_up_to(endless, u64::MAX - 1)
            .and_then(|mut file| io::copy(&mut file, &mut io::sink()));
        assert_eq!(
            stream.unwrap_err().to_string(),
            "it is longer than 256 MiB: reduce it first"
        );
        // a long sparse file is refused before any read
        let file = tempfile::NamedTempFile::new().unwrap();
        file.as_file().set_len(1 << 42).unwrap();
        assert_eq!(said(read_up_to(file.path(), 3 << 20)), wanted);
        file.as_file().set_len(3 << 20).unwrap();
        assert_eq!(read_up_to(file.path(), 3 << 20).unwrap().len(), 3 << 20);
    }
}
