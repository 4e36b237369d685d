//! Tables of text, row after row, in the forms of spreadsheets: values in quotation marks if they
//! hold a separator or a line end (RFC 4180), with a byte order mark, with either end of line.
//!
//! The separator is the first of semicolon, tab, comma and blank that the first row has outside of
//! quotation marks. Empty lines and lines that begin with `#` are skipped. Separator and decimal
//! sign hold for the whole file: between commas decimals have a point.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

/// Longest row: hundreds of columns. An unclosed quotation mark ends there.
pub(crate) const MAX_ROW_BYTES: usize = 64 << 10;

/// The fault of a row.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RowError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error(
        "it is longer than {MAX_ROW_BYTES} bytes: no table, or a quotation mark that is not closed"
    )]
    TooLong,
    #[error("a quotation mark is not closed")]
    Open,
    #[error("not UTF-8 text; save it as comma-separated values in UTF-8")]
    NotText,
}

/// The rows of a table, one after another.
pub(crate) struct TableRows<R> {
    input: R,
    /// of the values, unless blanks separate them
    parser: Option<Reader>,
    line: Vec<u8>,
    /// lines read
    at: usize,
    /// first line of the row, from 1
    first: usize,
    /// concatenated values, and their ends
    text: Vec<u8>,
    ends: Vec<usize>,
    width: usize,
    /// of all numbers
    pub sign: DecimalSign,
}

impl<R: BufRead> TableRows<R> {
    /// Reads the first row; an empty table has none, and no values.
    pub fn open(input: R) -> Result<Self, RowError> {
        let mut rows = Self {
            input,
            parser: None,
            line: Vec::new(),
            at: 0,
            first: 1,
            text: vec![0; MAX_ROW_BYTES],
            ends: vec![0; 64],
            width: 0,
            sign: DecimalSign(None),
        };
        if rows.next_line(false, MAX_ROW_BYTES)? {
            let separator = separator_of(&rows.line);
            rows.parser = separator.map(|separator| {
                let terminator = Terminator::Any(b'\n');
                ReaderBuilder::new()
                    .delimiter(separator)
                    .terminator(terminator)
                    .build()
            });
            rows.sign = DecimalSign((separator == Some(b',')).then_some('.'));
            rows.take_row()?;
        }
        Ok(rows)
    }

    /// Reads the next row; `false` at the end. Reading may continue after an error of one row.
    pub fn advance(&mut self) -> Result<bool, RowError> {
        self.width = 0;
        let is_there = self.next_line(false, MAX_ROW_BYTES)?;
        if is_there {
            self.take_row()?;
        }
        Ok(is_there)
    }

    /// The values of the last row, without blanks at their ends.
    pub fn values(&self) -> Vec<&str> {
        let mut start = 0;
        let ends = self.ends[..self.width].iter();
        let value = ends.map(|&end| {
            let value = str::from_utf8(&self.text[start..end]).unwrap_or_default();
            start = end;
            value.trim()
        });
        value.collect()
    }

    /// First line of the last row, from 1.
    pub fn line(&self) -> usize {
        self.first
    }

    /// Reads a line of not more than `limit` bytes; `false` at the end.
    ///
    /// - `is_within`: within a row, whose lines may be empty or begin with `#`.
    fn next_line(&mut self, is_within: bool, limit: usize) -> Result<bool, RowError> {
        loop {
            self.line.clear();
            let mut input = self.input.by_ref().take(limit as u64 + 1);
            let read = input.read_until(b'\n', &mut self.line)?;
            if read == 0 {
                return Ok(false);
            }
            self.at += 1;
            if !is_within {
                self.first = self.at;
            }
            if read > limit {
                return Err(RowError::TooLong);
            }
            str::from_utf8(&self.line).map_err(|_| RowError::NotText)?;
            if self.at == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
                self.line.drain(..3);
            }
            let text = self.line.trim_ascii();
            if is_within || !(text.is_empty() || text.starts_with(b"#")) {
                return Ok(true);
            }
        }
    }

    /// Splits the line into values, together with further lines of the same row.
    fn take_row(&mut self) -> Result<(), RowError> {
        let Some(mut parser) = self.parser.take() else {
            self.take_words();
            return Ok(());
        };
        let taken = self.take_values(&mut parser);
        parser.reset();
        self.parser = Some(parser);
        taken
    }

    fn take_values(&mut self, parser: &mut Reader) -> Result<(), RowError> {
        let (mut bytes, mut wrote, mut width) = (0, 0, 0);
        loop {
            if self.line.last() != Some(&b'\n') {
                self.line.push(b'\n');
            }
            bytes += self.line.len();
            let mut rest = &self.line[..];
            loop {
                let (result, read, text, ends) =
                    parser.read_record(rest, &mut self.text[wrote..], &mut self.ends[width..]);
                (rest, wrote, width) = (&rest[read..], wrote + text, width + ends);
                match result {
                    ReadRecordResult::OutputFull => self.text.resize(2 * self.text.len(), 0),
                    ReadRecordResult::OutputEndsFull => self.ends.resize(2 * self.ends.len(), 0),
                    ReadRecordResult::Record => {
                        self.width = width;
                        return Ok(());
                    }
                    // within quotation marks
                    ReadRecordResult::InputEmpty | ReadRecordResult::End => break,
                }
            }
            if !self.next_line(true, MAX_ROW_BYTES.saturating_sub(bytes))? {
                return Err(RowError::Open);
            }
        }
    }

    /// Values between blanks.
    fn take_words(&mut self) {
        self.text.clear();
        self.ends.clear();
        let words = self.line.split(u8::is_ascii_whitespace);
        for word in words.filter(|word| !word.is_empty()) {
            let word = word.strip_prefix(b"\"").unwrap_or(word);
            self.text.extend(word.strip_suffix(b"\"").unwrap_or(word));
            self.ends.push(self.text.len());
        }
        self.width = self.ends.len();
    }
}

