//! The rows of a PLY file.

use nalgebra::Point3;

use super::super::defect::{Defect, Syntax};
use super::super::text::{NumberedLines, number};
use super::header::{PlyElement, PlyEncoding, PlyHeader, PlyKind};
use crate::file_error::FilePlace;
use crate::scalar::Scalar;

/// The remaining body.
pub(super) struct Body<'a> {
    bytes: &'a [u8],
    encoding: PlyEncoding,
    end_of_line: u8,
    /// next byte
    at: usize,
    /// lines before it, in ASCII
    lines: usize,
}

impl<'a> Body<'a> {
    pub fn new(bytes: &'a [u8], header: &PlyHeader) -> Self {
        let PlyHeader {
            encoding,
            end_of_line,
            lines,
            len,
            ..
        } = *header;
        Self {
            bytes,
            encoding,
            end_of_line,
            at: len,
            lines,
        }
    }

    /// Refuses an element with too few bytes for its rows: afterwards its count is safe for memory.
    pub fn check_count(&self, element: &PlyElement) -> Result<(), Syntax> {
        let place = FilePlace::Line(element.line);
        if element.count > 0 && element.properties.is_empty() {
            return Err(Syntax::unexpected(
                place,
                "properties of the element",
                "none",
            ));
        }
        let left = self.bytes.len().saturating_sub(self.at);
        let needed = element.count as u128 * element.shortest_row(self.encoding) as u128;
        // the last line of a text may lack its end
        if needed <= left as u128 + 1 {
            return Ok(());
        }
        let defect = Defect::Length {
            what: element.name.clone() + " rows",
            count: element.count as u64,
            needed,
            left,
        };
        Err(Syntax { place, defect })
    }

    /// Reads `count` rows. `take` gets the items of the list in column `list`, or else one value
    /// for each column (0 for a list), and the place of the row. In ASCII a row is a line; empty
    /// lines are skipped.
    pub fn rows(
        &mut self,
        element: &PlyElement,
        count: usize,
        list: Option<usize>,
        mut take: impl FnMut(&[f64], FilePlace) -> Result<(), Syntax>,
    ) -> Result<(), Syntax> {
        let mut row = Vec::new();
        if self.encoding != PlyEncoding::Ascii {
            let (bytes, big) = (self.bytes, self.encoding == PlyEncoding::Big);
            for _ in 0..count {
                let place = FilePlace::Byte(self.at as u64);
                read_row(element, list, place, &mut row, |scalar| {
                    let value = bytes
                        .get(self.at..)
                        .and_then(|rest| scalar.value(rest, big));
                    self.at += scalar.size();
                    value.ok_or_else(|| {
                        Syntax::ends(FilePlace::Byte(bytes.len() as u64), "the rest of a row")
                    })
                })?;
                take(&row, place)?;
            }
            return Ok(());
        }
        let mut lines = NumberedLines::new(&self.bytes[self.at..], self.end_of_line);
        for _ in 0..count {
            let line = std::iter::from_fn(|| lines.next()).find(|line| !line.is_empty());
            let place = FilePlace::Line(self.lines + lines.number());
            let line = line.ok_or_else(|| {
                Syntax::ends(
                    FilePlace::Line(self.lines + lines.number() + 1),
                    "a row of numbers",
                )
            })?;
            let mut words = line.split_ascii_whitespace();
            read_row(element, list, place, &mut row, |_| {
                number(words.next(), place)
            })?;
            if let Some(word) = words.next() {
                return Err(Syntax::unexpected(place, "the end of the line", word));
            }
            take(&row, place)?;
        }
        self.lines += lines.number();
        self.at += lines.offset();
        Ok(())
    }

