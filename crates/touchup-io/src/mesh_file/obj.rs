//! Wavefront OBJ, parsed by `tobj`.

use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;

use nalgebra::Point3;
use tobj::{LoadError, LoadOptions, Material, Model};
use touchup_geometry::mesh::VertexColours;

use super::appearance::{PaintedSoup, SoupTexture};
use super::column::{ColumnValues, VertexColumn};
use super::defect::{Defect, Syntax};
use super::soup::{Soup, divided};
use super::text::NumberedLines;
use crate::file_error::FilePlace;

/// Reads all objects and groups as one mesh, with coordinates times `scale`. Skips lines, points,
/// normals, texture and materials. Vertices come in order of first use by a face.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<Soup, Syntax> {
    let bytes = joined(as_utf8(bytes)?);
    let mut lines = ObjLineFilter::new(&bytes, false);
    let no_materials = |_: &Path| Err(LoadError::OpenFileFailed);
    let (models, _) = load(&bytes, &mut lines, no_materials)?;
    let mut soup = Soup::default();
    for model in &models {
        take(model, scale, &mut soup.positions, &mut soup.faces, |_| {})
            .map_err(|face| crossing(&bytes, face))?;
    }
    soup.unused = lines.vertices - soup.positions.len().min(lines.vertices);
    Ok(soup)
}

/// The triangles of [`read`] with their appearance; material files come from `folder`.
///
/// Colours count if each vertex has one: three numbers from 0 to 1 after its coordinates. A file
/// with neither colours nor texture coordinates is not parsed.
pub(super) fn read_painted(bytes: &[u8], scale: f64, folder: &Path) -> Result<PaintedSoup, Syntax> {
    let bytes = joined(as_utf8(bytes)?);
    let mut lines = ObjLineFilter::new(&bytes, true);
    lines.has_colours = every_vertex_has_a_colour(&bytes);
    if !lines.has_colours && !has_texture_coordinates(&bytes) {
        return Ok(PaintedSoup::default());
    }
    // a missing or damaged material file names no image
    let materials = |name: &Path| {
        let file = File::open(folder.join(name)).map_err(|_| LoadError::OpenFileFailed)?;
        tobj::load_mtl_buf(&mut BufReader::new(file))
    };
    let (models, materials) = load(&bytes, &mut lines, materials)?;
    let (mut soup, mut texture, mut colours) =
        (PaintedSoup::default(), SoupTexture::default(), Vec::new());
    let mut image_of = vec![None; materials.len()];
    for model in &models {
        let mesh = &model.mesh;
        // [0, 0] for a corner without coordinates
        let of = |corner: usize| {
            let number = mesh.texcoord_indices.get(corner).copied();
            let coordinates = mesh.texcoords.as_chunks::<2>().0;
            let of_number = |number: u32| coordinates.get(number as usize);
            number
                .and_then(of_number)
                .map_or([0.0; 2], |uv| uv.map(|x| x as f32))
        };
        let PaintedSoup {
            positions, faces, ..
        } = &mut soup;
        let add = |corners: [usize; 3]| texture.corners.push(corners.map(of));
        take(model, scale, positions, faces, add).map_err(|face| crossing(&bytes, face))?;
        let shown = mesh.material_id.and_then(|id| {
            let name = materials.get(id)?.diffuse_texture.clone()?;
            Some(*image_of[id].get_or_insert_with(|| {
                texture.images.push(name);
                texture.images.len() as u32 - 1
            }))
        });
        texture.shown.resize(soup.faces.len(), shown.unwrap_or(0));
        colours.extend(
            mesh.vertex_color
                .as_chunks()
                .0
                .iter()
                .map(|of| of.map(|x| (x * 255.0).round() as u8)),
        );
    }
    let has_texture = models
        .iter()
        .any(|model| !model.mesh.texcoord_indices.is_empty());
    soup.texture = has_texture.then_some(texture);
    soup.colours = (!colours.is_empty() && colours.len() == soup.positions.len())
        .then_some(VertexColours::Rgb(colours));
    Ok(soup)
}

type ObjModels = (Vec<Model>, Vec<Material>);

