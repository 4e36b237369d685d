//! PCD of the Point Cloud Library, versions 0.5 to 0.7: ASCII, binary and compressed.

use nalgebra::{Point3, Vector3};

use super::super::defect::{Defect, Syntax};
use super::super::text::{NumberedLines, number};
use super::lzf;
use crate::file_error::FilePlace;
use crate::scalar::Scalar;
use touchup_geometry::mesh::{PointCloud, ScanStation};

/// Fields for reading: the position, which is required, and the normal, which is optional.
const NAMES: [&str; 6] = ["x", "y", "z", "normal_x", "normal_y", "normal_z"];

/// Encoding of the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PcdEncoding {
    Ascii,
    Binary,
    Compressed,
}

/// A field of each point.
#[derive(Debug, Default)]
struct PcdField {
    name: String,
    /// bytes of one value
    size: usize,
    kind: char,
    /// values of each point
    count: usize,
}

impl PcdField {
    fn bytes(&self) -> usize {
        self.size * self.count
    }

    fn scalar(&self) -> Option<Scalar> {
        Some(match (self.kind, self.size) {
            ('F', 4) => Scalar::F32,
            ('F', 8) => Scalar::F64,
            ('I', 1) => Scalar::I8,
            ('I', 2) => Scalar::I16,
            ('I', 4) => Scalar::I32,
            ('U', 1) => Scalar::U8,
            ('U', 2) => Scalar::U16,
            ('U', 4) => Scalar::U32,
            _ => return None,
        })
    }
}

#[derive(Debug, Default)]
struct PcdHeader {
    fields: Vec<PcdField>,
    width: u64,
    height: u64,
    /// as announced, or width × height
    points: u64,
    eye: Option<Point3<f64>>,
    encoding: Option<PcdEncoding>,
    /// lines and bytes of the header
    lines: usize,
    len: usize,
}

/// Whether the text begins like PCD.
pub(in crate::mesh_file) fn is_pcd(bytes: &[u8]) -> bool {
    let starts = |word: &[u8]| bytes.starts_with(word);
    starts(b"# .PCD") || starts(b"VERSION ") || starts(b"FIELDS ")
}

/// Reads positions and normals; coordinates are multiplied by `scale`.
pub(in crate::mesh_file) fn read(bytes: &[u8], scale: f64) -> Result<PointCloud, Syntax> {
    let header = PcdHeader::read(bytes)?;
    let columns = header.columns()?;
    let body = &bytes[header.len..];
    let mut cloud = PointCloud::default();
    // a check of one byte per point precedes every allocation
    let mut take = |row: [f64; 6], has_normals: bool| {
        cloud
            .positions
            .push(Point3::new(row[0], row[1], row[2]) * scale);
        if has_normals {
            cloud.normals.push(Vector3::new(row[3], row[4], row[5]));
        }
    };
    match header.encoding {
        Some(PcdEncoding::Ascii) => header.ascii(body, &columns, &mut take)?,
        Some(PcdEncoding::Binary) => {
            header.check_length(body.len(), header.row_bytes())?;
            let rows = body
                .chunks_exact(header.row_bytes())
                .take(header.points as usize);
            rows.for_each(|row| {
                take(
                    columns.map(|c| value(row, c.offset, c.scalar)),
                    columns[3].scalar.is_some(),
                )
            });
        }
        _ => {
            let body = header.unpacked(body)?;
            let points = header.points as usize;
            // the values of a field are contiguous
            let place = |c: PcdColumn, at: usize| c.offset * points + at * c.step;
            (0..points).for_each(|at| {
                take(
                    columns.map(|c| value(&body, place(c, at), c.scalar)),
                    columns[3].scalar.is_some(),
                );
            });
        }
    }
    let is_grid = header.height > 1;
    let eye = header
        .eye
        .or(is_grid.then(Point3::origin))
        .map(|eye| eye * scale);
    cloud.stations = vec![ScanStation {
        points: cloud.positions.len(),
        eye,
        is_sure: is_grid,
    }];
    Ok(cloud)
}

/// Place of a value in a point.
#[derive(Clone, Copy, Debug)]
struct PcdColumn {
    /// number of values before it
    index: usize,
    /// number of bytes before it
    offset: usize,
    /// bytes of its field
    step: usize,
    /// `None`: no such field
    scalar: Option<Scalar>,
}

fn value(bytes: &[u8], at: usize, scalar: Option<Scalar>) -> f64 {
    let read = |scalar: Scalar| scalar.value(bytes.get(at..)?, false);
    scalar.and_then(read).unwrap_or(f64::NAN)
}

