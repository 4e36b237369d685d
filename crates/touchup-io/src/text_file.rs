//! Texts as whole files.

use std::io::{self, Write};
use std::path::Path;

use super::file_error::{FileError, read_up_to, write_file};

/// Longest text: a scene, a record or a list, no table of samples.
const MAX_TEXT_BYTES: u64 = 64 << 20;

/// A text of not more than 64 MiB.
///
/// # Errors
/// [`FileError::Read`], also for invalid UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    read_text_up_to(path, MAX_TEXT_BYTES).map_err(|source| FileError::Read {
        path: path.to_owned(),
        source,
    })
}

/// A text of not more than `limit` bytes.
///
/// # Errors
/// Any system error; [`io::ErrorKind::InvalidData`] for invalid UTF-8,
/// [`io::ErrorKind::FileTooLarge`] for a longer one.
pub fn read_text_up_to(path: &Path, limit: u64) -> io::Result<String> {
    let no_text = |error| io::Error::new(io::ErrorKind::InvalidData, error);
    read_up_to(path, limit).and_then(|bytes| String::from_utf8(bytes).map_err(no_text))
}

/// Writes it, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`]
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    write_file(path, |out| out.write_all(text.as_bytes()))
}