fn load(
    bytes: &[u8],
    lines: &mut ObjLineFilter,
    materials: impl Fn(&Path) -> tobj::MTLLoadResult,
) -> Result<ObjModels, Syntax> {
    let options = LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let loaded = tobj::load_obj_buf(&mut *lines, &options, materials);
    let (models, materials) = loaded.map_err(|error| place_of(error, bytes, lines.number))?;
    let has_corners = |model: &Model| model.mesh.face_arities.iter().all(|&corners| corners > 0);
    if !models.iter().all(has_corners) {
        return Err(place_of(LoadError::InvalidPolygon, bytes, lines.number));
    }
    Ok((models, materials.unwrap_or_default()))
}

/// Adds the triangles of a model; `corners` gets the indices of each one's three corners in the
/// model. The error is the number of a face with crossing sides.
fn take(
    model: &Model,
    scale: f64,
    positions: &mut Vec<Point3<f64>>,
    faces: &mut Vec<[u32; 3]>,
    mut corners: impl FnMut([usize; 3]),
) -> Result<(), usize> {
    let (mesh, first) = (&model.mesh, positions.len());
    let own = mesh.positions.as_chunks().0.iter();
    positions.extend(own.map(|&p| Point3::from(p) * scale));
    let mut add = |of_model: [usize; 3]| {
        faces.push(of_model.map(|at| mesh.indices[at] + first as u32));
        corners(of_model);
    };
    // pure triangles have no list of face sizes
    if mesh.face_arities.is_empty() {
        (0..mesh.indices.len() / 3).for_each(|face| add([0, 1, 2].map(|at| 3 * face + at)));
    }
    let mut start = 0;
    for (face, &count) in mesh.face_arities.iter().enumerate() {
        let vertices = &mesh.indices[start..start + count as usize];
        let triangles = divided(vertices, &positions[first..]).ok_or(face)?;
        for triangle in triangles {
            add(triangle.map(|at| start + at as usize));
        }
        start += count as usize;
    }
    Ok(())
}

/// Crossing sides of a face, by its number among faces with three corners and more.
fn crossing(bytes: &[u8], face: usize) -> Syntax {
    let mut lines = NumberedLines::new(bytes, b'\n');
    let numbers = std::iter::from_fn(|| {
        let line = lines.next()?;
        let mut words = line.split_ascii_whitespace();
        let is_face = words.next() == Some("f") && words.count() > 2;
        Some(is_face.then_some(lines.number()))
    });
    let line = numbers.flatten().nth(face).unwrap_or_default();
    Syntax {
        place: FilePlace::Line(line),
        defect: Defect::SidesCross,
    }
}

/// The text as UTF-8, converted from UTF-16 with a byte order mark. Comments may be in any
/// encoding.
fn as_utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>, Syntax> {
    let pair: fn([u8; 2]) -> u16 = match bytes {
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        _ => {
            return Ok(Cow::Borrowed(
                bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes),
            ));
        }
    };
    let units = bytes[2..].as_chunks().0.iter().map(|&b| pair(b));
    let text: Result<String, _> = char::decode_utf16(units).collect();
    let broken = |_| {
        Syntax::unexpected(
            FilePlace::Byte(0),
            "UTF-8 or UTF-16 text",
            "a broken UTF-16 character",
        )
    };
    Ok(Cow::Owned(text.map_err(broken)?.into_bytes()))
}

/// Joins lines that end with a backslash to the next; later lines keep their numbers.
fn joined(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    let goes_on = |line: &[u8]| line.trim_ascii_end().ends_with(b"\\");
    let lines = || bytes.split_inclusive(|&b| b == b'\n');
    if !bytes.contains(&b'\\') || !lines().any(goes_on) {
        return bytes;
    }
    let (mut text, mut ends) = (Vec::with_capacity(bytes.len()), 0);
    for line in lines() {
        if goes_on(line) {
            let end = line.trim_ascii_end().len() - 1;
            text.extend_from_slice(&line[..end]);
            text.push(b' ');
            ends += 1;
        } else {
            text.extend_from_slice(line);
            text.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut ends)));
        }
    }
    Cow::Owned(text)
}

