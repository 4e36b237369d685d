//! Features and touches as a table: CSV, or Parquet, which pandas, Polars, DuckDB and Ray read with
//! its types.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use parquet::errors::ParquetError;
use serde_json::{Map, Value};

use crate::features_file::{FeatureFile, FeatureRecord, write_features};
use crate::file_error::{FileError, write_file};
use crate::file_kind::FileKind;
use crate::touches_file::{self, TouchesFileError, write_touches};
use touchup_method::stylus::ProbedPoint;

mod parquet_file;

/// Error of writing a table.
#[derive(Debug, thiserror::Error)]
pub enum ResultTableError {
    /// The system refused.
    #[error(transparent)]
    File(#[from] FileError),
    /// The columns do not fit Parquet.
    #[error("the table does not fit Parquet: {0}")]
    Parquet(#[from] ParquetError),
}

/// One value.
#[derive(Clone, Debug, PartialEq)]
enum ResultCell {
    Number(f64),
    Count(i64),
    Flag(bool),
    Text(String),
}

impl ResultCell {
    fn to_json(&self) -> Value {
        match self {
            Self::Number(number) => Value::from(*number),
            Self::Count(count) => Value::from(*count),
            Self::Flag(flag) => Value::from(*flag),
            Self::Text(text) => Value::from(text.clone()),
        }
    }
}

/// Columns of equal length; `None`: the row has no such value.
#[derive(Debug, Default)]
pub struct ResultTable {
    columns: Vec<(String, Vec<Option<ResultCell>>)>,
    rows: usize,
}

impl ResultTable {
    /// An empty table with the columns of this row, `Null` included; they stay even if no row has a
    /// value for them.
    pub fn with_columns_of(row: &[(String, Value)]) -> Self {
        let mut cells = Vec::new();
        for (name, value) in row {
            let value = if value.is_null() {
                &Value::Bool(false)
            } else {
                value
            };
            flatten(name, value, &mut cells);
        }
        Self {
            columns: cells
                .into_iter()
                .map(|(name, _)| (name, Vec::new()))
                .collect(),
            rows: 0,
        }
    }

    /// A row for each feature; a nested value's name follows its parent's after a `.`, coordinates
    /// end in `_x`, `_y`, `_z`.
    pub fn of_features(features: &[FeatureRecord]) -> Self {
        let mut table = Self::default();
        features
            .iter()
            .for_each(|feature| table.add_feature(&[], feature));
        table
    }

    /// Adds a row for a feature, behind the values `first` by their names.
    pub fn add_feature(&mut self, first: &[(&str, Value)], feature: &FeatureRecord) {
        // numbers and names alone cannot fail
        let of_feature = serde_json::to_value(feature).unwrap_or_default();
        self.add_json(&[first, &[("", of_feature)]].concat());
    }

    /// A row for each touch, with the columns and digits of a touches file.
    pub fn of_touches(touches: &[ProbedPoint]) -> Self {
        let mut table = Self::default();
        for (number, touch) in touches.iter().enumerate() {
            let line = touches_file::line_of(touch, number);
            table.add_touch(&touches_file::values_of(&line));
        }
        table
    }

    /// A row for each line of a touches file.
    ///
    /// # Errors
    /// [`TouchesFileError`]
    pub fn of_touches_file(path: &Path) -> Result<Self, TouchesFileError> {
        let mut table = Self::default();
        touches_file::read_rows(path, |values| table.add_touch(values))?;
        Ok(table)
    }

    fn add_touch(&mut self, values: &[Cow<'_, str>]) {
        let named = touches_file::HEADER.split(',').zip(values);
        self.add_row(
            named
                .map(|(name, value)| (name.to_owned(), touch_cell(name, value)))
                .collect(),
        );
    }

    /// Adds a row of values by their names, each name once; nested names as in features, `Null` is
    /// no value.
    pub fn add_json(&mut self, row: &[(impl AsRef<str>, Value)]) {
        let mut cells = Vec::new();
        row.iter()
            .for_each(|(name, value)| flatten(name.as_ref(), value, &mut cells));
        self.add_row(cells);
    }

    fn add_row(&mut self, cells: Vec<(String, ResultCell)>) {
        for (name, cell) in cells {
            let at = self
                .columns
                .iter()
                .position(|(known, _)| *known == name)
                .unwrap_or_else(|| {
                    self.columns.push((name, Vec::new()));
                    self.columns.len() - 1
                });
            let column = &mut self.columns[at].1;
            column.resize(self.rows, None);
            column.push(Some(cell));
        }
        self.rows += 1;
        self.columns
            .iter_mut()
            .for_each(|(_, column)| column.resize(self.rows, None));
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Each row as a JSON object, without missing values.
    pub fn json_rows(&self) -> Vec<Value> {
        let mut rows = vec![Map::new(); self.rows];
        for (name, column) in &self.columns {
            for (row, cell) in rows.iter_mut().zip(column) {
                if let Some(cell) = cell {
                    row.insert(name.clone(), cell.to_json());
                }
            }
        }
        rows.into_iter().map(Value::Object).collect()
    }

    /// Writes the table, as a whole or not at all: Parquet by the file's ending, else CSV.
    ///
    /// # Errors
    /// [`ResultTableError`]
    pub fn write(&self, path: &Path) -> Result<(), ResultTableError> {
        Ok(if FileKind::of(path) == Some(FileKind::Parquet) {
            let bytes = self.parquet()?;
            write_file(path, |out| out.write_all(&bytes))
        } else {
            write_file(path, |out| self.csv(out))
        }?)
    }

    fn csv(&self, out: impl Write) -> io::Result<()> {
        let mut rows = csv::Writer::from_writer(out);
        rows.write_record(self.columns.iter().map(|(name, _)| name))?;
        for row in 0..self.rows {
            let cells = self.columns.iter().map(|(_, column)| column[row].as_ref());
            rows.write_record(cells.map(text_of).collect::<Vec<_>>())?;
        }
        rows.flush()
    }
}

/// Whether the file name's ending means a table: CSV or Parquet.
pub fn is_table(path: &Path) -> bool {
    matches!(FileKind::of(path), Some(FileKind::Csv | FileKind::Parquet))
}

/// Writes features in the form of the ending, as a whole or not at all: a [table](is_table), else
/// JSON.
///
/// # Errors
/// [`ResultTableError`]
pub fn write_features_as_named(path: &Path, file: &FeatureFile) -> Result<(), ResultTableError> {
    match is_table(path) {
        true => ResultTable::of_features(&file.features).write(path),
        false => Ok(write_features(path, file)?),
    }
}

/// Writes touches in the form of the ending, as a whole or not at all: Parquet, else a [touches
/// file](touches_file).
///
/// # Errors
/// [`ResultTableError`]
pub fn write_touches_as_named(
    path: &Path,
    touches: &[ProbedPoint],
) -> Result<(), ResultTableError> {
    match FileKind::of(path) == Some(FileKind::Parquet) {
        true => ResultTable::of_touches(touches).write(path),
        false => Ok(write_touches(path, touches)?),
    }
}

fn text_of(cell: Option<&ResultCell>) -> String {
    match cell {
        None => String::new(),
        Some(ResultCell::Number(number)) => number.to_string(),
        Some(ResultCell::Count(count)) => count.to_string(),
        Some(ResultCell::Flag(flag)) => flag.to_string(),
        Some(ResultCell::Text(text)) => text.clone(),
    }
}

/// A record's value as table text: a number without exponent, `null` empty.
pub(crate) fn cell_text(value: Option<&Value>) -> String {
    let mut cells = Vec::new();
    flatten("", value.unwrap_or(&Value::Null), &mut cells);
    text_of(cells.first().map(|(_, cell)| cell))
}

fn touch_cell(name: &str, value: &str) -> ResultCell {
    let count = || value.parse().map(ResultCell::Count).ok();
    let number = || value.parse().map(ResultCell::Number).ok();
    let cell = match name {
        "rejected" => Some(ResultCell::Flag(value == "1")),
        "touch" | "stamp_ns" | "stroke" => count(),
        _ => number(),
    };
    cell.unwrap_or_else(|| ResultCell::Text(value.to_owned()))
}

/// Adds the values inside `value` by their names.
fn flatten(name: &str, value: &Value, cells: &mut Vec<(String, ResultCell)>) {
    let mut add = |cell| cells.push((name.to_owned(), cell));
    match value {
        Value::Null => {}
        Value::Bool(flag) => add(ResultCell::Flag(*flag)),
        Value::String(text) => add(ResultCell::Text(text.clone())),
        Value::Number(number) => match number.as_i64() {
            Some(count) => add(ResultCell::Count(count)),
            None => add(ResultCell::Number(number.as_f64().unwrap_or(f64::NAN))),
        },
        Value::Array(values) if values.len() == 3 && values.iter().all(Value::is_number) => {
            for (axis, value) in ["x", "y", "z"].into_iter().zip(values) {
                flatten(&format!("{name}_{axis}"), value, cells);
            }
        }
        // keeps values of variable length as JSON
        Value::Array(_) => add(ResultCell::Text(value.to_string())),
        Value::Object(values) => {
            for (key, value) in values {
                let inner = if name.is_empty() {
                    key.clone()
                } else {
                    format!("{name}.{key}")
                };
                flatten(&inner, value, cells);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(table: &ResultTable) -> String {
        let mut text = Vec::new();
        table.csv(&mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn what_is_nested_has_its_name_and_what_is_missing_is_empty() {
        let mut table = ResultTable::default();
        for json in [
            r#"{"id":1,"center_mm":[1,2.5,3],"size":{"diameter_mm":5.5}}"#,
            r#"{"id":2,"kind":"a, b","ids":[1,2]}"#,
        ] {
            let mut cells = Vec::new();
            flatten("", &serde_json::from_str(json).unwrap(), &mut cells);
            cells.sort_by(|a, b| a.0.cmp(&b.0));
            table.add_row(cells);
        }
        let expected = "center_mm_x,center_mm_y,center_mm_z,id,size.diameter_mm,ids,kind\n1,2.5,3,1,5.5,,\n,,,2,,\"[1,2]\",\"a, b\"\n";
        assert_eq!(csv(&table), expected);
        let parquet = table.parquet().unwrap();
        assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1"));
    }

    #[test]
    fn a_column_that_is_named_is_there_without_a_value() {
        let row = [
            ("job".to_owned(), Value::from(7)),
            ("failed".to_owned(), Value::Null),
        ];
        let mut table = ResultTable::with_columns_of(&row);
        table.add_json(&row);
        assert_eq!(csv(&table), "job,failed\n7,\n");
        assert_eq!(table.json_rows(), [serde_json::json!({ "job": 7 })]);
        assert!(table.parquet().unwrap().ends_with(b"PAR1"));
    }
}
