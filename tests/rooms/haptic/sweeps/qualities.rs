//! Shape quality of the faces of a mesh.

use nalgebra::Point3;
use touchup::mesh::TriMesh;

/// Twice the area over the longest edge squared, for each face: √3/2 at best, 0 without area.
pub fn qualities(mesh: &TriMesh) -> Vec<f64> {
    let quality = |[a, b, c]: [Point3<f64>; 3]| {
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        (b - a).cross(&(c - a)).norm() / (longest * longest)
    };
    mesh.faces()
        .map(|(face, _)| quality(mesh.triangle(face)))
        .collect()
}
