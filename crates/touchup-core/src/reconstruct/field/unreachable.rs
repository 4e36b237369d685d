//! Unreachable surface: in inner corners closer to the other wall than the radius of the ball, and in what is narrower than it.
//!
//! A ball that touched the surface at a vertex would have its centre a radius above it. Where some other piece of the new
//! surface obstructs it there, no touch is possible.

use nalgebra::{Point3, Vector3};

use crate::mesh::{FaceTree, MeshError, TriMesh, VertexId};
use crate::reconstruct::Support;
use crate::reconstruct::evidence::free_space::FreeSpace;

/// The ball may enter the surface by this share of its radius: what the lattice and noise leave of a flat face.
const SLACK: f64 = 0.1;

/// Marks the vertices of the new surface that no ball of `radius` (m) can touch.
///
/// # Errors
/// [`MeshError`] when the faces of the patch alone are no mesh.
pub(in crate::reconstruct) fn mark_unreachable(
    mesh: &TriMesh,
    support: &mut [Support],
    free_space: &FreeSpace,
    radius: f64,
) -> Result<(), MeshError> {
    let is_new = |corners: &[VertexId; 3]| corners.iter().all(|v| support[v.0 as usize] != Support::Scan);
    let faces: Vec<[u32; 3]> =
        mesh.faces().filter(|(_, corners)| is_new(corners)).map(|(_, corners)| corners.map(|v| v.0)).collect();
    if faces.is_empty() {
        return Ok(());
    }
    // the scan is left out: its noise would obstruct the ball
    let patch = TriMesh::new(mesh.positions().to_vec(), faces.clone())?;
    let tree = FaceTree::new(&patch);
    let deepest = radius * (1.0 - SLACK);
    for (vertex, normal) in normals(&patch, &faces).into_iter().enumerate() {
        let Some(normal) = normal.try_normalize(0.0) else { continue };
        let centre: Point3<f64> = mesh.positions()[vertex] + normal * radius;
        let is_blocked = tree.closest(&patch, &centre, deepest).is_some();
        let was_there = || free_space.nearest(&centre).is_some_and(|(distance, _)| distance < SLACK * radius);
        if is_blocked && !was_there() {
            support[vertex] = Support::Unreachable;
        }
    }
    Ok(())
}

/// Sum of the normals around each vertex, weighted by the angles of the faces there.
fn normals(mesh: &TriMesh, faces: &[[u32; 3]]) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.vertex_slots()];
    for corners in faces {
        let p = corners.map(|v| mesh.positions()[v as usize]);
        let Some(normal) = (p[1] - p[0]).cross(&(p[2] - p[0])).try_normalize(0.0) else { continue };
        for i in 0..3 {
            let [a, b] = [p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]];
            normals[corners[i] as usize] += normal * a.angle(&b);
        }
    }
    normals
}