    /// Three columns, times `scale`, of all rows of a binary element without lists; `None`, without
    /// reading, for lists, ASCII, or a file that ends before its last row.
    pub fn fixed_rows(
        &mut self,
        element: &PlyElement,
        columns: [usize; 3],
        scale: f64,
    ) -> Option<Vec<Point3<f64>>> {
        let (mut offsets, mut len) = (Vec::new(), 0);
        for property in &element.properties {
            let PlyKind::Scalar(scalar) = property.kind else {
                return None;
            };
            offsets.push((len, scalar));
            len += scalar.size();
        }
        let end = self.at.checked_add(len.checked_mul(element.count)?)?;
        let rows = self
            .bytes
            .get(self.at..end)
            .filter(|_| self.encoding != PlyEncoding::Ascii)?
            .chunks_exact(len);
        self.at = end;
        let [x, y, z] = columns.map(|column| offsets[column]);
        let big = self.encoding == PlyEncoding::Big;
        let column = |row: &[u8], (at, scalar): (usize, Scalar)| {
            scale * scalar.value(&row[at..], big).unwrap_or(f64::NAN)
        };
        // the two usual cases, with types known to the compiler
        let point = |row, x, y, z| Point3::new(column(row, x), column(row, y), column(row, z));
        let of_type = |row, t| point(row, (x.0, t), (y.0, t), (z.0, t));
        Some(match [x.1, y.1, z.1] {
            [Scalar::F32, Scalar::F32, Scalar::F32] => {
                rows.map(|row| of_type(row, Scalar::F32)).collect()
            }
            [Scalar::F64, Scalar::F64, Scalar::F64] => {
                rows.map(|row| of_type(row, Scalar::F64)).collect()
            }
            _ => rows.map(|row| point(row, x, y, z)).collect(),
        })
    }

    /// The rows that are triangles in the usual layout (only a list of three 32-bit numbers, little
    /// endian), up to the first other row. Strips look the same and stay unread.
    pub fn triangles(&mut self, element: &PlyElement) -> Vec<[u32; 3]> {
        const ROW: usize = 13;
        let usual = |kind| {
            matches!(
                kind,
                PlyKind::List {
                    count: Scalar::U8,
                    item: Scalar::I32 | Scalar::U32
                }
            )
        };
        let layout_is_usual =
            element.name == "face" && matches!(&element.properties[..], [only] if usual(only.kind));
        if self.encoding != PlyEncoding::Little || !layout_is_usual {
            return Vec::new();
        }
        let rows = self.bytes[self.at..].as_chunks::<ROW>().0;
        let rows = &rows[..element.count.min(rows.len())];
        let rows = &rows[..rows
            .iter()
            .position(|row| row[0] != 3)
            .unwrap_or(rows.len())];
        self.at += rows.len() * ROW;
        let number =
            |row: &[u8; ROW], i| u32::from_le_bytes([row[i], row[i + 1], row[i + 2], row[i + 3]]);
        rows.iter()
            .map(|row| [number(row, 1), number(row, 5), number(row, 9)])
            .collect()
    }
}

/// Fills `row` from `next`: the items of the list in column `list`, or else one value for each
/// column.
fn read_row(
    element: &PlyElement,
    list: Option<usize>,
    place: FilePlace,
    row: &mut Vec<f64>,
    mut next: impl FnMut(Scalar) -> Result<f64, Syntax>,
) -> Result<(), Syntax> {
    row.clear();
    for (column, property) in element.properties.iter().enumerate() {
        let mut value = 0.0;
        match property.kind {
            PlyKind::Scalar(scalar) => value = next(scalar)?,
            PlyKind::List { count, item } => {
                let items = next(count)?;
                if items < 0.0 || items.fract() != 0.0 {
                    return Err(Syntax::unexpected(place, "the length of a list", items));
                }
                // an excessive length runs into the end of the file, without any allocation
                for _ in 0..items as u64 {
                    let value = next(item)?;
                    if list == Some(column) {
                        row.push(value);
                    }
                }
            }
        }
        if list.is_none() {
            row.push(value);
        }
    }
    Ok(())
}
