//! PLY: ASCII and binary of both byte orders, any scalar type, any further elements and properties.

mod body;
mod header;
pub(super) mod painted;

use std::io::{self, Write};

use nalgebra::Point3;

use super::appearance::SoupTexture;
use super::column::{ColumnValues, VertexColumn};
use super::defect::Syntax;
use super::soup::{Polygons, Soup};
use crate::file_error::FilePlace;
use body::Body;
use header::{PlyElement, PlyHeader};

/// Usual names of the list of a face's vertices.
const VERTEX_LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Names of a face's list of texture coordinates of its corners, and of its image.
const OF_CORNERS: [&str; 2] = ["texcoord", "texnumber"];
/// Start of a comment that names an image.
const IMAGE: &str = "comment TextureFile ";

/// Reads `vertex`, and `face` or `tristrips`, with coordinates times `scale` and polygons split
/// into triangles.
pub(super) fn read(bytes: &[u8], scale: f64) -> Result<Soup, Syntax> {
    let header = PlyHeader::read(bytes)?;
    let mut body = Body::new(bytes, &header);
    let (mut soup, mut polygons) = (Soup::default(), Polygons::default());
    for element in &header.elements {
        body.check_count(element)?;
        match element.name.as_str() {
            "vertex" => (soup.positions, _) = read_vertices(&mut body, element, scale, [])?,
            "face" => {
                let (list, triangles) = (vertex_list(element)?, body.triangles(element));
                let rest = element.count - triangles.len();
                soup.faces.extend(triangles);
                body.rows(element, rest, Some(list), |row, place| {
                    polygons.push(vertices(row, place), place)
                })?;
            }
            "tristrips" => {
                let list = vertex_list(element)?;
                body.rows(element, element.count, Some(list), |row, place| {
                    strips(row, place, &mut soup.faces)
                })?;
            }
            _ => body.rows(element, element.count, None, |_, _| Ok(()))?,
        }
    }
    let Soup {
        positions, faces, ..
    } = &mut soup;
    polygons.divide(positions, |_, vertices, triangle| {
        faces.push(triangle.map(|at| vertices[at as usize]));
    })?;
    Ok(soup)
}

/// For each name the numbers of the rows, if the file has them.
type Columns<const N: usize> = [Option<Vec<f32>>; N];

/// The positions of the vertices, times `scale`, and their available scalar properties `names`.
pub(super) fn read_columns<const N: usize>(
    bytes: &[u8],
    scale: f64,
    names: [&str; N],
) -> Result<(Vec<Point3<f64>>, Columns<N>), Syntax> {
    let header = PlyHeader::read(bytes)?;
    let mut body = Body::new(bytes, &header);
    for element in &header.elements {
        body.check_count(element)?;
        if element.name == "vertex" {
            return read_vertices(&mut body, element, scale, names);
        }
        body.rows(element, element.count, None, |_, _| Ok(()))?;
    }
    Ok((Vec::new(), [const { None }; N]))
}

fn read_vertices<const N: usize>(
    body: &mut Body,
    element: &PlyElement,
    scale: f64,
    names: [&str; N],
) -> Result<(Vec<Point3<f64>>, Columns<N>), Syntax> {
    let place = position_columns(element)?;
    let found = names.map(|name| element.scalar(name));
    let mut columns = found.map(|column| column.map(|_| Vec::with_capacity(element.count)));
    if N == 0
        && let Some(positions) = body.fixed_rows(element, place, scale)
    {
        return Ok((positions, columns));
    }
    let mut positions = Vec::with_capacity(element.count);
    body.rows(element, element.count, None, |row, _| {
        positions.push(Point3::from(place.map(|column| scale * row[column])));
        for (values, column) in columns.iter_mut().zip(found) {
            if let (Some(values), Some(column)) = (values, column) {
                values.push(row[column] as f32);
            }
        }
        Ok(())
    })?;
    Ok((positions, columns))
}