/// Passes on the lines of the mesh, `v` without colours and `f`, or also those of its appearance,
/// and counts.
struct ObjLineFilter<'a> {
    rest: &'a [u8],
    /// passes on `vt`, `mtllib` and `usemtl` too
    is_painted: bool,
    /// passes on colours too
    has_colours: bool,
    line: &'a [u8],
    /// the end of the line was cut off with its colour
    shortened: bool,
    /// number of the last line passed on, from 1
    number: usize,
    vertices: usize,
}

impl<'a> ObjLineFilter<'a> {
    fn new(rest: &'a [u8], is_painted: bool) -> Self {
        Self {
            rest,
            is_painted,
            has_colours: false,
            line: &[],
            shortened: false,
            number: 0,
            vertices: 0,
        }
    }

    fn is_passed_on(&self, line: &[u8]) -> bool {
        let word = line
            .split(u8::is_ascii_whitespace)
            .next()
            .unwrap_or_default();
        matches!(word, b"v" | b"f")
            || (self.is_painted && matches!(word, b"vt" | b"mtllib" | b"usemtl"))
    }
}

impl BufRead for ObjLineFilter<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.line.is_empty() && std::mem::take(&mut self.shortened) {
            self.line = b"\n";
        }
        while self.line.is_empty() && !self.rest.is_empty() {
            let len = self
                .rest
                .iter()
                .position(|&b| b == b'\n')
                .map_or(self.rest.len(), |at| at + 1);
            let (line, rest) = self.rest.split_at(len);
            (self.rest, self.number) = (rest, self.number + 1);
            let kind = line.trim_ascii_start();
            if self.is_passed_on(kind) {
                let is_vertex = matches!(kind, [b'v', b' ' | b'\t', ..]);
                self.vertices += usize::from(is_vertex);
                self.line = if is_vertex && !self.has_colours {
                    without_colour(line)
                } else {
                    line
                };
                self.shortened = self.line.len() < line.len();
            }
        }
        Ok(self.line)
    }

    fn consume(&mut self, amount: usize) {
        self.line = &self.line[amount..];
    }
}

impl Read for ObjLineFilter<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let amount = self.fill_buf()?.read(out)?;
        self.consume(amount);
        Ok(amount)
    }
}

fn every_vertex_has_a_colour(bytes: &[u8]) -> bool {
    let lines = bytes.split(|&b| b == b'\n').map(<[u8]>::trim_ascii_start);
    let mut vertices = lines.filter(|line| matches!(line, [b'v', b' ' | b'\t', ..]));
    vertices.all(|line| {
        line.split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty())
            .count()
            == 7
    })
}

fn has_texture_coordinates(bytes: &[u8]) -> bool {
    bytes
        .split(|&b| b == b'\n')
        .any(|line| matches!(line.trim_ascii_start(), [b'v', b't', b' ' | b'\t', ..]))
}

/// The line up to the third coordinate if more than a weight follows: `tobj` refuses files with
/// colours on only some vertices.
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

/// Place and defect: `tobj` reports vertex errors only at the end, without the line.
fn place_of(error: LoadError, bytes: &[u8], number: usize) -> Syntax {
    let of_faces = matches!(
        error,
        LoadError::FaceVertexOutOfBounds | LoadError::InvalidPolygon
    );
    let found = || first_bad_face(bytes).filter(|_| of_faces);
    found().unwrap_or_else(|| {
        let expected = match error {
            LoadError::ReadError => "UTF-8 or UTF-16 text",
            LoadError::FaceParseError => "a face: numbers of vertices",
            LoadError::ScalingByZeroError => "a weight other than zero",
            _ => "three coordinates with a decimal point",
        };
        let line = bytes
            .split(|&b| b == b'\n')
            .nth(number.saturating_sub(1))
            .unwrap_or_default();
        Syntax::unexpected(
            FilePlace::Line(number),
            expected,
            String::from_utf8_lossy(line.trim_ascii()),
        )
    })
}

