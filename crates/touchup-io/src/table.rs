//! Tables of numbers as comma-separated values, whose first line names the columns, in any order.
//!
//! Empty lines and lines that begin with `#` are passed over. No value holds a comma.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::file_error::FileError;

/// Longest file: more than a hundred thousand rows.
const MAX_BYTES: u64 = 16 << 20;

/// Why a table is refused.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// It cannot be read.
    #[error(transparent)]
    Io(#[from] FileError),
    /// It is too long, or no text.
    #[error("{}: {why}", path.display())]
    NotText {
        /// which file
        path: PathBuf,
        /// what is wrong
        why: &'static str,
    },
    /// A line that is wrong.
    #[error("{}, line {line}: {why}", path.display())]
    Line {
        /// which file
        path: PathBuf,
        /// from 1 on
        line: usize,
        /// what is wrong, and what to do
        why: String,
    },
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub line: usize,
    /// of the columns that must be there, in the order asked for; finite
    pub numbers: Vec<f64>,
    /// of those that may be there; `None` where it is not or is empty
    pub more: Vec<Option<String>>,
}

impl Row {
    /// A number of those that may be there.
    pub fn number(&self, which: usize, column: &str) -> Result<Option<f64>, String> {
        self.more[which]
            .as_deref()
            .map(|value| number(value, column))
            .transpose()
    }
}

/// - `columns`: numbers that must be there.
/// - `more`: columns that may be there.
pub(super) fn read_table(
    path: &Path,
    columns: &[&str],
    more: &[&str],
) -> Result<Vec<Row>, TableError> {
    let text = read_text(path)?;
    parse(&text, columns, more).map_err(|(line, why)| TableError::Line {
        path: path.to_owned(),
        line,
        why,
    })
}

fn read_text(path: &Path) -> Result<String, TableError> {
    let io = |source| FileError::Read {
        path: path.to_owned(),
        source,
    };
    let not_text = |why| TableError::NotText {
        path: path.to_owned(),
        why,
    };
    let mut bytes = Vec::new();
    File::open(path)
        .map_err(io)?
        .take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(not_text("longer than 16 MiB; that is no list made by hand"));
    }
    String::from_utf8(bytes)
        .map_err(|_| not_text("not UTF-8 text; save it as comma-separated values in UTF-8"))
}

/// `Err`: the line, and what is wrong in it.
pub(super) fn parse(
    text: &str,
    columns: &[&str],
    more: &[&str],
) -> Result<Vec<Row>, (usize, String)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let Some((at, first)) = lines.next() else {
        return Err((
            1,
            format!(
                "there is nothing in it; its first line must be {}",
                columns.join(",")
            ),
        ));
    };
    let names = split(first);
    check_names(&names, columns, more).map_err(|why| (at, why))?;
    lines
        .map(|(at, line)| row(at, line, &names, columns, more).map_err(|why| (at, why)))
        .collect()
}

/// Each column is known and there once, and none is missing.
fn check_names(names: &[&str], columns: &[&str], more: &[&str]) -> Result<(), String> {
    let (known, wanted) = (columns.join(","), more.join(" and "));
    if let Some(unknown) = names
        .iter()
        .find(|name| !columns.contains(name) && !more.contains(name))
    {
        let wanted = if more.is_empty() {
            String::new()
        } else {
            format!(", where wanted {wanted}")
        };
        return Err(format!(
            "no column is called {unknown:?}; there are {known}{wanted}, set apart by commas"
        ));
    }
    if let Some((_, twice)) = names
        .iter()
        .enumerate()
        .find(|(i, name)| names[..*i].contains(name))
    {
        return Err(format!("the column {twice} is there twice"));
    }
    let missing = columns.iter().find(|column| !names.contains(column));
    missing.map_or(Ok(()), |column| {
        Err(format!("the column {column} is missing"))
    })
}

fn row(
    line: usize,
    text: &str,
    names: &[&str],
    columns: &[&str],
    more: &[&str],
) -> Result<Row, String> {
    let values = split(text);
    let (there, named) = (values.len(), names.len());
    if there != named {
        return Err(format!(
            "{there} values for {named} columns; commas separate values only, decimals have a point"
        ));
    }
    let value = |column: &&str| {
        names
            .iter()
            .zip(&values)
            .find(|(name, _)| *name == column)
            .map(|(_, value)| *value)
    };
    let numbers = columns
        .iter()
        .map(|column| number(value(column).unwrap_or_default(), column));
    let more = more.iter().map(|column| {
        value(column)
            .filter(|value| !value.is_empty())
            .map(str::to_owned)
    });
    Ok(Row {
        line,
        numbers: numbers.collect::<Result<_, _>>()?,
        more: more.collect(),
    })
}

fn number(value: &str, column: &str) -> Result<f64, String> {
    let parsed = value.parse::<f64>().ok().filter(|x| x.is_finite());
    parsed.ok_or_else(|| format!("{column} is {value:?} and must be a number"))
}

fn split(line: &str) -> Vec<&str> {
    line.split(',')
        .map(|value| value.trim().trim_matches('"'))
        .collect()
}
