//! The patch, a scan with the patch in it, and a mesh that follows the patch.

use nalgebra::Point3;

use super::delta::{PatchDelta, PatchVertex};
use super::lattice::{Owner, PatchFace, VertexKey};
use super::table::CellTable;
use super::trace::OpenSquare;
use crate::mesh::{FaceId, FaceTree, MeshError, TriMesh, VertexId};

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

/// To place so many vertices takes as long as to replace the faces of one owner.
const VERTICES_OF_A_PART: usize = 4;

/// A mesh follows a patch: which of its faces and vertices are those of the patch.
#[derive(Clone, Debug, Default)]
pub struct Splice {
    faces: CellTable<Owner, Vec<FaceId>>,
    vertices: CellTable<VertexKey, VertexId>,
    added: Vec<FaceId>,
    placed: Vec<VertexId>,
    refit: Vec<FaceId>,
    /// how many owners and faces of the delta at hand are done
    next_owner: usize,
    next_face: usize,
}

impl Splice {
    /// Brings the mesh up to date with the patch; faces and vertices that it does not touch keep their ids.
    ///
    /// - `mesh`, `tree`: the scan with all deltas before this one in it.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice, [`MeshError::NotFinite`] for a position that is not finite;
    /// the mesh is torn then.
    pub fn apply(&mut self, delta: &PatchDelta, mesh: &mut TriMesh, tree: &mut FaceTree) -> Result<(), MeshError> {
        self.begin();
        self.go_on(delta, usize::MAX, mesh, tree)?;
        Ok(())
    }

    /// Begins with the next delta: [`Self::go_on`] takes it up.
    pub fn begin(&mut self) {
        self.placed.clear();
        (self.next_owner, self.next_face) = (0, 0);
    }

    /// Takes up to `most` parts more of the delta that was begun: places its vertices, a few to a part, then replaces the
    /// faces of its owners; returns whether that was all. In between the mesh has gaps and overlaps where old faces meet new
    /// ones.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn go_on(
        &mut self,
        delta: &PatchDelta,
        most: usize,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
    ) -> Result<bool, MeshError> {
        self.added.clear();
        let left = most - self.place(delta, most, mesh, tree)?;
        let left = if self.placed.len() < delta.vertices.len() { 0 } else { left };
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
        let is_done = self.placed.len() >= delta.vertices.len() && self.next_owner >= delta.owners.len();
        for key in delta.gone.iter().filter(|_| is_done) {
            if let Some(vertex) = self.vertices.remove(key) {
                mesh.remove_vertex(vertex);
            }
        }
        Ok(is_done)
    }

    /// The faces that were added last.
    pub fn added(&self) -> &[FaceId] {
        &self.added
    }

    /// The vertices of the last delta that were placed so far, in its order.
    pub fn placed(&self) -> &[VertexId] {
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

    /// Adds new vertices and moves those that are elsewhere now, up to `most` parts of them; returns how many those were.
    fn place(
        &mut self,
        delta: &PatchDelta,
        most: usize,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
    ) -> Result<usize, MeshError> {
        self.refit.clear();
        let before = self.placed.len();
        for &PatchVertex { key, position, .. } in
            delta.vertices.iter().skip(before).take(most.saturating_mul(VERTICES_OF_A_PART))
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
