//! Meshes made finer.

use std::collections::BTreeMap;

use nalgebra::Point3;
use touchup::mesh::TriMesh;

/// Each face split into four at the middles of its edges, which `place` then moves.
pub fn subdivided(mesh: &TriMesh, place: impl Fn(Point3<f64>) -> Point3<f64>) -> TriMesh {
    let mut positions = mesh.positions().to_vec();
    let mut middles = BTreeMap::new();
    let mut faces = Vec::new();
    for (_, corners) in mesh.faces() {
        let c = corners.map(|v| v.0);
        let middle = [0, 1, 2].map(|i| {
            let (a, b) = (c[i], c[(i + 1) % 3]);
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                positions.push(place(nalgebra::center(
                    &mesh.positions()[a as usize],
                    &mesh.positions()[b as usize],
                )));
                positions.len() as u32 - 1
            })
        });
        let [ab, bc, ca] = middle;
        faces.extend([[c[0], ab, ca], [ab, c[1], bc], [ca, bc, c[2]], middle]);
    }
    TriMesh::new(positions, faces).unwrap()
}
