//! The text at the head of a PLY file: elements and their properties.

use super::super::defect::Syntax;
use super::super::text::NumberedLines;
use crate::file_error::FilePlace;
use crate::scalar::Scalar;

/// Encoding of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlyEncoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlyKind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: PlyKind,
}

/// An element of a PLY header: its count and properties.
#[derive(Debug)]
pub(super) struct PlyElement {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    /// line of its declaration
    pub line: usize,
}

impl PlyElement {
    /// Column of a scalar property.
    pub fn scalar(&self, name: &str) -> Option<usize> {
        self.properties
            .iter()
            .position(|p| p.name == name && matches!(p.kind, PlyKind::Scalar(_)))
    }

    /// Column of a list property.
    pub fn list(&self, name: &str) -> Option<usize> {
        self.properties
            .iter()
            .position(|p| p.name == name && matches!(p.kind, PlyKind::List { .. }))
    }

    /// Bytes of the shortest row: every list empty; in ASCII a digit and a blank for each value.
    pub fn shortest_row(&self, encoding: PlyEncoding) -> usize {
        let size = |property: &Property| match (encoding, property.kind) {
            (PlyEncoding::Ascii, _) => 2,
            (_, PlyKind::Scalar(scalar)) => scalar.size(),
            (_, PlyKind::List { count, .. }) => count.size(),
        };
        self.properties.iter().map(size).sum()
    }
}

pub(super) struct PlyHeader {
    pub encoding: PlyEncoding,
    pub elements: Vec<PlyElement>,
    pub end_of_line: u8,
    /// lines of the header
    pub lines: usize,
    /// bytes of the header
    pub len: usize,
}

impl PlyHeader {
    pub fn read(bytes: &[u8]) -> Result<Self, Syntax> {
        // the first line shows the line ending: the body may begin with any byte
        let end_of_line = match bytes {
            [b'p', b'l', b'y', b'\r', rest @ ..] if rest.first() != Some(&b'\n') => b'\r',
            _ => b'\n',
        };
        let mut lines = NumberedLines::new(bytes, end_of_line);
        let (mut encoding, mut elements) = (None, Vec::<PlyElement>::new());
        while let Some(line) = lines.next() {
            let place = FilePlace::Line(lines.number());
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words[..] {
                _ if lines.number() == 1 && line != "ply" => {
                    return Err(Syntax::unexpected(place, "'ply'", &line));
                }
                [] | ["ply" | "comment" | "obj_info", ..] => {}
                ["format", name, _] => encoding = Some(encoding_of(name, place)?),
                ["element", name, _] if elements.iter().any(|e| e.name == name) => {
                    return Err(Syntax::unexpected(place, "each element once", name));
                }
                ["element", name, count] => elements.push(element(name, count, lines.number())?),
                ["property", ref words @ ..] => {
                    let owner = elements.last_mut();
                    let owner = owner
                        .ok_or_else(|| Syntax::unexpected(place, "an element before it", &line))?;
                    owner.properties.push(property(words, place)?);
                }
                ["end_header"] => {
                    let encoding = encoding.ok_or_else(|| {
                        Syntax::unexpected(place, "a line 'format' before it", &line)
                    })?;
                    return Ok(Self {
                        encoding,
                        elements,
                        end_of_line,
                        lines: lines.number(),
                        len: lines.offset(),
                    });
                }
                _ => {
                    return Err(Syntax::unexpected(
                        place,
                        "format, comment, element, property or end_header",
                        &line,
                    ));
                }
            }
        }
        Err(Syntax::ends(
            FilePlace::Line(lines.number() + 1),
            "'ply' or the rest of the header up to 'end_header'",
        ))
    }
}

fn encoding_of(name: &str, place: FilePlace) -> Result<PlyEncoding, Syntax> {
    match name {
        "ascii" => Ok(PlyEncoding::Ascii),
        "binary_little_endian" => Ok(PlyEncoding::Little),
        "binary_big_endian" => Ok(PlyEncoding::Big),
        _ => Err(Syntax::unexpected(
            place,
            "ascii, binary_little_endian or binary_big_endian",
            name,
        )),
    }
}

fn element(name: &str, count: &str, line: usize) -> Result<PlyElement, Syntax> {
    let count = count
        .parse()
        .map_err(|_| Syntax::unexpected(FilePlace::Line(line), "how many there are", count))?;
    Ok(PlyElement {
        name: name.into(),
        count,
        properties: Vec::new(),
        line,
    })
}

fn scalar(name: &str, place: FilePlace) -> Result<Scalar, Syntax> {
    Scalar::of_name(name)
        .ok_or_else(|| Syntax::unexpected(place, "a type such as float or int", name))
}

fn property(words: &[&str], place: FilePlace) -> Result<Property, Syntax> {
    let (kind, name) = match *words {
        ["list", count, item, name] => (
            PlyKind::List {
                count: scalar(count, place)?,
                item: scalar(item, place)?,
            },
            name,
        ),
        [kind, name] => (PlyKind::Scalar(scalar(kind, place)?), name),
        _ => {
            return Err(Syntax::unexpected(
                place,
                "type and name of a property",
                words.join(" "),
            ));
        }
    };
    Ok(Property {
        name: name.into(),
        kind,
    })
}
