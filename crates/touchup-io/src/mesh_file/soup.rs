//! Triangles between a file and a mesh.

use nalgebra::Point3;
use touchup_geometry::mesh::{TriMesh, triangulate};

use super::defect::{Defect, Syntax};
use crate::file_error::FilePlace;

/// Triangles as read from a file.
#[derive(Debug, Default)]
pub(super) struct Soup {
    pub positions: Vec<Point3<f64>>,
    pub faces: Vec<[u32; 3]>,
    /// vertices of the file missing from `positions`
    pub unused: usize,
}

/// Polygons as read from a file, possibly before the vertices.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    vertices: Vec<u32>,
    /// end of each one's vertices, and its place in the file
    ends: Vec<(usize, FilePlace)>,
}

impl Polygons {
    pub fn push(
        &mut self,
        vertices: impl Iterator<Item = Result<u32, Syntax>>,
        place: FilePlace,
    ) -> Result<(), Syntax> {
        for vertex in vertices {
            self.vertices.push(vertex?);
        }
        self.ends.push((self.vertices.len(), place));
        Ok(())
    }

    /// Divides each in turn: the number of the polygon, its vertices, and for each triangle the
    /// indices of its three.
    pub fn divide(
        &self,
        positions: &[Point3<f64>],
        mut take: impl FnMut(usize, &[u32], [u32; 3]),
    ) -> Result<(), Syntax> {
        let mut start = 0;
        for (number, &(end, place)) in self.ends.iter().enumerate() {
            let vertices = &self.vertices[start..end];
            start = end;
            if vertices.len() == 3 {
                take(number, vertices, [0, 1, 2]);
                continue;
            }
            let defect = Defect::SidesCross;
            for triangle in divided(vertices, positions).ok_or(Syntax { place, defect })? {
                take(number, vertices, triangle);
            }
        }
        Ok(())
    }
}

/// The triangles of a polygon, as indices into its vertices; `None` for crossing sides. A polygon
/// with missing vertices is divided by numbers alone; a later check refuses it.
pub(super) fn divided(vertices: &[u32], positions: &[Point3<f64>]) -> Option<Vec<[u32; 3]>> {
    let at = |&vertex: &u32| positions.get(vertex as usize).copied();
    let nowhere = || vec![Point3::origin(); vertices.len()];
    let corners: Option<Vec<Point3<f64>>> = vertices.iter().map(at).collect();
    triangulate(&corners.unwrap_or_else(nowhere))
}

impl Soup {
    /// Three positions for each triangle.
    pub fn of_triangles(positions: Vec<Point3<f64>>) -> Self {
        // beyond 32 bits `repair` refuses by the number of positions
        let faces = (0..positions.len() as u32 / 3)
            .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
            .collect();
        Self {
            positions,
            faces,
            unused: 0,
        }
    }

    /// Existing faces and their vertices, coordinates divided by `scale`; and the ids of these
    /// vertices.
    pub fn used_part(mesh: &TriMesh, scale: f64) -> (Self, Vec<usize>) {
        let mut renamed = vec![u32::MAX; mesh.vertex_slots()];
        mesh.faces()
            .flat_map(|(_, corners)| corners)
            .for_each(|v| renamed[v.0 as usize] = 0);
        let ids: Vec<usize> = (0..renamed.len()).filter(|&id| renamed[id] == 0).collect();
        ids.iter()
            .zip(0..)
            .for_each(|(&id, name)| renamed[id] = name);
        let positions = ids.iter().map(|&id| mesh.positions()[id] / scale).collect();
        let faces = mesh
            .faces()
            .map(|(_, corners)| corners.map(|v| renamed[v.0 as usize]))
            .collect();
        (
            Self {
                positions,
                faces,
                unused: 0,
            },
            ids,
        )
    }
}
