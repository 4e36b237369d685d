//! Lines and numbers of text files.

use std::borrow::Cow;

use super::defect::Syntax;
use crate::file_error::FilePlace;

/// The lines of a file with their numbers; invalid UTF-8 is replaced by a mark.
pub(super) struct NumberedLines<'a> {
    bytes: &'a [u8],
    end_of_line: u8,
    at: usize,
    number: usize,
}

impl<'a> NumberedLines<'a> {
    /// `end_of_line`: the byte that ends a line; blanks and carriage returns at both ends of a line
    /// are cut off.
    pub fn new(bytes: &'a [u8], end_of_line: u8) -> Self {
        Self {
            bytes,
            end_of_line,
            at: 0,
            number: 0,
        }
    }

    pub fn next(&mut self) -> Option<Cow<'a, str>> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let len = rest
            .iter()
            .position(|&b| b == self.end_of_line)
            .unwrap_or(rest.len());
        self.at += len + 1;
        self.number += 1;
        Some(String::from_utf8_lossy(rest[..len].trim_ascii()))
    }

    /// Number of the last line, from 1.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Start of the next line, or the end of the file.
    pub fn offset(&self) -> usize {
        self.at.min(self.bytes.len())
    }
}

/// A coordinate or count; "nan" and "inf" are numbers here.
pub(super) fn number(word: Option<&str>, place: FilePlace) -> Result<f64, Syntax> {
    let word = word.ok_or_else(|| Syntax::unexpected(place, "a number", "the end of the line"))?;
    word.parse()
        .map_err(|_| Syntax::unexpected(place, "a number", word))
}
