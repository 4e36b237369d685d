//! STL: binary (80 bytes of header, count, 50 bytes for each triangle) and ASCII.

use std::io::{self, Write};

use nalgebra::Point3;
use touchup_geometry::mesh::triangulate;

use super::defect::{Defect, Syntax};
use super::soup::Soup;
use super::text::{NumberedLines, number};
use crate::file_error::FilePlace;

/// Bytes before the first triangle.
const HEADER: usize = 84;
/// Bytes of a triangle: normal and three corners as `f32`, two more bytes.
const RECORD: usize = 50;

/// Whether the count in a binary header agrees with the length of the file.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    announced(bytes)
        .is_some_and(|count| bytes.len() as u64 == HEADER as u64 + RECORD as u64 * u64::from(count))
}

/// Whether the text begins like ASCII STL; so do the headers of some binary files.
pub(super) fn looks_ascii(bytes: &[u8]) -> bool {
    /// The first facet comes right after the solid's name.
    const SEARCHED: usize = 1024;
    let start = bytes[..bytes.len().min(SEARCHED)].to_ascii_lowercase();
    let has = |word: &[u8]| start.windows(word.len()).any(|w| w == word);
    start.trim_ascii_start().starts_with(b"solid") && (has(b"facet") || has(b"endsolid"))
}

/// Reads either kind; coordinates are multiplied by `scale`.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<Soup, Syntax> {
    if !is_binary(bytes) && (looks_ascii(bytes) || announced(bytes).is_none()) {
        return read_ascii(bytes, scale);
    }
    read_binary(bytes, scale)
}

fn announced(bytes: &[u8]) -> Option<u32> {
    bytes
        .get(80..HEADER)?
        .try_into()
        .ok()
        .map(u32::from_le_bytes)
}

fn read_binary(bytes: &[u8], scale: f64) -> Result<Soup, Syntax> {
    let Some(count) = announced(bytes) else {
        return Err(Syntax::ends(
            FilePlace::Byte(bytes.len() as u64),
            "84 bytes of STL header",
        ));
    };
    let (count, left) = (u64::from(count), bytes.len() - HEADER);
    let needed = u128::from(count) * RECORD as u128;
    if needed != left as u128 {
        let place = FilePlace::Byte(HEADER as u64 + needed.min(left as u128) as u64);
        return Err(Syntax {
            place,
            defect: Defect::Length {
                what: "triangles".into(),
                count,
                needed,
                left,
            },
        });
    }
    let mut positions = Vec::with_capacity(3 * count as usize);
    for record in bytes[HEADER..].chunks_exact(RECORD) {
        for corner in record[12..48].as_chunks::<12>().0 {
            let numbers = corner.as_chunks::<4>().0;
            positions.push(Point3::from(
                [0, 1, 2].map(|i| scale * f64::from(f32::from_le_bytes(numbers[i]))),
            ));
        }
    }
    Ok(Soup::of_triangles(positions))
}

/// Any number of solids; words in any case; larger facets are divided into triangles.
fn read_ascii(bytes: &[u8], scale: f64) -> Result<Soup, Syntax> {
    let mut positions: Vec<Point3<f64>> = Vec::new();
    let mut corners: Vec<Point3<f64>> = Vec::new();
    let mut lines = NumberedLines::new(bytes, b'\n');
    while let Some(line) = lines.next() {
        let place = FilePlace::Line(lines.number());
        let mut words = line.split_ascii_whitespace();
        match words
            .next()
            .unwrap_or_default()
            .to_ascii_lowercase()
            .as_str()
        {
            "" | "solid" | "endsolid" | "outer" | "endloop" => {}
            "facet" => corners.clear(),
            "vertex" => {
                let mut coordinate = || number(words.next(), place).map(|x| scale * x);
                corners.push(Point3::new(coordinate()?, coordinate()?, coordinate()?));
            }
            "endfacet" if corners.len() < 3 => {
                return Err(Syntax::unexpected(
                    place,
                    "three 'vertex' lines before it",
                    "endfacet",
                ));
            }
            "endfacet" => {
                let triangles = triangulate(&corners).ok_or(Syntax {
                    place,
                    defect: Defect::SidesCross,
                })?;
                positions.extend(
                    triangles
                        .as_flattened()
                        .iter()
                        .map(|&at| corners[at as usize]),
                );
                corners.clear();
            }
            other => {
                return Err(Syntax::unexpected(
                    place,
                    "a word of an ASCII STL file such as 'facet'",
                    other,
                ));
            }
        }
    }
    match corners.is_empty() {
        true => Ok(Soup::of_triangles(positions)),
        false => Err(Syntax::ends(FilePlace::Line(lines.number()), "'endfacet'")),
    }
}

/// Binary STL; the format rounds the corners to `f32`.
pub(super) fn write(soup: &Soup, unit: &str, out: &mut impl Write) -> io::Result<()> {
    let mut header = [b' '; 80];
    // must not begin with "solid"
    let title = format!("touchup, unit {unit}, frame O");
    header[..title.len()].copy_from_slice(title.as_bytes());
    out.write_all(&header)?;
    let count = u32::try_from(soup.faces.len()).map_err(io::Error::other)?;
    out.write_all(&count.to_le_bytes())?;
    for corners in &soup.faces {
        let [a, b, c] = corners.map(|v| soup.positions[v as usize]);
        let normal = (b - a)
            .cross(&(c - a))
            .try_normalize(0.0)
            .unwrap_or_default();
        let mut record = [0; RECORD];
        let values = [normal, a.coords, b.coords, c.coords];
        for (slot, x) in record
            .chunks_exact_mut(4)
            .zip(values.iter().flat_map(|v| v.iter()))
        {
            slot.copy_from_slice(&(*x as f32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    Ok(())
}
