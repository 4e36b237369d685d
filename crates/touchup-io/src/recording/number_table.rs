//! A recording that is a table: comma-separated values and their kin, a line for each instant.
//!
//! Values are separated by commas, semicolons, tabs or blanks, whichever the first line has;
//! decimals have a point. Empty lines and lines that begin with `#` are passed over. An empty
//! place, or NaN, in all columns of the position or of the force means that none was measured at
//! that instant. The lines are read here and not by the csv crate, whose memory grows with a
//! quotation mark that is never closed; no value of a recording holds a separator.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use super::columns::{Column, FoundColumns, OrientationColumns, TableColumns, WrenchAxes};
use super::{BadMessage, Damage, FilePlace, RecordingError};
use touchup_core::stylus::{StampedPose, StampedWrench, Wrench, measured_rotation};

/// Endings of the names of tables.
const ENDINGS: [&str; 4] = ["csv", "tsv", "txt", "log"];
/// Longest line: hundreds of columns.
const MAX_LINE_BYTES: u64 = 64 << 10;

/// A table of which none of the first lines can be used is refused; what comes after that many is
/// counted.
const LOOKED_AT: usize = 16;

/// The rows of a table, one after another.
pub(super) struct NumberTable {
    lines: TableLines,
    separator: char,
    columns: FoundColumns,
    width: usize,
}

/// What was measured at one instant.
pub(super) struct TableRow {
    pub pose: Option<StampedPose>,
    pub wrench: Option<StampedWrench>,
}

/// Whether a file is a table by its name.
pub(super) fn is_table(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    path.is_file() && ending.is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known))
}

/// The lines of a file that have something in them.
struct TableLines {
    path: PathBuf,
    input: BufReader<File>,
    line: Vec<u8>,
    /// of the last line read, from 1 on
    at: usize,
}

impl TableLines {
    fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = File::open(path).map_err(|source| RecordingError::Io {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            path: path.to_owned(),
            input: BufReader::new(file),
            line: Vec::new(),
            at: 0,
        })
    }

    /// Reads the next line; `false` at the end.
    fn advance(&mut self) -> Result<bool, RecordingError> {
        loop {
            self.line.clear();
            let read = self
                .input
                .by_ref()
                .take(MAX_LINE_BYTES + 1)
                .read_until(b'\n', &mut self.line);
            self.at += 1;
            let bytes = read.map_err(|error| self.damaged(error.into()))? as u64;
            if bytes == 0 {
                return Ok(false);
            }
            if bytes > MAX_LINE_BYTES {
                return Err(self.damaged(Damage::TooLong {
                    what: "line",
                    bytes,
                    limit: MAX_LINE_BYTES,
                }));
            }
            let text = self.line.trim_ascii();
            if !text.is_empty() && !text.starts_with(b"#") {
                return Ok(true);
            }
        }
    }

    fn damaged(&self, damage: Damage) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.clone(),
            place: FilePlace::Line(self.at),
            damage,
        }
    }
}

