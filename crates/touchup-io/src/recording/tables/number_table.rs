//! A recording in table form: comma-separated values and their kin, a line for each instant.
//!
//! Separator and decimal sign hold for the whole table ([`crate::tables::table_rows`]). An empty place, or
//! NaN, in all columns of the position or of the force means no measurement at that instant.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use super::columns::{FoundColumns, OrientationColumns, ScaledColumn, TableColumns, WrenchAxes};
use crate::file_kind::FileKind;
use crate::recording::FilePlace;
use crate::recording::error::BadMessage;
use crate::recording::error::Damage;
use crate::recording::error::RecordingError;
use crate::tables::table_rows::{DecimalSign, MAX_ROW_BYTES, RowError, TableRows};
use touchup_method::stylus::{StampedPose, StampedWrench, Wrench, measured_rotation};

/// Number of first lines that must contain a usable one; unusable lines after them are only
/// counted.
const LOOKED_AT: usize = 16;

/// The rows of a table, one after another.
pub(in crate::recording) struct NumberTable {
    path: PathBuf,
    rows: TableRows<BufReader<File>>,
    columns: FoundColumns,
    width: usize,
}

/// Measurements of one instant.
pub(in crate::recording) struct TableRow {
    pub pose: Option<StampedPose>,
    pub wrench: Option<StampedWrench>,
}

/// Whether a file is a table by its name.
pub(in crate::recording) fn is_table(path: &Path) -> bool {
    use FileKind::{Csv, Log, Tsv, Txt};
    path.is_file() && matches!(FileKind::of(path), Some(Csv | Tsv | Txt | Log))
}

impl NumberTable {
    /// Opens a table and finds its columns.
    ///
    /// # Errors
    /// [`RecordingError::Io`]; [`RecordingError::Columns`] with the present columns, if their
    /// meaning is unclear.
    pub fn open(path: &Path, columns: &TableColumns) -> Result<Self, RecordingError> {
        let bad = |what: &str| RecordingError::Columns {
            path: path.to_owned(),
            what: what.to_owned(),
        };
        let rows = || {
            let file = File::open(path).map_err(|source| RecordingError::Io {
                path: path.to_owned(),
                source,
            })?;
            TableRows::open(BufReader::new(file)).map_err(|error| match error {
                RowError::NotText => bad("its first line is no UTF-8 text"),
                other => damaged(path, 1, other),
            })
        };
        let (rows, ahead) = (rows()?, rows()?);
        let names: Vec<String> = rows.values().into_iter().map(str::to_owned).collect();
        if names.is_empty() {
            return Err(bad("the table is empty; its first line names the columns"));
        }
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(bad(
                "its first line has numbers alone; it must name the columns",
            ));
        }
        let columns = columns.find(&names).map_err(|what| bad(&what))?;
        let table = |rows| Self {
            path: path.to_owned(),
            rows,
            columns: columns.clone(),
            width: names.len(),
        };
        match table(ahead).why_unusable()? {
            Some(why) => Err(bad(&why)),
            None => Ok(table(rows)),
        }
    }

    /// Reason why all first lines are unusable, by the first of them; `None` if one is usable.
    /// Reads them.
    fn why_unusable(&mut self) -> Result<Option<String>, RecordingError> {
        let mut why = None;
        for _ in 0..LOOKED_AT {
            match self.next_row()? {
                None => break,
                Some(Ok(_)) => return Ok(None),
                Some(Err(bad)) => why = why.or_else(|| Some(self.in_words(bad))),
            }
        }
        Ok(why)
    }

    /// The fault of the last line.
    fn in_words(&self, bad: BadMessage) -> String {
        let (line, width) = (self.rows.line(), self.width);
        let count = self.rows.values().len();
        match bad {
            BadMessage::Quaternion => format!(
                "the orientation in line {line} has not the length 1: a quaternion is x, y, z, w, a rotation vector has finite numbers"
            ),
            BadMessage::Stamp => {
                format!("the time in line {line} is no number, or too large")
            }
            _ if count != width => {
                format!(
                    "line {line} has {count} values for {width} columns: each line has all columns, and between commas decimals have a point"
                )
            }
            _ => format!(
                "line {line} has a value that is no number, or a vector of which a part is empty: all decimals have the same sign, a point where commas separate"
            ),
        }
    }

    /// Axes of the wrenches.
    pub fn wrench_axes(&self) -> WrenchAxes {
        self.columns.wrench_axes
    }

    /// Place of the last row.
    pub fn place(&self) -> FilePlace {
        FilePlace::Line(self.rows.line())
    }

    /// The next instant; `None` at the end. The inner error is an unusable line.
    pub fn next_row(&mut self) -> Result<Option<Result<TableRow, BadMessage>>, RecordingError> {
        match self.rows.advance() {
            Ok(is_there) => Ok(is_there.then(|| self.row())),
            Err(RowError::NotText) => Ok(Some(Err(BadMessage::Malformed))),
            Err(other) => Err(damaged(&self.path, self.rows.line(), other)),
        }
    }

    fn row(&mut self) -> Result<TableRow, BadMessage> {
        let mut sign = self.rows.sign;
        let row = self.row_of(&self.rows.values(), &mut sign)?;
        self.rows.sign = sign;
        Ok(row)
    }

    fn row_of(&self, values: &[&str], sign: &mut DecimalSign) -> Result<TableRow, BadMessage> {
        if values.len() != self.width {
            return Err(BadMessage::Malformed);
        }
        let FoundColumns {
            time,
            position,
            orientation,
            force,
            torque,
            ..
        } = &self.columns;
        let stamp_ns = sign
            .with_point(values[time.at])
            .and_then(|stamp| nanoseconds(&stamp, time.factor))
            .ok_or(BadMessage::Stamp)?;
        let pose = match vector(values, position, sign)? {
            Some(position) => {
                let pose_ot =
                    Isometry3::from_parts(position.into(), rotation(values, orientation, sign)?);
                Some(StampedPose { stamp_ns, pose_ot })
            }
            None => None,
        };
        let force = vector(values, force, sign)?;
        let torque = torque
            .as_ref()
            .map_or(Ok(None), |torque| vector(values, torque, sign))?
            .unwrap_or_default();
        let wrench = force.map(|force| StampedWrench {
            stamp_ns,
            wrench: Wrench { force, torque },
        });
        Ok(TableRow { pose, wrench })
    }
}

