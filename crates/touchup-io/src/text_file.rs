//! Texts as whole files.

use std::io::Write;
use std::path::Path;

use super::file_error::{FileError, read_file, write_file};

/// # Errors
/// [`FileError::Read`], also where it is no UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let no_text = |error| {
        let source = std::io::Error::new(std::io::ErrorKind::InvalidData, error);
        FileError::Read { path: path.to_owned(), source }
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

/// Bytes as a file, for readers of files; it vanishes when this is dropped.
#[derive(Debug)]
pub struct TemporaryFile {
    file: tempfile::NamedTempFile,
}

impl TemporaryFile {
    /// - `name`: has the ending that readers look at.
    ///
    /// # Errors
    /// [`FileError::Write`]
    pub fn new(name: &Path, bytes: &[u8]) -> Result<Self, FileError> {
        let ending = name.file_name().and_then(|name| Some(name.to_str()?.split_once('.')?.1));
        let ending = ending.map_or(String::new(), |ending| format!(".{ending}"));
        let write = || {
            let mut file = tempfile::Builder::new().prefix("touchup-").suffix(&ending).tempfile()?;
            file.write_all(bytes)?;
            file.flush()?;
            Ok(file)
        };
        let file = write().map_err(|source| FileError::Write { path: name.to_owned(), source })?;
        Ok(Self { file })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.file.path()
    }
}