impl PcdHeader {
    fn read(bytes: &[u8]) -> Result<Self, Syntax> {
        let mut lines = NumberedLines::new(bytes, b'\n');
        let mut header = Self::default();
        let mut points = None;
        while let Some(line) = lines.next() {
            let place = FilePlace::Line(lines.number());
            let mut words = line.split_ascii_whitespace();
            let key = words.next().unwrap_or_default();
            let words: Vec<&str> = words.collect();
            match key {
                "FIELDS" | "COLUMNS" => {
                    let field = |name: &&str| PcdField {
                        name: (*name).into(),
                        size: 4,
                        kind: 'F',
                        count: 1,
                    };
                    header.fields = words.iter().map(field).collect();
                }
                "SIZE" => header.set(&words, place, |field, word| {
                    word.parse().map(|found| field.size = found).ok()
                })?,
                "TYPE" => header.set(&words, place, |field, word| {
                    word.parse().map(|found| field.kind = found).ok()
                })?,
                "COUNT" => header.set(&words, place, |field, word| {
                    word.parse().map(|found| field.count = found).ok()
                })?,
                "WIDTH" => header.width = count(&words, place)?,
                "HEIGHT" => header.height = count(&words, place)?,
                "POINTS" => points = Some(count(&words, place)?),
                "VIEWPOINT" => header.eye = Some(viewpoint(&words, place)?),
                "DATA" => {
                    header.encoding = Some(encoding(&words, place)?);
                    (header.lines, header.len) = (lines.number(), lines.offset());
                    header.points = header.checked_points(points, place)?;
                    return Ok(header);
                }
                "" | "VERSION" => {}
                _ if key.starts_with('#') => {}
                _ => {
                    return Err(Syntax::unexpected(
                        place,
                        "a line of a PCD header such as FIELDS or DATA",
                        &line,
                    ));
                }
            }
        }
        Err(Syntax::ends(
            FilePlace::Line(lines.number() + 1),
            "the rest of the header up to 'DATA'",
        ))
    }

    /// One word for each field.
    fn set(
        &mut self,
        words: &[&str],
        place: FilePlace,
        mut set: impl FnMut(&mut PcdField, &str) -> Option<()>,
    ) -> Result<(), Syntax> {
        /// Maximum number of values of a field: a histogram has some hundred.
        const MOST: usize = 1 << 16;
        if words.len() != self.fields.len() {
            return Err(Syntax::unexpected(
                place,
                "one word for each of the FIELDS before it",
                words.join(" "),
            ));
        }
        for (field, word) in self.fields.iter_mut().zip(words) {
            if set(field, word).is_none() || field.size > 8 || field.count > MOST {
                return Err(Syntax::unexpected(
                    place,
                    "a size of 1, 2, 4 or 8, a type F, I or U, or a count",
                    word,
                ));
            }
        }
        Ok(())
    }

    fn checked_points(&self, points: Option<u64>, place: FilePlace) -> Result<u64, Syntax> {
        let grid = self.width.checked_mul(self.height.max(1));
        match (grid, points) {
            (Some(grid), Some(points)) if grid == points || self.width == 0 => Ok(points),
            (Some(grid), None) => Ok(grid),
            _ => {
                let found = format!(
                    "{} x {}, POINTS {}",
                    self.width,
                    self.height,
                    points.unwrap_or_default()
                );
                Err(Syntax::unexpected(
                    place,
                    "POINTS to be WIDTH x HEIGHT",
                    found,
                ))
            }
        }
    }

    /// Columns of the values of [`NAMES`].
    fn columns(&self) -> Result<[PcdColumn; 6], Syntax> {
        let find = |name: &str| {
            let at = self
                .fields
                .iter()
                .position(|field| field.name == name && field.count > 0)?;
            let before = &self.fields[..at];
            let field = &self.fields[at];
            Some(PcdColumn {
                index: before.iter().map(|field| field.count).sum(),
                offset: before.iter().map(PcdField::bytes).sum(),
                step: field.bytes(),
                scalar: field.scalar(),
            })
        };
        let none = PcdColumn {
            index: usize::MAX,
            offset: 0,
            step: 0,
            scalar: None,
        };
        let mut columns = NAMES.map(|name| find(name).unwrap_or(none));
        if let Some(at) = columns[..3]
            .iter()
            .position(|column| column.scalar.is_none())
        {
            let found = format!("no field {} of such a type", NAMES[at]);
            let place = FilePlace::Line(self.lines);
            return Err(Syntax::unexpected(
                place,
                "fields x, y and z of type F, I or U and size 1 to 8",
                found,
            ));
        }
        if columns[3..].iter().any(|column| column.scalar.is_none()) {
            columns[3..].fill(none);
        }
        Ok(columns)
    }

