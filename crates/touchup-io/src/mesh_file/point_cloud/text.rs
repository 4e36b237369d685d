//! Points as text: x, y, z and further columns in each line.

use nalgebra::{Point3, Vector3};

use super::super::defect::{Defect, Syntax};
use super::super::text::NumberedLines;
use crate::file_error::FilePlace;
use crate::tables::table_rows::DecimalSign;
use touchup_geometry::mesh::{PointCloud, ScanStation};

/// Bytes of the shortest line: three digits and their separators.
const SHORTEST: usize = 6;
/// Length of a normal with rounded digits.
const UNIT_LENGTH: std::ops::RangeInclusive<f64> = 0.98..=1.02;

/// Reads lines of numbers, with coordinates times `scale`. The first line decides the separator,
/// the first decimal sign holds for all ([`Notation`]). Skips lines that begin with `#`, `//` or a
/// letter, and a number of points in the first line. Columns 4 to 6, or the last three, are the
/// normals if their length is 1 in every line.
pub(in crate::mesh_file) fn read(bytes: &[u8], scale: f64) -> Result<PointCloud, Syntax> {
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
    let (mut row, mut notation) = (Vec::new(), None);
    while let Some(line) = lines.next() {
        if is_comment(&line) {
            continue;
        }
        let place = FilePlace::Line(lines.number());
        if line.trim().is_empty() {
            continue;
        }
        let (_, decided) = notation.get_or_insert_with(|| (place, Notation::of(&line)));
        decided
            .numbers(&line, &mut row)
            .map_err(|(expected, found)| Syntax::unexpected(place, expected, found))?;
        match row[..] {
            [count] if positions.is_empty() && count >= 0.0 && count.fract() == 0.0 => {
                notation = None;
            }
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
    if let Some((
        place,
        Notation {
            may_be_decimals: true,
            ..
        },
    )) = notation
    {
        return Err(Syntax::unexpected(
            place,
            DECIDED,
            "whole numbers and commas alone",
        ));
    }
    let stations = vec![ScanStation::unknown(positions.len())];
    Ok(PointCloud {
        positions,
        normals: normals.found(),
        stations,
    })
}

/// Notation of the numbers in all lines of a file.
struct Notation {
    /// `None`: blanks
    separator: Option<char>,
    decimal_sign: DecimalSign,
    /// commas between whole numbers, consistent with decimal commas
    may_be_decimals: bool,
}

impl Notation {
    /// Notation by the first line of numbers: semicolons separate; commas do too, unless they occur
    /// at most once within each of three or more words.
    fn of(line: &str) -> Self {
        let has_decimals = |word: &str| {
            word.matches(',').count() < 2 && !word.starts_with(',') && !word.ends_with(',')
        };
        let words = line.split_whitespace();
        let are_decimals = words.clone().count() > 2 && words.clone().all(has_decimals);
        let separator = [';', ',']
            .into_iter()
            .find(|&separator| line.contains(separator))
            .filter(|&separator| separator == ';' || !are_decimals);
        let columns = line.trim().trim_end_matches(',').split(',').count();
        Self {
            separator,
            decimal_sign: DecimalSign(None),
            may_be_decimals: separator == Some(',') && columns >= 6 && columns.is_multiple_of(2),
        }
    }

    /// The numbers of a line; or the expected and the found text.
    fn numbers<'a>(
        &mut self,
        line: &'a str,
        row: &mut Vec<f64>,
    ) -> Result<(), (&'static str, &'a str)> {
        row.clear();
        let line = line.trim();
        match self.separator {
            None => {
                for word in line.split_whitespace() {
                    row.push(self.number(word)?);
                }
            }
            Some(separator) => {
                let line = line.strip_suffix(separator).unwrap_or(line);
                for word in line.split(separator) {
                    row.push(self.number(word.trim())?);
                }
            }
        }
        Ok(())
    }

    fn number<'a>(&mut self, word: &'a str) -> Result<f64, (&'static str, &'a str)> {
        if word.contains(['.', ',']) {
            self.may_be_decimals = false;
        }
        let number = self
            .decimal_sign
            .with_point(word)
            .ok_or(("the decimal sign of the lines before", word))?;
        // digits after a decimal sign may begin with a zero
        let digits = word.trim_start_matches(['+', '-']).as_bytes();
        if self.separator == Some(',') && matches!(digits, [b'0', b'0'..=b'9', ..]) {
            return Err((DECIDED, word));
        }
        number.parse().map_err(|_| ("a number", word))
    }
}

