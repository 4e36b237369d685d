//! Tables whose first row names the columns, in any order, as `table_rows` reads them.

use std::path::{Path, PathBuf};

use super::table_rows::{DecimalSign, RowError, TableRows};
use crate::file_error::{FileError, read_up_to};

/// Longest file: more than a hundred thousand rows.
const MAX_BYTES: u64 = 16 << 20;

/// Why a table is refused.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// A failed read.
    #[error(transparent)]
    Io(#[from] FileError),
    /// A faulty line.
    #[error("{}, line {line}: {why}", path.display())]
    Line {
        /// the file
        path: PathBuf,
        /// from 1 on
        line: usize,
        /// the fault, and the remedy
        why: String,
    },
}

/// The columns of a table.
#[derive(Clone, Copy)]
pub(crate) struct WantedColumns<'a> {
    /// required numbers
    pub needed: &'a [&'a str],
    /// optional numbers
    pub numbers: &'a [&'a str],
    /// optional texts
    pub texts: &'a [&'a str],
}

/// One row, its columns in the requested order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// its first line
    pub line: usize,
    /// finite
    pub needed: Vec<f64>,
    /// `None` for an empty value, or a missing column
    pub numbers: Vec<Option<f64>>,
    /// likewise
    pub texts: Vec<Option<String>>,
}

/// All rows with a value.
pub(crate) fn read_table(path: &Path, columns: WantedColumns<'_>) -> Result<Vec<Row>, TableError> {
    let bytes = read_up_to(path, MAX_BYTES).map_err(|source| FileError::Read {
        path: path.to_owned(),
        source,
    })?;
    parse(&bytes, columns).map_err(|(line, why)| TableError::Line {
        path: path.to_owned(),
        line,
        why,
    })
}

/// `Err`: the line, and its fault.
fn parse(bytes: &[u8], columns: WantedColumns<'_>) -> Result<Vec<Row>, (usize, String)> {
    let wrong = |error: RowError, line| (line, error.to_string());
    let mut rows = TableRows::open(bytes).map_err(|error| wrong(error, 1))?;
    let names: Vec<_> = rows.values().into_iter().map(str::to_owned).collect();
    let in_head = |why| (rows.line(), why);
    if names.is_empty() {
        let needed = columns.needed.join(",");
        let why = format!("there is nothing in it; its first line must be {needed}");
        return Err(in_head(why));
    }
    check_names(&names, columns).map_err(in_head)?;
    let mut found = Vec::new();
    loop {
        match rows.advance() {
            Err(error) => return Err(wrong(error, rows.line())),
            Ok(false) => return Ok(found),
            // spreadsheets save emptied rows
            Ok(true) if rows.values().iter().all(|value| value.is_empty()) => {}
            Ok(true) => {
                let mut sign = rows.sign;
                let line = rows.line();
                let row = row(line, &rows.values(), &names, columns, &mut sign);
                found.push(row.map_err(|why| (line, why))?);
                rows.sign = sign;
            }
        }
    }
}

/// Checks that each column is known and unique, and that none is missing.
fn check_names(names: &[String], columns: WantedColumns<'_>) -> Result<(), String> {
    let needed = columns.needed;
    let more = [columns.texts, columns.numbers].concat();
    if let Some(unknown) = names
        .iter()
        .find(|name| !needed.contains(&&***name) && !more.contains(&&***name))
    {
        let wanted = if more.is_empty() {
            String::new()
        } else {
            format!(", where wanted {}", more.join(" and "))
        };
        let known = needed.join(",");
        return Err(format!(
            "no column is called {unknown:?}; there are {known}{wanted}, set apart by commas, semicolons or tabs"
        ));
    }
    if let Some((_, twice)) = names
        .iter()
        .enumerate()
        .find(|(i, name)| names[..*i].contains(name))
    {
        return Err(format!("the column {twice} is there twice"));
    }
    let missing = needed
        .iter()
        .find(|column| names.iter().all(|name| name != *column));
    missing.map_or(Ok(()), |column| {
        Err(format!("the column {column} is missing"))
    })
}

fn row(
    line: usize,
    values: &[&str],
    names: &[String],
    columns: WantedColumns<'_>,
    sign: &mut DecimalSign,
) -> Result<Row, String> {
    let (there, named) = (values.len(), names.len());
    if there != named {
        return Err(format!(
            "{there} values for {named} columns; a value with a separator in it needs quotation marks, and between commas decimals have a point"
        ));
    }
    let value = |column: &&str| {
        let at = names.iter().position(|name| name == column);
        at.map_or("", |at| values[at])
    };
    let mut number = |column: &&str| number(value(column), column, sign);
    Ok(Row {
        line,
        needed: columns
            .needed
            .iter()
            .map(&mut number)
            .collect::<Result<_, _>>()?,
        numbers: columns
            .numbers
            .iter()
            .map(|column| {
                (!value(column).is_empty())
                    .then(|| number(column))
                    .transpose()
            })
            .collect::<Result<_, _>>()?,
        texts: columns
            .texts
            .iter()
            .map(|column| Some(value(column).to_owned()).filter(|value| !value.is_empty()))
            .collect(),
    })
}

fn number(value: &str, column: &str, sign: &mut DecimalSign) -> Result<f64, String> {
    let Some(text) = sign.with_point(value) else {
        let sign = if sign.0 == Some(',') {
            "comma"
        } else {
            "point"
        };
        return Err(format!(
            "{column} is {value:?}, and the decimals of this table have a {sign}"
        ));
    };
    let parsed = text.parse::<f64>().ok().filter(|x| x.is_finite());
    parsed.ok_or_else(|| format!("{column} is {value:?} and must be a number"))
}
