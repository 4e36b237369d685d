//! Triangles between a file and a mesh.

use nalgebra::Point3;
use touchup_core::mesh::TriMesh;

/// Triangles as read from a file.
#[derive(Debug, Default)]
pub(super) struct Soup {
    pub positions: Vec<Point3<f64>>,
    pub faces: Vec<[u32; 3]>,
    /// vertices in the file that did not even get into `positions`
    pub unused: usize,
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

    /// Faces that are there and the vertices they use, coordinates divided by `scale`; and the ids
    /// of these vertices.
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
