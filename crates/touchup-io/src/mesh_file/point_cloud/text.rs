//! Points as text: x, y, z and further columns in each line.

use nalgebra::{Point3, Vector3};

use super::super::defect::{Defect, Syntax};
use super::super::text::NumberedLines;
use crate::file_error::FilePlace;
use touchup_core::mesh::{PointCloud, ScanStation};

/// Bytes of the shortest line: three digits and what separates them.
const SHORTEST: usize = 6;
/// How long a normal may be: its digits are rounded.
const UNIT_LENGTH: std::ops::RangeInclusive<f64> = 0.98..=1.02;

/// Reads lines of numbers, separated by blanks, tabs, commas or semicolons; coordinates are
/// multiplied by `scale`. Lines that begin with `#`, `//` or a letter, and the number of the points
/// in the first line, are passed over. Columns 4 to 6, or the last three, are the normals where
/// they are of length 1 in every line.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<PointCloud, Syntax> {
    let end_of_line = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let mut lines = NumberedLines::new(
        bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes),
        end_of_line,
    );
    let mut positions = Vec::with_capacity(bytes.len() / (4 * SHORTEST));
    let mut normals = Normals {
        after_xyz: Some(Vec::new()),
        at_end: Some(Vec::new()),
    };
    let mut row = Vec::new();
    while let Some(line) = lines.next() {
        if is_comment(&line) {
            continue;
        }
        let place = FilePlace::Line(lines.number());
        row.clear();
        for word in line
            .split(|c: char| c.is_whitespace() || c == ',' || c == ';')
            .filter(|word| !word.is_empty())
        {
            row.push(
                word.parse::<f64>()
                    .map_err(|_| Syntax::unexpected(place, "a number", word))?,
            );
        }
        match row[..] {
            [] => {}
            [count] if positions.is_empty() && count >= 0.0 && count.fract() == 0.0 => {}
            [x, y, z, ..] => {
                positions.push(Point3::new(x, y, z) * scale);
                normals.take(&row);
            }
            _ => return Err(Syntax::unexpected(place, "x, y and z of a point", &line)),
        }
    }
    if positions.is_empty() {
        return Err(Syntax {
            place: FilePlace::Line(lines.number().max(1)),
            defect: Defect::NoPoints,
        });
    }
    let stations = vec![ScanStation::unknown(positions.len())];
    Ok(PointCloud {
        positions,
        normals: normals.found(),
        stations,
    })
}

/// A line that is none of numbers; "nan" and "inf" are numbers.
fn is_comment(line: &str) -> bool {
    let word = line
        .split(|c: char| !c.is_ascii_alphabetic())
        .next()
        .unwrap_or_default()
        .to_ascii_lowercase();
    let is_number = ["", "nan", "inf", "infinity"].contains(&word.as_str());
    line.starts_with(['#', '/', '%', '!', '"', '\'']) || !is_number
}

/// The normals of all lines so far, where each line had one there.
struct Normals {
    after_xyz: Option<Vec<Vector3<f64>>>,
    at_end: Option<Vec<Vector3<f64>>>,
}

impl Normals {
    fn take(&mut self, row: &[f64]) {
        let starts = [
            (&mut self.after_xyz, 3),
            (&mut self.at_end, row.len().saturating_sub(3).max(3)),
        ];
        for (normals, start) in starts {
            let normal = row.get(start..start + 3).map(Vector3::from_row_slice);
            match (normal, &mut *normals) {
                // a point without a place may be without a normal
                (Some(n), Some(found))
                    if UNIT_LENGTH.contains(&n.norm()) || !n.norm().is_finite() =>
                {
                    found.push(n)
                }
                _ => *normals = None,
            }
        }
    }

    fn found(self) -> Vec<Vector3<f64>> {
        self.after_xyz.or(self.at_end).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_with_any_separator_between_comments() {
        let text = "3\n# a cloud\n//x y z\nX,Y,Z\n1 2\t3\r\n\n4;5;6\n7, 8, nan\n-1e1,+.5,2.\n";
        let cloud = read(text.as_bytes(), 2.0).unwrap();
        let [a, b, c, d] = cloud.positions[..] else {
            panic!("{cloud:?}")
        };
        assert_eq!(
            [a, b, d],
            [[2.0, 4.0, 6.0], [8.0, 10.0, 12.0], [-20.0, 1.0, 4.0]].map(Point3::from)
        );
        assert!(c.z.is_nan());
        assert!(cloud.normals.is_empty());
    }

    #[test]
    fn columns_of_length_one_are_normals_and_colours_are_not() {
        let normals = |text: &str| read(text.as_bytes(), 1.0).unwrap().normals;
        assert_eq!(
            normals("0 0 0 0 0 1\n1 0 0 0 0.6 0.8\n"),
            [Vector3::z(), Vector3::new(0.0, 0.6, 0.8)]
        );
        assert_eq!(
            normals("0 0 0 255 0 0 0 0 1\n1 0 0 9 9 9 0 1 0\n"),
            [Vector3::z(), Vector3::y()]
        );
        assert!(normals("0 0 0 0 0 1\n1 0 0 255 9 9\n").is_empty());
        assert!(normals("0 0 0 0.5\n1 0 0 0.25\n").is_empty());
    }

    #[test]
    fn what_is_no_point_is_named_with_its_line() {
        let error = |text: &str| {
            let Syntax { place, defect } = read(text.as_bytes(), 1.0).unwrap_err();
            format!("{place}: {defect}")
        };
        assert_eq!(
            error("1 2 3\n4 5\n"),
            "line 2: expected x, y and z of a point, found '4 5'"
        );
        assert_eq!(
            error("1 2 3\n4 5 6x\n"),
            "line 2: expected a number, found '6x'"
        );
        assert_eq!(
            error("# nothing\n"),
            "line 1: no point in it: export it again with x, y and z of each point"
        );
    }
}
