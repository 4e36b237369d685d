//! Touches as a table, CSV: one line each, lengths in mm.

use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};

use super::file_error::{FileError, read_file, write_file};
use crate::tables::table_rows::{RowError, TableRows};
use touchup_method::stylus::ProbedPoint;

/// The first line of a file of touches.
///
/// `touch`: its number, from 0 on, which features name; `stamp_ns`: of its sample; `stroke`; the
/// centre of the ball and its radius (0 for other tips); the point of the surface and its outward
/// normal; the standard deviations along the normal of averaging errors, of the calibration of
/// radius and stiffness, and of the place of the scan; its weight; whether it was rejected as an
/// outlier.
pub const HEADER: &str = "touch,stamp_ns,stroke,center_x_mm,center_y_mm,center_z_mm,tip_radius_mm,point_x_mm,point_y_mm,\
                          point_z_mm,normal_x,normal_y,normal_z,sigma_mm,calibration_mm,place_mm,weight,\
                          rejected";

/// Why a file of touches could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TouchesFileError {
    /// A system error.
    #[error(transparent)]
    File(#[from] FileError),
    /// Another header.
    #[error("{} does not begin with the header of a file of touches, \"touch,stamp_ns,…\": make it by touchup refine --touches-out FILE.csv", path.display())]
    NoTouches {
        /// the file
        path: PathBuf,
    },
    /// A line that is no touch.
    #[error("{}, line {line}: {what}", path.display())]
    BadLine {
        /// the file
        path: PathBuf,
        /// from 1 on
        line: usize,
        /// the fault
        what: String,
    },
}

/// Writes touches, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_touches(path: &Path, touches: &[ProbedPoint]) -> Result<(), FileError> {
    write_file(path, |out| {
        writeln!(out, "{HEADER}")?;
        touches
            .iter()
            .enumerate()
            .try_for_each(|(number, touch)| writeln!(out, "{}", line_of(touch, number)))
    })
}

/// Touches after [`write_touches`] and [`read_touches`]: to the digits written. Measurements on
/// them are reproducible from the file.
pub fn as_written(touches: &[ProbedPoint]) -> Vec<ProbedPoint> {
    let rounded =
        |(number, touch)| touch_of(&values_of(&line_of(touch, number)), number).unwrap_or(*touch);
    touches.iter().enumerate().map(rounded).collect()
}

/// The values of such a line.
pub(crate) fn values_of(line: &str) -> Vec<Cow<'_, str>> {
    line.split(',').map(Cow::from).collect()
}

pub(crate) fn line_of(touch: &ProbedPoint, number: usize) -> String {
    let ProbedPoint {
        stamp_ns,
        stroke,
        centre,
        radius,
        point,
        normal,
        sigma,
        calibration,
        place,
        weight,
        ..
    } = touch;
    let triple = |v: Vector3<f64>| format!("{:.6},{:.6},{:.6}", v.x, v.y, v.z);
    let [centre, point, normal] = [centre.coords * 1e3, point.coords * 1e3, *normal].map(triple);
    let [radius, sigma, calibration, place] =
        [radius, sigma, calibration, place].map(|length| length * 1e3);
    let rejected = u8::from(touch.is_rejected);
    format!(
        "{number},{stamp_ns},{stroke},{centre},{radius},{point},{normal},{sigma:.6},{calibration:.6},{place:.6},{weight:.4},\
         {rejected}"
    )
}

/// Reads a file of [`write_touches`], also as spreadsheets save it.
///
/// # Errors
/// [`TouchesFileError`], with the line.
pub fn read_touches(path: &Path) -> Result<Vec<ProbedPoint>, TouchesFileError> {
    read_rows(path, |_| ())
}