/// The first face without corners or with a missing vertex.
fn first_bad_face(bytes: &[u8]) -> Option<Syntax> {
    let total = bytes
        .split(|&b| b == b'\n')
        .filter(|line| matches!(line, [b'v', b' ' | b'\t', ..]))
        .count();
    let (mut lines, mut before) = (NumberedLines::new(bytes, b'\n'), 0);
    while let Some(line) = lines.next() {
        let place = FilePlace::Line(lines.number());
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => before += 1,
            Some("f") if line.len() == 1 => {
                return Some(Syntax::unexpected(place, "numbers of vertices", &line));
            }
            Some("f") => {
                let exists = |v: &i64| (1..=total as i64).contains(v) || (-before..0).contains(v);
                let named = words.filter_map(|w| w.split('/').next()?.parse::<i64>().ok());
                if let Some(vertex) = named.into_iter().find(|v| !exists(v)) {
                    return Some(Syntax {
                        place,
                        defect: Defect::NoSuchVertex {
                            vertex,
                            vertices: total,
                        },
                    });
                }
            }
            _ => {}
        }
    }
    None
}

/// OBJ with the fewest digits that read back as the same number, at most 17; with the colours among
/// `columns`, by `ids` of the vertices.
///
/// - `materials`: name of the material file, if there are images.
pub(super) fn write(
    soup: &Soup,
    ids: &[usize],
    columns: &[VertexColumn],
    texture: Option<&SoupTexture>,
    [unit, materials]: [&str; 2],
    out: &mut impl Write,
) -> io::Result<()> {
    writeln!(out, "# touchup, unit {unit}, frame O")?;
    let has_images = texture.is_some_and(|texture| !texture.images.is_empty());
    if has_images {
        writeln!(out, "mtllib {materials}")?;
    }
    let bytes = |name| match columns
        .iter()
        .find(|column| column.name == name)
        .map(|column| &column.values)
    {
        Some(ColumnValues::Byte(values)) => Some(values),
        _ => None,
    };
    let colours = bytes("red").zip(bytes("green")).zip(bytes("blue"));
    for (p, &id) in soup.positions.iter().zip(ids) {
        write!(out, "v {:?} {:?} {:?}", p.x, p.y, p.z)?;
        if let Some(((r, g), b)) = colours {
            // four digits give back the byte
            [r, g, b]
                .iter()
                .try_for_each(|values| write!(out, " {:.4}", f64::from(values[id]) / 255.0))?;
        }
        writeln!(out)?;
    }
    let Some(texture) = texture else {
        return soup.faces.iter().try_for_each(|[a, b, c]| {
            writeln!(out, "f {} {} {}", named(*a), named(*b), named(*c))
        });
    };
    let mut numbers = HashMap::new();
    for uv in texture.corners.as_flattened() {
        let next = numbers.len() as u64 + 1;
        if let Entry::Vacant(entry) = numbers.entry(uv.map(f32::to_bits)) {
            entry.insert(next);
            writeln!(out, "vt {:?} {:?}", uv[0], uv[1])?;
        }
    }
    let mut used = None;
    for ((corners, shown), coordinates) in
        soup.faces.iter().zip(&texture.shown).zip(&texture.corners)
    {
        if has_images && used != Some(shown) {
            writeln!(out, "usemtl {}", material(*shown))?;
            used = Some(shown);
        }
        write!(out, "f")?;
        for (v, uv) in corners.iter().zip(coordinates) {
            write!(out, " {}/{}", named(*v), numbers[&uv.map(f32::to_bits)])?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// The materials that [`write`] names: an image each.
pub(super) fn write_materials(images: &[String], out: &mut impl Write) -> io::Result<()> {
    images.iter().zip(0..).try_for_each(|(image, at)| {
        writeln!(out, "newmtl {}\nKd 1 1 1\nmap_Kd {image}", material(at))
    })
}

fn material(shown: u32) -> String {
    format!("image_{shown}")
}

fn named(vertex: u32) -> u64 {
    u64::from(vertex) + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_does_not_say_how_it_looks_is_not_parsed_for_that() {
        let read = |text: String| read_painted(text.as_bytes(), 1.0, Path::new(""));
        let plain = |colour: &str| {
            format!("v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0{colour}\nusemtl x\nf 1 2 nothing\n")
        };
        let soup = read(plain("")).expect("its faces are not looked at");
        assert!(soup.faces.is_empty() && soup.colours.is_none() && soup.texture.is_none());
        assert!(
            read(format!("  vt 0 0\n{}", plain(""))).is_err(),
            "its faces may have texture coordinates"
        );
        assert!(
            read(plain(" 0 0 1").replacen("v 0 0 0", "v 0 0 0 0 0 0", 1)).is_err(),
            "its vertices have colours"
        );
    }
}