impl NumberTable {
    /// Opens a table and finds its columns.
    ///
    /// # Errors
    /// [`RecordingError::Io`]; [`RecordingError::Columns`] with the columns that are there, when
    /// they do not say what is what.
    pub fn open(path: &Path, columns: &TableColumns) -> Result<Self, RecordingError> {
        let mut lines = TableLines::open(path)?;
        let bad = |what: &str| RecordingError::Columns {
            path: path.to_owned(),
            what: what.to_owned(),
        };
        if !lines.advance()? {
            return Err(bad("the table is empty; its first line names the columns"));
        }
        let text =
            str::from_utf8(&lines.line).map_err(|_| bad("its first line is no UTF-8 text"))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text).trim();
        let separator = [',', ';', '\t']
            .into_iter()
            .find(|separator| text.contains(*separator))
            .unwrap_or(' ');
        let names: Vec<String> = split(text, separator)
            .into_iter()
            .map(str::to_owned)
            .collect();
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(bad(
                "its first line has numbers alone; it must name the columns",
            ));
        }
        let columns = columns.find(&names).map_err(|what| bad(&what))?;
        let mut ahead = Self {
            lines: TableLines::open(path)?,
            separator,
            columns: columns.clone(),
            width: names.len(),
        };
        match ahead.why_unusable()? {
            Some(why) => Err(bad(&why)),
            None => Ok(Self { lines, ..ahead }),
        }
    }

    /// Why none of the first lines can be used, by the first of them; `None` where one can. Reads
    /// them.
    fn why_unusable(&mut self) -> Result<Option<String>, RecordingError> {
        self.lines.advance()?;
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

    /// What is wrong with the last line.
    fn in_words(&self, bad: BadMessage) -> String {
        let (line, width) = (self.lines.at, self.width);
        let count = str::from_utf8(&self.lines.line)
            .map_or(0, |text| split(text.trim(), self.separator).len());
        match bad {
            BadMessage::Quaternion => format!(
                "the orientation in line {line} has not the length 1: a quaternion is x, y, z, w, a rotation vector has finite numbers"
            ),
            BadMessage::Stamp => {
                format!("the time in line {line} is no number, or too large: decimals have a point")
            }
            _ if count != width => {
                format!(
                    "line {line} has {count} values for {width} columns: decimals have a point, and each line has all columns"
                )
            }
            _ => format!(
                "line {line} has a value that is no number, or a vector of which a part is empty: decimals have a point"
            ),
        }
    }

    /// In whose axes the wrenches are.
    pub fn wrench_axes(&self) -> WrenchAxes {
        self.columns.wrench_axes
    }

    /// Where the last row is.
    pub fn place(&self) -> FilePlace {
        FilePlace::Line(self.lines.at)
    }

    /// The next instant; `None` at the end. The inner error is a line that cannot be used.
    pub fn next_row(&mut self) -> Result<Option<Result<TableRow, BadMessage>>, RecordingError> {
        Ok(self.lines.advance()?.then(|| self.row()))
    }

    fn row(&self) -> Result<TableRow, BadMessage> {
        let text = str::from_utf8(&self.lines.line).map_err(|_| BadMessage::Malformed)?;
        let values = split(text.trim(), self.separator);
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
        let stamp_ns = nanoseconds(values[time.at], time.factor).ok_or(BadMessage::Stamp)?;
        let pose = match vector(&values, position)? {
            Some(position) => {
                let pose_ot =
                    Isometry3::from_parts(position.into(), rotation(&values, orientation)?);
                Some(StampedPose { stamp_ns, pose_ot })
            }
            None => None,
        };
        let force = vector(&values, force)?;
        let torque = torque
            .as_ref()
            .map_or(Ok(None), |torque| vector(&values, torque))?
            .unwrap_or_default();
        let wrench = force.map(|force| StampedWrench {
            stamp_ns,
            wrench: Wrench { force, torque },
        });
        Ok(TableRow { pose, wrench })
    }
}

fn split(line: &str, separator: char) -> Vec<&str> {
    match separator {
        ' ' => line.split_whitespace().map(unquoted).collect(),
        separator => line.split(separator).map(unquoted).collect(),
    }
}

fn unquoted(value: &str) -> &str {
    value.trim().trim_matches('"').trim()
}

/// `None`: an empty place, or NaN.
fn number(values: &[&str], column: Column) -> Result<Option<f64>, BadMessage> {
    let value = values[column.at];
    if value.is_empty() {
        return Ok(None);
    }
    let number = value.parse::<f64>().map_err(|_| BadMessage::Malformed)?;
    Ok(Some(number * column.factor).filter(|number| !number.is_nan()))
}

/// `None` when all three are empty.
fn vector(values: &[&str], columns: &[Column; 3]) -> Result<Option<Vector3<f64>>, BadMessage> {
    let [x, y, z] = columns.map(|column| number(values, column));
    match (x?, y?, z?) {
        (Some(x), Some(y), Some(z)) => Ok(Some(Vector3::new(x, y, z))),
        (None, None, None) => Ok(None),
        _ => Err(BadMessage::Malformed),
    }
}

fn rotation(
    values: &[&str],
    columns: &OrientationColumns,
) -> Result<UnitQuaternion<f64>, BadMessage> {
    match columns {
        OrientationColumns::None => Ok(UnitQuaternion::identity()),
        OrientationColumns::RotationVector(turn) => {
            let turn = vector(values, turn)?.filter(|turn| turn.iter().all(|x| x.is_finite()));
            turn.map(UnitQuaternion::from_scaled_axis)
                .ok_or(BadMessage::Quaternion)
        }
        OrientationColumns::Quaternion(quaternion) => {
            let mut numbers = [0.0; 4];
            for (into, column) in numbers.iter_mut().zip(quaternion) {
                *into = number(values, *column)?.ok_or(BadMessage::Quaternion)?;
            }
            measured_rotation(Quaternion::from(numbers)).ok_or(BadMessage::Quaternion)
        }
    }
}

const NS_PER_S: f64 = 1e9;

/// A time in ns, rounded; whole units and their fraction apart, as a time since 1970 in s has more
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
