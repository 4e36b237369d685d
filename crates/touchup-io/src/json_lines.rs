//! Files of one JSON object per line, read one line at a time.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::file_error::{FileError, FilePlace};

/// Longest line, bytes.
const LONGEST: u64 = 1 << 20;

/// Why a line was not read.
#[derive(Debug, thiserror::Error)]
pub enum JsonLineError {
    /// A system error.
    #[error(transparent)]
    File(#[from] FileError),
    /// Not a valid object.
    #[error("{}: {place}: {why}", path.display())]
    Line {
        /// the file
        path: PathBuf,
        /// line
        place: FilePlace,
        /// the fault
        why: String,
    },
}

/// The objects of a file, in its order; an error ends them.
#[derive(Debug)]
pub struct JsonLines<T> {
    path: PathBuf,
    reader: Option<BufReader<File>>,
    line: usize,
    of: PhantomData<T>,
}

impl<T: DeserializeOwned> JsonLines<T> {
    /// # Errors
    /// [`FileError::Read`]
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let file = File::open(path).map_err(|source| FileError::Read {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            path: path.to_owned(),
            reader: Some(BufReader::new(file)),
            line: 0,
            of: PhantomData,
        })
    }

    fn read(&mut self) -> Result<Option<T>, JsonLineError> {
        let Some(reader) = &mut self.reader else {
            return Ok(None);
        };
        let mut line = Vec::new();
        loop {
            line.clear();
            self.line += 1;
            let read = reader.by_ref().take(LONGEST).read_until(b'\n', &mut line);
            let count = read.map_err(|source| FileError::Read {
                path: self.path.clone(),
                source,
            })?;
            if count == 0 {
                return Ok(None);
            }
            if !line.trim_ascii().is_empty() {
                break;
            }
        }
        serde_json::from_slice(&line).map(Some).map_err(|error| {
            let why = error.to_string();
            let why = why
                .rsplit_once(" at line ")
                .map_or(&*why, |(why, _)| why)
                .to_owned();
            JsonLineError::Line {
                path: self.path.clone(),
                place: FilePlace::Line(self.line),
                why,
            }
        })
    }
}

impl<T: DeserializeOwned> Iterator for JsonLines<T> {
    type Item = Result<T, JsonLineError>;

    fn next(&mut self) -> Option<Self::Item> {
        let read = self.read();
        if !matches!(read, Ok(Some(_))) {
            self.reader = None;
        }
        read.transpose()
    }
}