    fn row_bytes(&self) -> usize {
        self.fields.iter().map(PcdField::bytes).sum()
    }

    /// Refuses more points than there are bytes for: afterwards their number is safe for memory.
    fn check_length(&self, left: usize, row: usize) -> Result<(), Syntax> {
        let needed = u128::from(self.points) * row as u128;
        if needed <= left as u128 {
            return Ok(());
        }
        let defect = Defect::Length {
            what: "points".into(),
            count: self.points,
            needed,
            left,
        };
        Err(Syntax {
            place: FilePlace::Byte(self.len as u64),
            defect,
        })
    }

    fn ascii(
        &self,
        body: &[u8],
        columns: &[PcdColumn; 6],
        take: &mut impl FnMut([f64; 6], bool),
    ) -> Result<(), Syntax> {
        let words_of_row: usize = self.fields.iter().map(|field| field.count).sum();
        // a digit and a blank each; the last line may lack its end
        self.check_length(body.len() + 1, 2 * words_of_row)?;
        let mut lines = NumberedLines::new(body, b'\n');
        let mut row = Vec::new();
        for _ in 0..self.points {
            let line = std::iter::from_fn(|| lines.next()).find(|line| !line.is_empty());
            let place = FilePlace::Line(self.lines + lines.number());
            let line = line.ok_or_else(|| {
                let end = FilePlace::Line(self.lines + lines.number() + 1);
                Syntax::ends(end, "as many points as the header announces")
            })?;
            row.clear();
            let mut words = line.split_ascii_whitespace();
            for _ in 0..words_of_row {
                row.push(number(words.next(), place)?);
            }
            if let Some(word) = words.next() {
                return Err(Syntax::unexpected(place, "the end of the line", word));
            }
            take(
                columns.map(|c| row.get(c.index).copied().unwrap_or(f64::NAN)),
                columns[3].scalar.is_some(),
            );
        }
        Ok(())
    }

    /// The body of a compressed file: its two lengths, and then LZF.
    fn unpacked(&self, body: &[u8]) -> Result<Vec<u8>, Syntax> {
        let place = FilePlace::Byte(self.len as u64);
        let lengths = body.as_chunks::<4>().0;
        let [packed, plain, ..] = lengths else {
            return Err(Syntax::ends(
                FilePlace::Byte((self.len + body.len()) as u64),
                "two lengths of 4 bytes",
            ));
        };
        let [packed_len, plain_len] =
            [packed, plain].map(|bytes| u64::from(u32::from_le_bytes(*bytes)));
        let needed = u128::from(self.points) * self.row_bytes() as u128;
        if needed != u128::from(plain_len) {
            let found = format!("{plain_len} for {} points", self.points);
            return Err(Syntax::unexpected(
                place,
                "the unpacked length that the header asks for",
                found,
            ));
        }
        let packed = body[8..].get(..packed_len as usize).ok_or_else(|| {
            let (count, left) = (self.points, body.len() - 8);
            Syntax {
                place,
                defect: Defect::Length {
                    what: "points".into(),
                    count,
                    needed: packed_len.into(),
                    left,
                },
            }
        })?;
        let broken = || {
            Syntax::unexpected(
                place,
                "points packed by LZF",
                "bytes that cannot be unpacked",
            )
        };
        if plain_len > packed_len.saturating_mul(lzf::MOST_EXPANSION) {
            return Err(broken());
        }
        lzf::unpacked(packed, plain_len as usize).ok_or_else(broken)
    }
}

fn count(words: &[&str], place: FilePlace) -> Result<u64, Syntax> {
    let word = words.first().copied().unwrap_or_default();
    word.parse()
        .map_err(|_| Syntax::unexpected(place, "how many there are", word))
}

fn encoding(words: &[&str], place: FilePlace) -> Result<PcdEncoding, Syntax> {
    match words {
        ["ascii"] => Ok(PcdEncoding::Ascii),
        ["binary"] => Ok(PcdEncoding::Binary),
        ["binary_compressed"] => Ok(PcdEncoding::Compressed),
        _ => Err(Syntax::unexpected(
            place,
            "ascii, binary or binary_compressed",
            words.join(" "),
        )),
    }
}