/// The columns of x, y and z.
fn position_columns(element: &PlyElement) -> Result<[usize; 3], Syntax> {
    let mut columns = [0; 3];
    for (column, name) in columns.iter_mut().zip(["x", "y", "z"]) {
        *column = element.scalar(name).ok_or_else(|| {
            Syntax::unexpected(
                FilePlace::Line(element.line),
                "a vertex with x, y and z",
                format!("no property {name}"),
            )
        })?;
    }
    Ok(columns)
}

/// The list of the vertices of each face.
fn vertex_list(element: &PlyElement) -> Result<usize, Syntax> {
    let list = VERTEX_LISTS.iter().find_map(|name| element.list(name));
    list.ok_or_else(|| {
        Syntax::unexpected(
            FilePlace::Line(element.line),
            "faces with a list vertex_indices",
            "none",
        )
    })
}

/// Vertices by their numbers.
fn vertices(numbers: &[f64], place: FilePlace) -> impl Iterator<Item = Result<u32, Syntax>> {
    numbers.iter().map(move |&number| match number as u32 {
        whole if f64::from(whole) == number => Ok(whole),
        _ => Err(Syntax::unexpected(place, "a vertex number", number)),
    })
}

/// Strips end with −1; every second triangle of a strip runs the other way round.
fn strips(numbers: &[f64], place: FilePlace, faces: &mut Vec<[u32; 3]>) -> Result<(), Syntax> {
    for strip in numbers.split(|&n| n == -1.0) {
        let strip: Vec<u32> = vertices(strip, place).collect::<Result<_, _>>()?;
        for (i, corners) in strip.windows(3).enumerate() {
            let (a, b) = if i % 2 == 0 { (0, 1) } else { (1, 0) };
            faces.push([corners[a], corners[b], corners[2]]);
        }
    }
    Ok(())
}

/// Binary little endian, coordinates as double, without rounding. Each column is a property of the
/// vertices, the texture one of the faces.
///
/// - `ids`: indices of the vertices in the columns.
pub(super) fn write(
    soup: &Soup,
    ids: &[usize],
    columns: &[VertexColumn],
    texture: Option<&SoupTexture>,
    unit: &str,
    out: &mut impl Write,
) -> io::Result<()> {
    let kind = |values: &ColumnValues| match values {
        ColumnValues::Single(_) => "float",
        ColumnValues::Byte(_) => "uchar",
    };
    let properties: String = columns
        .iter()
        .map(|column| format!("property {} {}\n", kind(&column.values), column.name))
        .collect();
    let images: String = texture
        .iter()
        .flat_map(|texture| &texture.images)
        .map(|name| format!("{IMAGE}{name}\n"))
        .collect();
    let [coordinates, number] = OF_CORNERS;
    let of_faces = match texture {
        None => String::new(),
        Some(_) => format!("property list uchar float {coordinates}\nproperty uint {number}\n"),
    };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment touchup, unit {unit}, frame O\n{images}element vertex {}\n\
         property double x\nproperty double y\nproperty double z\n{properties}element face {}\n\
         property list uchar uint vertex_indices\n{of_faces}end_header\n",
        soup.positions.len(),
        soup.faces.len()
    )?;
    for (p, &id) in soup.positions.iter().zip(ids) {
        p.coords
            .iter()
            .try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        columns.iter().try_for_each(|column| match &column.values {
            ColumnValues::Single(values) => out.write_all(&values[id].to_le_bytes()),
            ColumnValues::Byte(values) => out.write_all(&[values[id]]),
        })?;
    }
    for (at, corners) in soup.faces.iter().enumerate() {
        out.write_all(&[3])?;
        for vertex in corners {
            out.write_all(&vertex.to_le_bytes())?;
        }
        if let Some(texture) = texture {
            out.write_all(&[6])?;
            texture.corners[at]
                .as_flattened()
                .iter()
                .try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
            out.write_all(&texture.shown[at].to_le_bytes())?;
        }
    }
    Ok(())
}
