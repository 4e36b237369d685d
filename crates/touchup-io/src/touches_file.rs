//! Touches as a table, CSV: one line each, lengths in mm.

use std::io::Write;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};

use super::file_error::{FileError, read_file, write_file};
use touchup_core::stylus::ProbedPoint;

/// The first line of a file of touches.
///
/// `touch`: its number, from 0 on, which features name; `stamp_ns`: of the sample it came from;
/// `stroke`; the centre of the ball and its radius (0 where the tip is none); the point of the
/// surface and its outward normal; the standard deviations along the normal of what averages out,
/// of what radius and stiffness leave and of the place of the scan; what it counts; whether it was
/// rejected as an outlier.
pub const HEADER: &str = "touch,stamp_ns,stroke,center_x_mm,center_y_mm,center_z_mm,tip_radius_mm,point_x_mm,point_y_mm,\
                          point_z_mm,normal_x,normal_y,normal_z,sigma_mm,calibration_mm,place_mm,weight,\
                          rejected";

/// Why a file of touches could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TouchesFileError {
    /// The system refused.
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
        /// what is wrong
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

/// Touches as [`read_touches`] has them after [`write_touches`]: to the digits written. What is
/// measured by them can be measured again from the file.
pub fn as_written(touches: &[ProbedPoint]) -> Vec<ProbedPoint> {
    let rounded = |(number, touch)| touch_of(&line_of(touch, number), number).unwrap_or(*touch);
    touches.iter().enumerate().map(rounded).collect()
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

/// Reads what [`write_touches`] wrote, also as spreadsheets save it: with a byte order mark, CRLF,
/// empty lines.
///
/// # Errors
/// [`TouchesFileError`], with the line.
pub fn read_touches(path: &Path) -> Result<Vec<ProbedPoint>, TouchesFileError> {
    read_lines(path, |_| ())
}

/// Reads touches, and gives the line of each as it is in the file.
pub(crate) fn read_lines(
    path: &Path,
    mut line_read: impl FnMut(&str),
) -> Result<Vec<ProbedPoint>, TouchesFileError> {
    let own = || path.to_owned();
    let text = read_file(path)?;
    let text = String::from_utf8_lossy(&text);
    let mut lines = text.strip_prefix('\u{feff}').unwrap_or(&text).lines();
    let header = lines.next().map(str::trim_end).unwrap_or_default();
    if header != HEADER {
        return Err(TouchesFileError::NoTouches { path: own() });
    }
    let mut touches = Vec::new();
    for (at, line) in lines
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
    {
        let touch = touch_of(line, touches.len()).and_then(|touch| in_order(&touches, touch));
        touches.push(touch.map_err(|what| TouchesFileError::BadLine {
            path: own(),
            line: at + 2,
            what,
        })?);
        line_read(line);
    }
    Ok(touches)
}

/// Touches come in order of time, and all within a span that ns can count.
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

fn touch_of(line: &str, number: usize) -> Result<ProbedPoint, String> {
    let (names, fields): (Vec<_>, Vec<_>) = (
        HEADER.split(',').collect(),
        line.split(',').map(str::trim).collect(),
    );
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