fn damaged(path: &Path, line: usize, error: RowError) -> RecordingError {
    let damage = match error {
        RowError::Io(error) => error.into(),
        RowError::TooLong => Damage::TooLong {
            what: "line",
            bytes: MAX_ROW_BYTES as u64 + 1,
            limit: MAX_ROW_BYTES as u64,
        },
        RowError::Open | RowError::NotText => Damage::Field("a value in quotation marks"),
    };
    RecordingError::Damaged {
        path: path.to_owned(),
        place: FilePlace::Line(line),
        damage,
    }
}

/// `None`: an empty place, or NaN.
fn number(
    values: &[&str],
    column: ScaledColumn,
    sign: &mut DecimalSign,
) -> Result<Option<f64>, BadMessage> {
    let value = values[column.at];
    if value.is_empty() {
        return Ok(None);
    }
    let number = sign
        .with_point(value)
        .and_then(|value| value.parse::<f64>().ok())
        .ok_or(BadMessage::Malformed)?;
    Ok(Some(number * column.factor).filter(|number| !number.is_nan()))
}

/// `None` when all three are empty.
fn vector(
    values: &[&str],
    columns: &[ScaledColumn; 3],
    sign: &mut DecimalSign,
) -> Result<Option<Vector3<f64>>, BadMessage> {
    let [x, y, z] = columns.map(|column| number(values, column, sign));
    match (x?, y?, z?) {
        (Some(x), Some(y), Some(z)) => Ok(Some(Vector3::new(x, y, z))),
        (None, None, None) => Ok(None),
        _ => Err(BadMessage::Malformed),
    }
}

fn rotation(
    values: &[&str],
    columns: &OrientationColumns,
    sign: &mut DecimalSign,
) -> Result<UnitQuaternion<f64>, BadMessage> {
    match columns {
        OrientationColumns::None => Ok(UnitQuaternion::identity()),
        OrientationColumns::RotationVector(turn) => {
            let turn =
                vector(values, turn, sign)?.filter(|turn| turn.iter().all(|x| x.is_finite()));
            turn.map(UnitQuaternion::from_scaled_axis)
                .ok_or(BadMessage::Quaternion)
        }
        OrientationColumns::Quaternion(quaternion) => {
            let mut numbers = [0.0; 4];
            for (into, column) in numbers.iter_mut().zip(quaternion) {
                *into = number(values, *column, sign)?.ok_or(BadMessage::Quaternion)?;
            }
            measured_rotation(Quaternion::from(numbers)).ok_or(BadMessage::Quaternion)
        }
    }
}

const NS_PER_S: f64 = 1e9;

/// A time in ns, rounded; integer and fractional part apart, as a time since 1970 in s has more
/// digits than a float.
fn nanoseconds(value: &str, factor: f64) -> Option<i64> {
    let unit_ns = (factor * NS_PER_S).round();
    let (sign, digits) = value
        .strip_prefix('-')
        .map_or((1.0, value), |digits| (-1.0, digits));
    let apart = digits.split_once('.').unwrap_or((digits, ""));
    let is_plain = [apart.0, apart.1]
        .iter()
        .all(|part| part.bytes().all(|byte| byte.is_ascii_digit()));
    let ns = match apart.0.parse::<i64>() {
        Ok(whole) if is_plain => {
            let fraction = format!("0.{}", if apart.1.is_empty() { "0" } else { apart.1 })
                .parse::<f64>()
                .ok()?;
            whole
                .checked_mul(unit_ns as i64)?
                .checked_add((fraction * unit_ns).round() as i64)?
        }
        _ => {
            let ns = digits.parse::<f64>().ok()? * unit_ns;
            (ns.abs() < i64::MAX as f64).then_some(ns.round() as i64)?
        }
    };
    Some(if sign < 0.0 { -ns } else { ns })
}

#[cfg(test)]
mod tests;