fn viewpoint(words: &[&str], place: FilePlace) -> Result<Point3<f64>, Syntax> {
    let mut words = words.iter().copied();
    let mut coordinate = || number(words.next(), place);
    Ok(Point3::new(coordinate()?, coordinate()?, coordinate()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(data: &str) -> String {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x _ y z normal_x normal_y normal_z\nSIZE 4 1 8 4 4 4 4\n\
             TYPE F U F F F F F\nCOUNT 1 3 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 2 1 0 0 0\nPOINTS 2\nDATA {data}\n"
        )
    }

    fn message(file: &[u8]) -> String {
        let Syntax { place, defect } = read(file, 1.0).unwrap_err();
        format!("{place}: {defect}")
    }

    #[test]
    fn the_same_points_come_of_all_three_encodings() {
        let rows = [(1.0f32, 2.0f64, 3.0f32), (f32::NAN, 5.0, 6.0)];
        let normal = [0.0f32, 0.6, 0.8].map(f32::to_le_bytes).concat();
        let ascii = header("ascii") + "1 9 9 9 2 3 0 .6 .8\n\nnan 9 9 9 5 6 0 .6 .8";
        let row = |(x, y, z): &(f32, f64, f32)| {
            [
                &x.to_le_bytes()[..],
                &[9; 3],
                &y.to_le_bytes(),
                &z.to_le_bytes(),
                &normal,
            ]
            .concat()
        };
        let binary = [
            header("binary").into_bytes(),
            rows.iter().flat_map(row).collect(),
        ]
        .concat();
        // field by field, packed as literals alone: 32 at most in a run
        let mut plain: Vec<u8> = rows.iter().flat_map(|row| row.0.to_le_bytes()).collect();
        plain.extend([9; 6]);
        plain.extend(rows.iter().flat_map(|row| row.1.to_le_bytes()));
        plain.extend(rows.iter().flat_map(|row| row.2.to_le_bytes()));
        plain.extend(
            [0.0f32, 0.0, 0.6, 0.6, 0.8, 0.8]
                .iter()
                .flat_map(|x| x.to_le_bytes()),
        );
        let packed: Vec<u8> = plain
            .chunks(32)
            .flat_map(|run| [&[run.len() as u8 - 1], run].concat())
            .collect();
        let lengths = [packed.len() as u32, plain.len() as u32]
            .map(u32::to_le_bytes)
            .concat();
        let compressed = [header("binary_compressed").into_bytes(), lengths, packed].concat();
        for file in [ascii.as_bytes(), &binary, &compressed] {
            let cloud = read(file, 1.0).unwrap_or_else(|e| panic!("{e:?}"));
            assert_eq!(cloud.positions[0], Point3::new(1.0, 2.0, 3.0));
            assert!(cloud.positions[1].x.is_nan());
            assert_eq!([cloud.positions[1].y, cloud.positions[1].z], [5.0, 6.0]);
            assert!(
                cloud
                    .normals
                    .iter()
                    .all(|n| (n - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-7),
                "{cloud:?}"
            );
            let ScanStation {
                points,
                eye,
                is_sure,
            } = cloud.stations[0];
            assert_eq!(
                (points, eye, is_sure),
                (2, Some(Point3::new(0.0, 0.0, 2.0)), false)
            );
        }
    }

    #[test]
    fn a_header_that_claims_too_much_is_refused_before_memory_is_taken() {
        let small = |points: u64, data: &str| {
            format!(
                "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\nDATA {data}\n"
            )
        };
        let huge = 1 << 60;
        assert!(
            message(small(huge, "ascii").as_bytes())
                .contains("the header announces 1152921504606846976 points")
        );
        assert!(
            message(small(huge, "binary").as_bytes()).contains("the file is damaged or cut short")
        );
        let packed = [
            small(300_000_000, "binary_compressed").as_bytes(),
            &[1, 0, 0, 0],
            &3_600_000_000u32.to_le_bytes(),
            &[0],
        ]
        .concat();
        assert_eq!(
            message(&packed),
            "byte 95: expected points packed by LZF, found 'bytes that cannot be unpacked'"
        );
        assert!(
            message(b"FIELDS x y z\nSIZE 4 4\nDATA ascii\n")
                .starts_with("line 2: expected one word for each")
        );
        assert!(
            message(b"FIELDS x y\nWIDTH 1\nDATA ascii\n1 2\n")
                .contains("'no field z of such a type'")
        );
        assert!(message(b"# .PCD\nFIELDS x y z\n").contains("up to 'DATA'"));
        assert_eq!(
            message(b"FIELDS x y z\nWIDTH 2\nDATA ascii\n1 2 3\n4 x 6\n"),
            "line 5: expected a number, found 'x'"
        );
    }
}
