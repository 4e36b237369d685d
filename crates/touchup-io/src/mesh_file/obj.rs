//! Wavefront OBJ, parsed by `tobj`.

use std::borrow::Cow;
use std::io::{self, BufRead, Read, Write};

use nalgebra::Point3;
use tobj::{LoadError, LoadOptions};

use super::defect::{Defect, Syntax};
use super::soup::Soup;
use super::text::NumberedLines;
use crate::file_error::FilePlace;

/// Reads all objects and groups as one mesh; coordinates are multiplied by `scale`. Lines, points, normals, texture
/// and materials are passed over. Vertices come in the order in which faces first name them.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<Soup, Syntax> {
    let bytes = as_utf8(bytes)?;
    let mut geometry = Geometry { rest: &bytes, line: &[], shortened: false, number: 0, vertices: 0 };
    let options = LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let no_materials = |_: &std::path::Path| Err(LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut geometry, &options, no_materials)
        .map_err(|error| place_of(error, &bytes, geometry.number))?;
    let mut soup = Soup::default();
    for model in models {
        let first = soup.positions.len() as u32;
        soup.positions.extend(model.mesh.positions.as_chunks().0.iter().map(|&p| Point3::from(p) * scale));
        soup.faces.extend(model.mesh.indices.as_chunks().0.iter().map(|f| f.map(|v| v + first)));
    }
    soup.unused = geometry.vertices - soup.positions.len().min(geometry.vertices);
    Ok(soup)
}

/// The text as UTF-8: UTF-16 with a byte order mark is turned into it. Comments may be in any encoding.
fn as_utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>, Syntax> {
    let pair: fn([u8; 2]) -> u16 = match bytes {
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        _ => return Ok(Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))),
    };
    let units = bytes[2..].as_chunks().0.iter().map(|&b| pair(b));
    let text: Result<String, _> = char::decode_utf16(units).collect();
    let broken = |_| Syntax::unexpected(FilePlace::Byte(0), "UTF-8 or UTF-16 text", "a broken UTF-16 character");
    Ok(Cow::Owned(text.map_err(broken)?.into_bytes()))
}

/// Passes on the lines that make the mesh, `v` without colours and `f`, and counts.
struct Geometry<'a> {
    rest: &'a [u8],
    line: &'a [u8],
    /// the end of the line was cut off with its colour
    shortened: bool,
    /// number of the line handed on last, counted from 1
    number: usize,
    vertices: usize,
}

impl BufRead for Geometry<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.line.is_empty() && std::mem::take(&mut self.shortened) {
            self.line = b"\n";
        }
        while self.line.is_empty() && !self.rest.is_empty() {
            let len = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |at| at + 1);
            let (line, rest) = self.rest.split_at(len);
            (self.rest, self.number) = (rest, self.number + 1);
            let kind = line.trim_ascii_start();
            if let [kind @ (b'v' | b'f'), b' ' | b'\t', ..] = kind {
                self.vertices += usize::from(*kind == b'v');
                self.line = if *kind == b'v' { without_colour(line) } else { line };
                self.shortened = self.line.len() < line.len();
            }
        }
        Ok(self.line)
    }

    fn consume(&mut self, amount: usize) {
        self.line = &self.line[amount..];
    }
}

impl Read for Geometry<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let amount = self.fill_buf()?.read(out)?;
        self.consume(amount);
        Ok(amount)
    }
}

/// The line up to the third coordinate when more than a weight follows: files in which only some vertices have a colour
/// would be refused.
fn without_colour(line: &[u8]) -> &[u8] {
    let (mut words, mut end, mut in_word) = (0, line.len(), false);
    for (at, byte) in line.iter().enumerate() {
        let blank = byte.is_ascii_whitespace();
        words += usize::from(!blank && !in_word);
        if blank && in_word && words == 4 {
            end = at;
        }
        in_word = !blank;
    }
    if words > 5 { &line[..end] } else { line }
}

/// Where and what: errors in the use of vertices are found only at the end, when `tobj` has lost the line.
fn place_of(error: LoadError, bytes: &[u8], number: usize) -> Syntax {
    let of_faces = matches!(error, LoadError::FaceVertexOutOfBounds | LoadError::InvalidPolygon);
    let found = || first_bad_face(bytes).filter(|_| of_faces);
    found().unwrap_or_else(|| {
        let expected = match error {
            LoadError::ReadError => "UTF-8 or UTF-16 text",
            LoadError::FaceParseError => "a face: numbers of vertices",
            LoadError::ScalingByZeroError => "a weight other than zero",
            _ => "three coordinates with a decimal point",
        };
        let line = bytes.split(|&b| b == b'\n').nth(number.saturating_sub(1)).unwrap_or_default();
        Syntax::unexpected(FilePlace::Line(number), expected, String::from_utf8_lossy(line.trim_ascii()))
    })
}

/// The first face without corners or with a corner that names no vertex.
fn first_bad_face(bytes: &[u8]) -> Option<Syntax> {
    let total = bytes.split(|&b| b == b'\n').filter(|line| matches!(line, [b'v', b' ' | b'\t', ..])).count();
    let (mut lines, mut before) = (NumberedLines::new(bytes, b'\n'), 0);
    while let Some(line) = lines.next() {
        let place = FilePlace::Line(lines.number());
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => before += 1,
            Some("f") if line.len() == 1 => return Some(Syntax::unexpected(place, "numbers of vertices", &line)),
            Some("f") => {
                let exists = |v: &i64| (1..=total as i64).contains(v) || (-before..0).contains(v);
                let named = words.filter_map(|w| w.split('/').next()?.parse::<i64>().ok());
                if let Some(vertex) = named.into_iter().find(|v| !exists(v)) {
                    return Some(Syntax { place, defect: Defect::NoSuchVertex { vertex, vertices: total } });
                }
            }
            _ => {}
        }
    }
    None
}

/// OBJ with the fewest digits that read back as the same number, at most 17.
pub(super) fn write(soup: &Soup, unit: &str, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "# touchup, unit {unit}, frame O")?;
    for p in &soup.positions {
        writeln!(out, "v {:?} {:?} {:?}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in &soup.faces {
        writeln!(out, "f {} {} {}", u64::from(*a) + 1, u64::from(*b) + 1, u64::from(*c) + 1)?;
    }
    Ok(())
}