/// The separator of the values of a row; `None`: blanks.
fn separator_of(row: &[u8]) -> Option<u8> {
    let is_outside = |separator: u8| {
        let mut is_quoted = false;
        row.iter().any(|&byte| {
            is_quoted ^= byte == b'"';
            byte == separator && !is_quoted
        })
    };
    [b';', b'\t', b',']
        .into_iter()
        .find(|&separator| is_outside(separator))
}

/// The decimal sign of a file: that of the first number which has one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DecimalSign(pub Option<char>);

impl DecimalSign {
    /// A number with a decimal point; `None` for another sign than before.
    pub fn with_point<'a>(&mut self, number: &'a str) -> Option<Cow<'a, str>> {
        match number
            .find([',', '.'])
            .map(|at| char::from(number.as_bytes()[at]))
        {
            None => Some(number.into()),
            Some(sign) if *self.0.get_or_insert(sign) != sign => None,
            Some(',') => Some(number.replace(',', ".").into()),
            Some(_) => Some(number.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &[u8]) -> Result<Vec<(usize, Vec<String>)>, String> {
        let mut rows = TableRows::open(text).map_err(|error| error.to_string())?;
        let mut all = Vec::new();
        loop {
            let values = rows.values().into_iter().map(str::to_owned).collect();
            all.push((rows.line(), values));
            if !rows.advance().map_err(|error| error.to_string())? {
                return Ok(all);
            }
        }
    }

    #[test]
    fn rows_are_read_as_spreadsheets_write_them() {
        let rows = [
            (2, ["name", "a; b", ""]),
            (4, ["2\" pipe, \"new\"", "two\nlines", "#3"]),
            (7, ["é", "4.5", "last"]),
        ];
        for separator in [",", ";", "\t"] {
            for end in ["\n", "\r\n"] {
                let text = "\u{feff}# \"a comment\n\"name\"|\"a; b\"|\"\"\n\n\"2\"\" pipe, \"\"new\"\"\"|\"two\nlines\"|#3\n#\n é |4.5 |\"last\"";
                let text = text.replace('|', separator).replace('\n', end);
                let found = all(text.as_bytes()).unwrap();
                let expected =
                    rows.map(|(line, values)| (line, values.map(|value| value.replace('\n', end))));
                assert_eq!(found.len(), expected.len(), "{text}");
                for (found, expected) in found.iter().zip(&expected) {
                    assert_eq!(
                        (found.0, &found.1[..]),
                        (expected.0, &expected.1[..]),
                        "{text}"
                    );
                }
            }
        }
        let blanks = all(b"a  \"b\" c\n 1 2\t3\n").unwrap();
        assert_eq!(
            blanks,
            [
                (1, vec!["a".into(), "b".into(), "c".into()]),
                (2, vec!["1".into(), "2".into(), "3".into()])
            ]
        );
        assert_eq!(all(b"\n# nothing\n").unwrap(), [(2, Vec::new())]);
    }

    #[test]
    fn a_row_without_end_is_refused_within_a_bound_of_memory() {
        let error = |text: &[u8]| all(text).unwrap_err();
        assert!(error(b"a,b\n1,\"2\n3,4\n").contains("is not closed"));
        assert!(error(b"a,\xff\n").contains("not UTF-8"));
        for [first, more] in [["a,b", "\0"], ["a,b\n1,\"2", "3,4\n"], ["a,b\n", "1,2,"]] {
            let input = first.as_bytes().chain(Endless(more.as_bytes()));
            let mut rows = TableRows::open(io::BufReader::new(input));
            let error = loop {
                match rows.as_mut().map(TableRows::advance) {
                    Ok(Ok(true)) => {}
                    Ok(Ok(false)) => panic!("{first}{more} has an end"),
                    Ok(Err(error)) => break error.to_string(),
                    Err(error) => break error.to_string(),
                }
            };
            assert_eq!(error, RowError::TooLong.to_string(), "{first}{more}");
        }
    }

    struct Endless(&'static [u8]);

    impl Read for Endless {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let len = into.len().min(self.0.len());
            into[..len].copy_from_slice(&self.0[..len]);
            Ok(len)
        }
    }

    #[test]
    fn one_decimal_sign_is_that_of_the_whole_file() {
        let mut sign = DecimalSign(None);
        let mut plain = |number: &'static str| sign.with_point(number).map(Cow::into_owned);
        assert_eq!(plain("12").as_deref(), Some("12"));
        assert_eq!(plain("-1,5e3").as_deref(), Some("-1.5e3"));
        assert_eq!(plain("1.5"), None);
        assert_eq!(plain("1.234,5"), None);
    }
}
