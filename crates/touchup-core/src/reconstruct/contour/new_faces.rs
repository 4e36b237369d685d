//! The patch: new faces for a part of a scan, and the scan with them in it.

use nalgebra::Point3;

use crate::mesh::{FaceId, MeshError, TriMesh, VertexId};
use crate::reconstruct::contour::trace::OpenSquare;
use crate::reconstruct::field::lattice::{PatchFace, VertexKey};
use crate::reconstruct::table::CellTable;

/// New faces for a region, and the faces of the scan that they replace.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    /// positions, m, in O; [`PatchFace::corners`] counts them in this order
    pub vertices: CellTable<VertexKey, Point3<f64>>,
    /// the new faces
    pub faces: Vec<PatchFace>,
    /// faces of the scan that go, by id
    pub removed: Vec<FaceId>,
    /// where scan and patch could not be joined
    pub open: Vec<OpenSquare>,
}

impl Patch {
    /// A copy of the scan with the patch in it, and the id there of each vertex of the patch that a face uses: vertices and
    /// untouched faces of the scan keep their ids.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice, [`MeshError::NotFinite`] when the field's crossings were not
    /// finite.
    pub fn applied_to(&self, scan: &TriMesh) -> Result<(TriMesh, Vec<Option<VertexId>>), MeshError> {
        let mut mesh = scan.clone();
        for &face in &self.removed {
            mesh.remove_face(face);
        }
        let mut ids: Vec<Option<VertexId>> = vec![None; self.vertices.len()];
        for face in &self.faces {
            let mut corners = [VertexId(0); 3];
            for (corner, &at) in corners.iter_mut().zip(&face.corners) {
                *corner = match (ids[at as usize], self.vertices.entry(at)) {
                    (Some(id), _) | (None, &(VertexKey::Scan(id), _)) => id,
                    (None, (_, position)) => mesh.add_vertex(*position)?,
                };
                ids[at as usize] = Some(*corner);
            }
            mesh.add_face(corners)?;
        }
        Ok((mesh, ids))
    }
}
