//! Appearance of a mesh file: colours of vertices, texture coordinates of face corners.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use touchup_geometry::mesh::{Appearance, MeshError, Texture, TriMesh, VertexColours, is_place};

/// Triangles of a file, with their appearance.
#[derive(Debug, Default)]
pub(super) struct PaintedSoup {
    pub positions: Vec<Point3<f64>>,
    pub faces: Vec<[u32; 3]>,
    /// one per position
    pub colours: Option<VertexColours>,
    pub texture: Option<SoupTexture>,
}

/// The texture of a [`PaintedSoup`].
#[derive(Debug, Default)]
pub(super) struct SoupTexture {
    /// of the three corners of each triangle
    pub corners: Vec<[[f32; 2]; 3]>,
    /// image index of each triangle
    pub shown: Vec<u32>,
    /// as the file names them
    pub images: Vec<String>,
}

impl PaintedSoup {
    /// Appearance for a file in `folder`. Drops faces without finite positions or an area, and
    /// unused vertices.
    pub fn appearance(self, folder: &Path) -> Result<Appearance, MeshError> {
        let soup = self;
        let corners = |face: &[u32; 3]| {
            Some(face.map(|v| soup.positions.get(v as usize).copied().filter(is_place)))
        };
        let is_shown = |face: &[u32; 3]| match corners(face) {
            Some([Some(a), Some(b), Some(c)]) => (b - a).cross(&(c - a)).norm_squared() > 0.0,
            _ => false,
        };
        let kept: Vec<usize> = (0..soup.faces.len())
            .filter(|&at| is_shown(&soup.faces[at]))
            .collect();
        let mut renamed = vec![u32::MAX; soup.positions.len()];
        kept.iter()
            .flat_map(|&at| soup.faces[at])
            .for_each(|v| renamed[v as usize] = 0);
        let used: Vec<usize> = (0..renamed.len()).filter(|&v| renamed[v] == 0).collect();
        used.iter()
            .zip(0..)
            .for_each(|(&v, name)| renamed[v] = name);
        let positions = used.iter().map(|&v| soup.positions[v]).collect();
        let faces = kept
            .iter()
            .map(|&at| soup.faces[at].map(|v| renamed[v as usize]))
            .collect();
        let colours = soup.colours.map(|colours| match colours {
            VertexColours::Rgb(of) => VertexColours::Rgb(used.iter().map(|&v| of[v]).collect()),
            VertexColours::Rgba(of) => VertexColours::Rgba(used.iter().map(|&v| of[v]).collect()),
        });
        let texture = soup.texture.map(|texture| Texture {
            corners: kept.iter().map(|&at| texture.corners[at]).collect(),
            shown: kept.iter().map(|&at| texture.shown[at]).collect(),
            images: texture
                .images
                .iter()
                .map(|name| folder.join(name))
                .collect(),
        });
        Ok(Appearance::new(
            TriMesh::new(positions, faces)?,
            colours,
            texture,
        ))
    }
}

impl SoupTexture {
    /// Texture of the faces of `mesh`, in their order, for a file in `folder`: paths of images in
    /// or below it are relative, others absolute.
    pub fn of(texture: &Texture, mesh: &TriMesh, folder: &Path) -> Self {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = absolute(folder);
        let name = |image: &PathBuf| {
            let image = absolute(image);
            image
                .strip_prefix(&folder)
                .unwrap_or(&image)
                .display()
                .to_string()
        };
        let slots = || mesh.faces().map(|(face, _)| face.0 as usize);
        Self {
            corners: slots().map(|slot| texture.corners[slot]).collect(),
            shown: slots().map(|slot| texture.shown[slot]).collect(),
            images: texture.images.iter().map(name).collect(),
        }
    }
}