/// Expected notation, for errors about ambiguous commas.
const DECIDED: &str = "numbers with decimal points, or with decimal commas and separated by \
     semicolons or blanks";

/// A line without numbers; "nan" and "inf" are numbers.
fn is_comment(line: &str) -> bool {
    let word = line
        .trim_start_matches(['"', '\''])
        .split(|c: char| !c.is_ascii_alphabetic())
        .next()
        .unwrap_or_default()
        .to_ascii_lowercase();
    let is_number = ["", "nan", "inf", "infinity"].contains(&word.as_str());
    line.starts_with(['#', '/', '%', '!']) || !is_number
}

/// The normals of all lines up to now, if each line has one there.
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
                // a point without a position may lack a normal
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
    fn numbers_are_read_with_any_separator_and_sign_between_comments() {
        for [first, second] in [
            ["1 2\t3\r", "-1e1  +.5 2."],
            ["1;2 ; 3", "-1e1;+.5;2.;"],
            ["1, 2, 3", "-1e1,+.5 ,2."],
            ["1,2,3,", "-1e1,+.5,2."],
            ["1 2 3", "-1e1 0,5 2,0"],
            ["1,0\t2,00\t3", "-1e1\t+0,5\t2"],
            ["1;2;3", "-1,0e1;0,5;2"],
        ] {
            let text = format!("2\n# a cloud\n//x y z\nX,Y,Z\n{first}\n\n{second}\n");
            let cloud = read(text.as_bytes(), 2.0).unwrap();
            let wanted = [[2.0, 4.0, 6.0], [-20.0, 1.0, 4.0]].map(Point3::from);
            assert_eq!(cloud.positions, wanted, "{text}");
            assert!(cloud.normals.is_empty());
        }
        let cloud = read(b"7, 8, nan\n1, 2, 3, 255, 0, 0\n0.5,0,0,1,2,3", 1.0).unwrap();
        assert!(cloud.positions.len() == 3 && cloud.positions[0].z.is_nan());
    }

    #[test]
    fn a_notation_that_changes_or_may_be_two_is_refused() {
        let error = |text: &str| {
            let Syntax { place, defect } = read(text.as_bytes(), 1.0).unwrap_err();
            format!("{place}: {defect}")
        };
        for (text, wanted) in [
            (
                "1.5 2 3\n4 5,5 6\n",
                "line 2: expected the decimal sign of the lines before, found '5,5'",
            ),
            (
                "1,5;2;3\n4;5.5;6\n",
                "line 2: expected the decimal sign of the lines before, found '5.5'",
            ),
            ("1 2 3\n4;5;6\n", "line 2: expected a number, found '4;5;6'"),
            ("1;2;3\n4 5 6\n", "line 2: expected a number, found '4 5 6'"),
            ("1,2,3\n4 5 6\n", "line 2: expected a number, found '4 5 6'"),
            ("1,2,3 4\n", "line 1: expected a number, found '3 4'"),
            (
                "1,234.5;2;3\n",
                "line 1: expected a number, found '1,234.5'",
            ),
            ("1;;3\n", "line 1: expected a number, found ''"),
            (
                "\"x\",\"y\",\"z\"\n1,2,3\n\"1,234\",2,3\n",
                "line 3: expected a number, found '\\\"1'",
            ),
        ] {
            assert_eq!(error(text), wanted);
        }
        assert_eq!(
            error("33,0580,4,2960,10,0000\n"),
            format!("line 1: expected {DECIDED}, found '0580'")
        );
        let whole = format!("line 2: expected {DECIDED}, found 'whole numbers and commas alone'");
        assert_eq!(error("2\n33,5,4,2,10,1\n34,5,4,2,10,1\n"), whole);
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
