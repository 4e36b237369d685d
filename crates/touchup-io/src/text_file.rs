//! Texts as whole files.

use std::io::Write;
use std::path::Path;

use super::file_error::{FileError, read_file, write_file};

/// # Errors
/// [`FileError::Read`], also where it is no UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let no_text = |error| {
        let source = std::io::Error::new(std::io::ErrorKind::InvalidData, error);
        FileError::Read {
            path: path.to_owned(),
            source,
        }
    };
    String::from_utf8(read_file(path)?).map_err(no_text)
}

/// Writes it, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`]
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    write_file(path, |out| out.write_all(text.as_bytes()))
}
