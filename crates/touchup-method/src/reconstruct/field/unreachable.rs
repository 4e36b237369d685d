//! Unreachable surface: in inner corners closer to the other wall than the radius of the ball, and
//! in gaps narrower than it.
//!
//! A ball on the surface at a vertex would have its centre a radius above it. If some other piece
//! of the new surface obstructs it there, no touch is possible.

use crate::reconstruct::Support;
use crate::reconstruct::evidence::free_space::FreeSpace;
use touchup_geometry::mesh::{FaceTree, MeshError, TriMesh, VertexId, corner_normal};
use touchup_geometry::numeric::direction;

/// Maximum depth of the ball in the surface, as a share of its radius: lattice and noise cause it
/// on a flat face.
const SLACK: f64 = 0.1;

/// Marks the vertices of the new surface out of reach of any ball of `radius` (m).
///
/// # Errors
/// [`MeshError`] when the faces of the patch alone are no mesh.
pub(in crate::reconstruct) fn mark_unreachable(
    mesh: &TriMesh,
    support: &mut [Support],
    free_space: &FreeSpace,
    radius: f64,
) -> Result<(), MeshError> {
    let is_new = |corners: &[VertexId; 3]| {
        corners
            .iter()
            .all(|v| support[v.0 as usize] != Support::Scan)
    };
    let faces: Vec<[u32; 3]> = mesh
        .faces()
        .filter(|(_, corners)| is_new(corners))
        .map(|(_, corners)| corners.map(|v| v.0))
        .collect();
    if faces.is_empty() {
        return Ok(());
    }
    // without the scan: its noise would obstruct the ball
    let patch = TriMesh::new(mesh.positions().to_vec(), faces)?;
    let tree = FaceTree::new(&patch);
    let deepest = radius * (1.0 - SLACK);
    for (vertex, support) in (0..).map(VertexId).zip(support) {
        let Some(normal) = direction(&corner_normal(&patch, vertex)) else {
            continue;
        };
        let centre = mesh.position(vertex) + normal * radius;
        let is_blocked = tree.closest(&patch, &centre, deepest).is_some();
        let was_there = || {
            free_space
                .nearest(&centre)
                .is_some_and(|(distance, _)| distance < SLACK * radius)
        };
        if is_blocked && !was_there() {
            *support = Support::Unreachable;
        }
    }
    Ok(())
}
