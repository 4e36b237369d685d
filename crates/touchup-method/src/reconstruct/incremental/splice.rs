//! A mesh that follows the patch.

use crate::reconstruct::incremental::delta::{PatchDelta, PatchVertex};
use crate::reconstruct::lattice::{Owner, VertexKey};
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::{FaceId, FaceTree, MeshError, TriMesh, VertexId};

/// Number of vertices placed in the time that replacing the faces of one owner takes.
const VERTICES_OF_A_PART: usize = 4;

/// Makes a mesh follow a patch: maps owners and vertices of the patch to faces and vertices of the
/// mesh.
#[derive(Clone, Debug, Default)]
pub struct Splice {
    faces: CellTable<Owner, Vec<FaceId>>,
    vertices: CellTable<VertexKey, VertexId>,
    added: Vec<FaceId>,
    placed: Vec<VertexId>,
    refit: Vec<FaceId>,
    /// number of finished owners and faces of the current delta
    next_owner: usize,
    next_face: usize,
}

impl Splice {
    /// Begins the next delta; [`Self::go_on`] continues it.
    pub fn begin(&mut self) {
        self.placed.clear();
        (self.next_owner, self.next_face) = (0, 0);
    }

    /// Applies up to `most` further parts of the current delta: places its vertices, a few to a
    /// part, then replaces the faces of its owners; returns whether the delta is complete. Until
    /// then the mesh has gaps and overlaps between old faces and new ones. Faces and vertices that
    /// the delta does not touch keep their ids.
    ///
    /// - `mesh`, `tree`: the scan with all earlier deltas applied.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice, [`MeshError::NotFinite`] for a
    /// position that is not finite; the mesh is inconsistent then.
    pub fn go_on(
        &mut self,
        delta: &PatchDelta,
        most: usize,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
    ) -> Result<bool, MeshError> {
        self.added.clear();
        let left = most - self.place(delta, most, mesh, tree)?;
        let left = if self.placed.len() < delta.vertices.len() {
            0
        } else {
            left
        };
        for &(owner, count) in delta.owners.iter().skip(self.next_owner).take(left) {
            self.remove_faces(owner, mesh, tree);
            let mut ours = Vec::with_capacity(count as usize);
            for corners in delta.faces.iter().skip(self.next_face).take(count as usize) {
                let face = mesh.add_face(corners.map(|corner| self.placed[corner as usize]))?;
                tree.insert(mesh, face);
                ours.push(face);
            }
            self.next_owner += 1;
            self.next_face += count as usize;
            self.added.extend_from_slice(&ours);
            if count > 0 || matches!(owner, Owner::Scan(_)) {
                self.faces.insert(owner, ours);
            }
        }
        let is_done =
            self.placed.len() >= delta.vertices.len() && self.next_owner >= delta.owners.len();
        for key in delta.gone.iter().filter(|_| is_done) {
            if let Some(vertex) = self.vertices.remove(key) {
                mesh.remove_vertex(vertex);
            }
        }
        Ok(is_done)
    }

    /// Faces added by the last call.
    pub(crate) fn added(&self) -> &[FaceId] {
        &self.added
    }

    /// Placed vertices of the last delta, in its order.
    pub(crate) fn placed(&self) -> &[VertexId] {
        &self.placed
    }

    fn remove_faces(&mut self, owner: Owner, mesh: &mut TriMesh, tree: &mut FaceTree) {
        let ours = match (self.faces.remove(&owner), owner) {
            (Some(ours), _) => ours,
            (None, Owner::Scan(face)) => vec![face],
            (None, _) => return,
        };
        for face in ours {
            tree.remove(mesh, face);
            mesh.remove_face(face);
        }
    }

    /// Adds new vertices and moves displaced ones, up to `most` parts; returns the number of parts.
    fn place(
        &mut self,
        delta: &PatchDelta,
        most: usize,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
    ) -> Result<usize, MeshError> {
        self.refit.clear();
        let before = self.placed.len();
        for &PatchVertex { key, position, .. } in delta
            .vertices
            .iter()
            .skip(before)
            .take(most.saturating_mul(VERTICES_OF_A_PART))
        {
            let known = match key {
                VertexKey::Scan(id) => Some(id),
                _ => self.vertices.get(&key).copied(),
            };
            let id = match known {
                Some(id) => id,
                None => mesh.add_vertex(position)?,
            };
            if known.is_none() {
                self.vertices.insert(key, id);
            } else if mesh.position(id) != position {
                mesh.set_position(id, position);
                self.refit.extend_from_slice(mesh.star(id));
            }
            self.placed.push(id);
        }
        tree.refit(mesh, &self.refit);
        Ok((self.placed.len() - before).div_ceil(VERTICES_OF_A_PART))
    }
}
