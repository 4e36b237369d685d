//! Colours and texture coordinates in PLY files.

use nalgebra::Point3;
use touchup_geometry::mesh::VertexColours;

use super::super::appearance::{PaintedSoup, SoupTexture};
use super::super::defect::Syntax;
use super::super::soup::Polygons;
use super::body::Body;
use super::header::{PlyElement, PlyHeader, PlyKind};
use super::{IMAGE, OF_CORNERS, read, read_vertices, vertex_list, vertices};
use crate::scalar::Scalar;

/// Usual names of the colours; the fourth is opacity.
const COLOURS: [[&str; 4]; 2] = [
    ["red", "green", "blue", "alpha"],
    [
        "diffuse_red",
        "diffuse_green",
        "diffuse_blue",
        "diffuse_alpha",
    ],
];
/// Usual names of the texture coordinates of vertices.
const COORDINATES: [[&str; 2]; 4] = [
    ["s", "t"],
    ["u", "v"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
];
/// The triangles of [`read`] with their appearance.
pub(in crate::mesh_file) fn read_painted(bytes: &[u8], scale: f64) -> Result<PaintedSoup, Syntax> {
    let header = PlyHeader::read(bytes)?;
    let element = |name: &str| header.elements.iter().find(|element| element.name == name);
    let Some(vertex) = element("vertex") else {
        return Ok(PaintedSoup::default());
    };
    let colours = COLOURS
        .into_iter()
        .find(|names| names[..3].iter().all(|name| vertex.scalar(name).is_some()));
    let coordinates = COORDINATES
        .into_iter()
        .find(|names| names.iter().all(|name| vertex.scalar(name).is_some()));
    let face = element("face").filter(|face| face.list(OF_CORNERS[0]).is_some());
    if colours.is_none() && coordinates.is_none() && face.is_none() {
        return Ok(PaintedSoup::default());
    }
    let ([r, g, b, a], [u, v]) = (colours.unwrap_or([""; 4]), coordinates.unwrap_or([""; 2]));
    let mut body = body_of(bytes, &header, "vertex")?;
    let (positions, [r, g, b, a, u, v]) =
        read_vertices(&mut body, vertex, scale, [r, g, b, a, u, v])?;
    let kind = colours
        .and_then(|names| vertex.scalar(names[0]))
        .map(|column| vertex.properties[column].kind);
    // 0 to 1 unless they are integers
    let full = match kind {
        Some(PlyKind::Scalar(Scalar::F32 | Scalar::F64)) => 255.0,
        _ => 1.0,
    };
    let colours = vertex_colours([r, g, b], a, full);
    let images = images(&bytes[..header.len]);
    if let Some(face) = face {
        let (faces, texture) = read_corners(bytes, &header, face, &positions)?;
        return Ok(PaintedSoup {
            positions,
            faces,
            colours,
            texture: Some(SoupTexture { images, ..texture }),
        });
    }
    let faces = read(bytes, scale)?.faces;
    let texture = u.zip(v).map(|(u, v)| {
        let of = |&v_id: &u32| {
            u.get(v_id as usize)
                .zip(v.get(v_id as usize))
                .map_or([0.0; 2], |(&u, &v)| [u, v])
        };
        let corners = faces
            .iter()
            .map(|face| [of(&face[0]), of(&face[1]), of(&face[2])])
            .collect();
        SoupTexture {
            corners,
            shown: vec![0; faces.len()],
            images,
        }
    });
    Ok(PaintedSoup {
        positions,
        faces,
        colours,
        texture,
    })
}

/// Colours of the vertices, if all of red, green and blue are there.
///
/// - `full`: factor from a value to a byte.
fn vertex_colours(
    [r, g, b]: [Option<Vec<f32>>; 3],
    opacity: Option<Vec<f32>>,
    full: f32,
) -> Option<VertexColours> {
    let byte = |value: f32| (value * full).round() as u8;
    let (r, g, b) = (r?, g?, b?);
    let vertices = 0..r.len();
    Some(match opacity {
        Some(a) => {
            let of = |i: usize| [r[i], g[i], b[i], a[i]].map(byte);
            VertexColours::Rgba(vertices.map(of).collect())
        }
        None => VertexColours::Rgb(vertices.map(|i| [r[i], g[i], b[i]].map(byte)).collect()),
    })
}

/// The body from the element `name` on.
fn body_of<'a>(bytes: &'a [u8], header: &PlyHeader, name: &str) -> Result<Body<'a>, Syntax> {
    let mut body = Body::new(bytes, header);
    for element in &header.elements {
        body.check_count(element)?;
        if element.name == name {
            break;
        }
        body.rows(element, element.count, None, |_, _| Ok(()))?;
    }
    Ok(body)
}

/// Faces with the texture coordinates of their corners: reads each row once for either list, and
/// once for the image.
fn read_corners(
    bytes: &[u8],
    header: &PlyHeader,
    face: &PlyElement,
    positions: &[Point3<f64>],
) -> Result<(Vec<[u32; 3]>, SoupTexture), Syntax> {
    let body = || body_of(bytes, header, "face");
    let (list, mut polygons) = (vertex_list(face)?, Polygons::default());
    body()?.rows(face, face.count, Some(list), |row, place| {
        polygons.push(vertices(row, place), place)
    })?;
    // row of each triangle, and its corners of the polygon
    let (mut faces, mut places) = (Vec::new(), Vec::new());
    polygons.divide(positions, |row, vertices, triangle| {
        faces.push(triangle.map(|at| vertices[at as usize]));
        places.push((row, triangle));
    })?;
    let (mut values, mut starts) = (Vec::new(), Vec::with_capacity(face.count));
    body()?.rows(face, face.count, face.list(OF_CORNERS[0]), |row, _| {
        starts.push(values.len());
        values.extend(row.iter().map(|&value| value as f32));
        Ok(())
    })?;
    starts.push(values.len());
    let mut shown_by_row = Vec::new();
    if let Some(column) = face.scalar(OF_CORNERS[1]) {
        body()?.rows(face, face.count, None, |row, _| {
            shown_by_row.push(row[column] as u32);
            Ok(())
        })?;
    }
    let corner = |row: usize, corner: u32| {
        let own = &values[starts[row]..starts[row + 1]];
        own.get(2 * corner as usize..)
            .and_then(|rest| rest.first_chunk())
            .copied()
            .unwrap_or([0.0; 2])
    };
    let corners = places
        .iter()
        .map(|&(row, corners)| corners.map(|at| corner(row, at)))
        .collect();
    let shown = places
        .iter()
        .map(|&(row, _)| shown_by_row.get(row).copied().unwrap_or(0))
        .collect();
    Ok((
        faces,
        SoupTexture {
            corners,
            shown,
            images: Vec::new(),
        },
    ))
}

fn images(header: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(header);
    text.lines()
        .filter_map(|line| line.trim().strip_prefix(IMAGE))
        .map(|name| name.trim().to_owned())
        .collect()
}
