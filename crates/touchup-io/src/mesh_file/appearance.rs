//! How the mesh in a file looks: colours of its vertices, texture coordinates of the corners of its faces.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use touchup_core::mesh::{Appearance, Texture, TriMesh, VertexColours, is_place};

use super::defect::Syntax;
use super::{Format, MeshFileError, MeshUnit, obj, ply};
use crate::file_error::read_file;

/// Triangles as a file has them, and how they look.
#[derive(Debug, Default)]
pub(super) struct PaintedSoup {
    pub positions: Vec<Point3<f64>>,
    pub faces: Vec<[u32; 3]>,
    /// as many as there are positions
    pub colours: Option<VertexColours>,
    pub texture: Option<SoupTexture>,
}

/// The texture of a [`PaintedSoup`].
#[derive(Debug, Default)]
pub(super) struct SoupTexture {
    /// of the three corners of each triangle
    pub corners: Vec<[[f32; 2]; 3]>,
    /// which image each triangle shows
    pub shown: Vec<u32>,
    /// as the file names them
    pub images: Vec<String>,
}

/// How the mesh in a PLY or OBJ file looks; `None` where nothing is said of it, and for files of other kinds.
///
/// - `unit`: of the coordinates in the file.
///
/// # Errors
/// [`MeshFileError::File`], [`MeshFileError::Syntax`], [`MeshFileError::Mesh`].
pub fn read_appearance(path: &Path, unit: MeshUnit) -> Result<Option<Appearance>, MeshFileError> {
    // a pipe cannot be read twice
    if !path.is_file() {
        return Ok(None);
    }
    let bytes = read_file(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let soup = match Format::of_content(&bytes).map_or_else(|| Format::of_name(path), Ok) {
        Ok(Format::Ply) => ply::read_painted(&bytes, unit.metres()),
        Ok(Format::Obj) => obj::read_painted(&bytes, unit.metres(), folder),
        Ok(Format::Stl) | Err(_) => return Ok(None),
    };
    let soup = soup.map_err(|Syntax { place, defect }| MeshFileError::Syntax { path: path.into(), place, defect })?;
    if soup.faces.is_empty() || (soup.colours.is_none() && soup.texture.is_none()) {
        return Ok(None);
    }
    of_soup(soup, folder).map(Some).map_err(|source| MeshFileError::Mesh { path: path.into(), source })
}

/// Faces without a place or an area, and vertices that no other face uses, show nothing.
fn of_soup(soup: PaintedSoup, folder: &Path) -> Result<Appearance, touchup_core::mesh::MeshError> {
    let corners = |face: &[u32; 3]| Some(face.map(|v| soup.positions.get(v as usize).copied().filter(is_place)));
    let is_shown = |face: &[u32; 3]| match corners(face) {
        Some([Some(a), Some(b), Some(c)]) => (b - a).cross(&(c - a)).norm_squared() > 0.0,
        _ => false,
    };
    let kept: Vec<usize> = (0..soup.faces.len()).filter(|&at| is_shown(&soup.faces[at])).collect();
    let mut renamed = vec![u32::MAX; soup.positions.len()];
    kept.iter().flat_map(|&at| soup.faces[at]).for_each(|v| renamed[v as usize] = 0);
    let used: Vec<usize> = (0..renamed.len()).filter(|&v| renamed[v] == 0).collect();
    used.iter().zip(0..).for_each(|(&v, name)| renamed[v] = name);
    let positions = used.iter().map(|&v| soup.positions[v]).collect();
    let faces = kept.iter().map(|&at| soup.faces[at].map(|v| renamed[v as usize])).collect();
    let colours = soup.colours.map(|colours| match colours {
        VertexColours::Rgb(of) => VertexColours::Rgb(used.iter().map(|&v| of[v]).collect()),
        VertexColours::Rgba(of) => VertexColours::Rgba(used.iter().map(|&v| of[v]).collect()),
    });
    let texture = soup.texture.map(|texture| Texture {
        corners: kept.iter().map(|&at| texture.corners[at]).collect(),
        shown: kept.iter().map(|&at| texture.shown[at]).collect(),
        images: texture.images.iter().map(|name| folder.join(name)).collect(),
    });
    Ok(Appearance::new(TriMesh::new(positions, faces)?, colours, texture))
}

impl SoupTexture {
    /// Of the faces that `mesh` has, in their order, for a file in `folder`: an image in or below it is named by the way from there, any
    /// other from the root.
    pub fn of(texture: &Texture, mesh: &TriMesh, folder: &Path) -> Self {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = absolute(folder);
        let name = |image: &PathBuf| {
            let image = absolute(image);
            image.strip_prefix(&folder).unwrap_or(&image).display().to_string()
        };
        let slots = || mesh.faces().map(|(face, _)| face.0 as usize);
        Self {
            corners: slots().map(|slot| texture.corners[slot]).collect(),
            shown: slots().map(|slot| texture.shown[slot]).collect(),
            images: texture.images.iter().map(name).collect(),
        }
    }
}
