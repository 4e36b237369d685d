//! Nominal values as a table.

use std::io::Write;
use std::path::Path;

use super::error::NominalFileError;
use super::record::{DatumRecord, NominalRecord};
use crate::file_error::{FileError, write_file};
use crate::result_table::cell_text;
use crate::tables::table::{Row, TableError, WantedColumns, read_table};

/// The columns, in any order; columns without a value in any row are optional.
const COLUMNS: [(&str, &str); 23] = [
    ("name", "/name"),
    ("kind", "/kind"),
    ("quantity", "/quantity"),
    ("nominal_mm", "/nominal_mm"),
    ("tolerance_mm", "/tolerance_mm"),
    ("lower_deviation_mm", "/lower_deviation_mm"),
    ("upper_deviation_mm", "/upper_deviation_mm"),
    ("nominal_deg", "/nominal_deg"),
    ("tolerance_deg", "/tolerance_deg"),
    ("lower_deviation_deg", "/lower_deviation_deg"),
    ("upper_deviation_deg", "/upper_deviation_deg"),
    ("center_x_mm", "/center_mm/0"),
    ("center_y_mm", "/center_mm/1"),
    ("center_z_mm", "/center_mm/2"),
    ("axis_x", "/axis/0"),
    ("axis_y", "/axis/1"),
    ("axis_z", "/axis/2"),
    ("feature", "/feature"),
    ("datum_kind", "/datum/kind"),
    ("datum_x_mm", "/datum/center_mm/0"),
    ("datum_y_mm", "/datum/center_mm/1"),
    ("datum_z_mm", "/datum/center_mm/2"),
    ("datum_feature", "/datum/feature"),
];

/// Number of required columns.
const NEEDED: usize = 3;

/// Columns of texts or integers.
const TEXTS: [&str; 6] = [
    "name",
    "kind",
    "quantity",
    "feature",
    "datum_kind",
    "datum_feature",
];

pub(super) fn read(path: &Path) -> Result<Vec<(String, NominalRecord)>, NominalFileError> {
    let mut numbers = COLUMNS.map(|(column, _)| column).to_vec();
    numbers.retain(|column| !TEXTS.contains(column));
    let columns = WantedColumns {
        needed: &[],
        numbers: &numbers,
        texts: &TEXTS,
    };
    let rows = read_table(path, columns)?;
    let record = |row: &Row| match record_of(row, &numbers) {
        Ok(record) => Ok((format!("line {}", row.line), record)),
        Err(why) => Err(TableError::Line {
            path: path.to_owned(),
            line: row.line,
            why,
        }
        .into()),
    };
    rows.iter().map(record).collect()
}

fn record_of(row: &Row, numbers: &[&str]) -> Result<NominalRecord, String> {
    let at = |known: &[&str], column: &str| known.iter().position(|known| *known == column);
    let text = |column: &str| row.texts[at(&TEXTS, column)?].clone();
    let number = |column: &str| row.numbers[at(numbers, column)?];
    let needed = |column: &str| {
        text(column).ok_or_else(|| format!("{column} is empty or the column {column} is missing"))
    };
    let whole = |column: &str| {
        let wrong = |text: String| {
            text.parse()
                .map_err(|_| format!("{column} is {text:?} and must be the id of a feature"))
        };
        text(column).map(wrong).transpose()
    };
    let place = |columns: [&str; 3]| {
        let [x, y, z] = columns.map(number);
        match (x, y, z) {
            (Some(x), Some(y), Some(z)) => Ok(Some([x, y, z])),
            (None, None, None) => Ok(None),
            _ => Err(format!(
                "{} go together: fill in all three or none",
                columns.join(", ")
            )),
        }
    };
    let of_datum = (
        place(["datum_x_mm", "datum_y_mm", "datum_z_mm"])?,
        whole("datum_feature")?,
    );
    let datum = match (text("datum_kind"), of_datum) {
        (Some(kind), (center_mm, feature)) => Some(DatumRecord {
            kind,
            center_mm,
            feature,
        }),
        (None, (None, None)) => None,
        (None, _) => {
            return Err("datum_kind is empty: say which kind of feature the datum is".to_owned());
        }
    };
    Ok(NominalRecord {
        name: needed("name")?,
        kind: needed("kind")?,
        quantity: needed("quantity")?,
        nominal_mm: number("nominal_mm"),
        nominal_deg: number("nominal_deg"),
        tolerance_mm: number("tolerance_mm"),
        tolerance_deg: number("tolerance_deg"),
        lower_deviation_mm: number("lower_deviation_mm"),
        upper_deviation_mm: number("upper_deviation_mm"),
        lower_deviation_deg: number("lower_deviation_deg"),
        upper_deviation_deg: number("upper_deviation_deg"),
        center_mm: place(["center_x_mm", "center_y_mm", "center_z_mm"])?,
        axis: place(["axis_x", "axis_y", "axis_z"])?,
        feature: whole("feature")?,
        datum,
    })
}

pub(super) fn write(
    path: &Path,
    records: &[NominalRecord],
    comment: &[&str],
) -> Result<(), FileError> {
    let rows: Vec<_> = records.iter().map(fields_of).collect();
    let is_used = |column: usize| column < NEEDED || rows.iter().any(|row| !row[column].is_empty());
    let used: Vec<_> = (0..COLUMNS.len())
        .filter(|&column| is_used(column))
        .collect();
    write_file(path, |out| {
        comment
            .iter()
            .try_for_each(|line| writeln!(out, "# {line}"))?;
        // names that begin like a comment get quotation marks
        let mut rows_out = csv::WriterBuilder::new()
            .comment(Some(b'#'))
            .from_writer(out);
        rows_out.write_record(used.iter().map(|&column| COLUMNS[column].0))?;
        for row in &rows {
            rows_out.write_record(used.iter().map(|&column| &row[column]))?;
        }
        rows_out.flush()
    })
}

fn fields_of(record: &NominalRecord) -> [String; 23] {
    let value = serde_json::to_value(record).expect("names and finite numbers alone cannot fail");
    COLUMNS.map(|(_, place)| cell_text(value.pointer(place)))
}