/// Reads touches, with the values of each as in the file, with decimal points.
pub(crate) fn read_rows(
    path: &Path,
    mut row_read: impl FnMut(&[Cow<'_, str>]),
) -> Result<Vec<ProbedPoint>, TouchesFileError> {
    let bytes = read_file(path)?;
    let bad = |line, what| TouchesFileError::BadLine {
        path: path.to_owned(),
        line,
        what,
    };
    let no_row = |error: RowError, line| bad(line, error.to_string());
    let mut rows = TableRows::open(&bytes[..])
        .ok()
        .filter(|rows| rows.values().join(",") == HEADER)
        .ok_or_else(|| TouchesFileError::NoTouches {
            path: path.to_owned(),
        })?;
    let mut touches = Vec::new();
    loop {
        match rows.advance() {
            Err(error) => return Err(no_row(error, rows.line())),
            Ok(false) => return Ok(touches),
            Ok(true) => {}
        }
        let mut sign = rows.sign;
        let values: Option<Vec<_>> = rows
            .values()
            .into_iter()
            .map(|value| sign.with_point(value))
            .collect();
        let touch = values
            .ok_or_else(|| "decimal points and decimal commas in one file".to_owned())
            .and_then(|values| {
                let touch = in_order(&touches, touch_of(&values, touches.len())?)?;
                row_read(&values);
                Ok(touch)
            });
        touches.push(touch.map_err(|what| bad(rows.line(), what))?);
        rows.sign = sign;
    }
}

/// Requires touches in order of time, within a span that ns can count.
fn in_order(before: &[ProbedPoint], touch: ProbedPoint) -> Result<ProbedPoint, String> {
    let (Some(first), Some(last)) = (before.first(), before.last()) else {
        return Ok(touch);
    };
    let ProbedPoint {
        stamp_ns, stroke, ..
    } = touch;
    if stamp_ns < last.stamp_ns || stroke < last.stroke {
        let (before_ns, before) = (last.stamp_ns, last.stroke);
        return Err(format!(
            "stamp_ns {stamp_ns}, stroke {stroke} after {before_ns}, {before}: touches are not in order of time"
        ));
    }
    stamp_ns
        .checked_sub(first.stamp_ns)
        .map(|_| touch)
        .ok_or_else(|| "stamp_ns 292 years after the first".to_owned())
}

fn touch_of(fields: &[Cow<'_, str>], number: usize) -> Result<ProbedPoint, String> {
    let names: Vec<_> = HEADER.split(',').collect();
    if fields.len() != names.len() {
        return Err(format!(
            "{} fields, a touch has {}",
            fields.len(),
            names.len()
        ));
    }
    if fields[0].parse() != Ok(number) {
        return Err(format!(
            "touch {} where {number} comes: features name touches by number",
            fields[0]
        ));
    }
    let integer = |at: usize| {
        fields[at]
            .parse::<i64>()
            .map_err(|_| format!("{} {:?} is no whole number", names[at], fields[at]))
    };
    let real = |at: usize| match fields[at].parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!(
            "{} {:?} is no finite number",
            names[at], fields[at]
        )),
    };
    let not_negative = |at: usize| match real(at)? {
        x if x >= 0.0 => Ok(x),
        x => Err(format!("{} is {x}, below 0", names[at])),
    };
    let triple = |at: usize| Ok::<_, String>(Vector3::new(real(at)?, real(at + 1)?, real(at + 2)?));
    let normal = triple(10)?;
    let normal = normal
        .try_normalize(0.5)
        .ok_or("the normal has no length")?;
    Ok(ProbedPoint {
        stamp_ns: integer(1)?,
        stroke: u32::try_from(integer(2)?)
            .map_err(|_| format!("stroke {} is no number of a stroke", fields[2]))?,
        centre: Point3::from(triple(3)? * 1e-3),
        radius: not_negative(6)? * 1e-3,
        point: Point3::from(triple(7)? * 1e-3),
        normal,
        sigma: not_negative(13)? * 1e-3,
        calibration: not_negative(14)? * 1e-3,
        place: not_negative(15)? * 1e-3,
        weight: not_negative(16)?,
        is_rejected: match integer(17)? {
            0 => false,
            1 => true,
            other => return Err(format!("rejected is {other}, neither 0 nor 1")),
        },
    })
}
