//! A scan that follows the mesh refined from its simplified copy.

use std::collections::{HashMap, HashSet};

use super::groups::Groups;
use touchup_geometry::mesh::{
    Changes, FaceId, IdSet, MeshError, SimplifiedMesh, TriMesh, VertexId, triangle,
};
use touchup_method::haptic::Refiner;
use touchup_method::reconstruct::Support;

/// Approximate number of scan vertices to move per changed vertex of the working mesh.
pub(super) const VERTICES_OF_A_CHANGE: usize = 8;

/// Appearance of a face of the working mesh in the shown mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FaceShown {
    /// absent
    Gone,
    /// a face of the simplified scan: as the scan faces that it stands for
    Detail(FaceId),
    /// as a face of its own
    Same(FaceId),
}

/// The scan, and its way to follow the working mesh.
#[derive(Debug)]
pub(super) struct FollowedScan {
    pub mesh: TriMesh,
    /// vertices and faces of the scan by the cell of their position or first corner
    pub vertices: Groups,
    faces: Groups,
    /// scan faces of each face of the simplified scan, once its cells are partitioned
    pub parts: Vec<Vec<FaceId>>,
    is_parted: Vec<bool>,
    /// by face slot of the working mesh
    pub shown: Vec<FaceShown>,
    /// current ids of scan faces removed and added again
    pub returned: HashMap<FaceId, FaceId>,
    /// vertices of the shown mesh beyond the scan, by vertex slot of the working mesh
    pub added: Vec<Option<VertexId>>,
    /// vertex of the working mesh by added vertex
    working: HashMap<VertexId, VertexId>,
    /// removed from the working mesh, but still in use by faces yet to follow
    leaving: Vec<VertexId>,
    /// cells with vertices to move
    pub moving: IdSet,
    /// cells with vertices off their position in the scan
    pub moved: HashSet<u32>,
    changes: Changes,
}

/// A scan and its simplified copy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scans<'a> {
    pub original: &'a TriMesh,
    pub simplified: &'a SimplifiedMesh,
}

impl FollowedScan {
    /// The scan itself.
    pub fn new(
        Scans {
            original,
            simplified,
        }: Scans<'_>,
    ) -> Self {
        let (mut mesh, working) = (original.clone(), &simplified.mesh);
        mesh.watch();
        let cells = working.vertex_slots();
        let cell_of = |vertex: VertexId| simplified.cell_of(vertex).map(|cell| cell.0);
        let vertices = Groups::new(cells, original.vertex_slots(), |vertex| {
            cell_of(VertexId(vertex))
        });
        let faces = Groups::new(cells, original.face_slots(), |face| {
            original
                .has_face(FaceId(face))
                .then(|| cell_of(original.corners(FaceId(face))[0]))
                .flatten()
        });
        Self {
            vertices,
            faces,
            parts: vec![Vec::new(); working.face_slots()],
            is_parted: vec![false; cells],
            shown: (0..working.face_slots() as u32)
                .map(|face| FaceShown::Detail(FaceId(face)))
                .collect(),
            returned: HashMap::new(),
            added: vec![None; cells],
            working: HashMap::new(),
            leaving: Vec::new(),
            moving: IdSet::default(),
            moved: HashSet::new(),
            changes: Changes::default(),
            mesh,
        }
    }

    /// Takes over up to `most` changes of each kind from the working mesh; returns whether none is
    /// left.
    ///
    /// # Errors
    /// [`MeshError::TooMany`].
    pub fn follow(
        &mut self,
        scans: Scans<'_>,
        refiner: &mut Refiner,
        most: usize,
    ) -> Result<bool, MeshError> {
        let mut changes = std::mem::take(&mut self.changes);
        changes.clear();
        let is_all = refiner.take_changes(most, &mut changes);
        let working = refiner.mesh();
        for &face in &changes.faces {
            self.follow_face(scans, working, face)?;
        }
        for &vertex in &changes.vertices {
            self.follow_vertex(scans, working, vertex);
        }
        let mut leaving = std::mem::take(&mut self.leaving);
        leaving.retain(|&vertex| !working.has_vertex(vertex) && !self.remove(vertex));
        self.leaving = leaving;
        self.changes = changes;
        self.carry(scans, working, most * VERTICES_OF_A_CHANGE);
        Ok(is_all && self.moving.is_empty())
    }

    /// The support of a vertex of the patch, by the working mesh; `None` for a vertex of the scan.
    pub fn support(&self, refiner: &Refiner, vertex: VertexId) -> Option<Support> {
        refiner.support(*self.working.get(&vertex)?)
    }

    /// A face that shows a face of the working mesh.
    pub fn face(&self, scans: Scans<'_>, working: FaceId) -> Option<FaceId> {
        match *self.shown.get(working.0 as usize)? {
            FaceShown::Gone => None,
            FaceShown::Same(face) => Some(face),
            FaceShown::Detail(face) => {
                let [corner, ..] = scans.simplified.mesh.corners(face);
                let mut faces = self
                    .faces
                    .of(corner.0)
                    .iter()
                    .map(|&face| self.current(FaceId(face)));
                faces.find(|&face| self.mesh.has_face(face))
            }
        }
    }

    fn current(&self, face: FaceId) -> FaceId {
        self.returned.get(&face).copied().unwrap_or(face)
    }

    pub fn follow_face(
        &mut self,
        scans: Scans<'_>,
        working: &TriMesh,
        face: FaceId,
    ) -> Result<(), MeshError> {
        let at = face.0 as usize;
        if at >= self.shown.len() {
            self.shown.resize(at + 1, FaceShown::Gone);
        }
        let corners = working.has_face(face).then(|| working.corners(face));
        let detail = corners
            .as_ref()
            .and_then(|corners| detail_of(&scans.simplified.mesh, corners));
        if detail.is_some_and(|detail| self.shown[at] == FaceShown::Detail(detail)) {
            return Ok(());
        }
        match std::mem::replace(&mut self.shown[at], FaceShown::Gone) {
            FaceShown::Gone => {}
            FaceShown::Detail(detail) => self.hide(scans, detail),
            FaceShown::Same(same) => drop(self.mesh.remove_face(same)),
        }
        self.shown[at] = match (corners, detail) {
            (None, _) => FaceShown::Gone,
            (_, Some(detail)) => {
                self.bring_back(scans, detail)?;
                FaceShown::Detail(detail)
            }
            (Some(corners), None) => {
                let mut ours = corners;
                for (ours, corner) in ours.iter_mut().zip(corners) {
                    *ours = self.add(working, corner)?;
                }
                FaceShown::Same(self.mesh.add_face(ours)?)
            }
        };
        Ok(())
    }

    fn follow_vertex(&mut self, scans: Scans<'_>, working: &TriMesh, vertex: VertexId) {
        if let Some(Some(added)) = self.added.get(vertex.0 as usize).copied() {
            if working.has_vertex(vertex) {
                self.mesh.set_position(added, working.position(vertex));
            } else if !self.remove(vertex) {
                self.leaving.push(vertex);
            }
        }
        let simplified = &scans.simplified.mesh;
        if (vertex.0 as usize) < simplified.vertex_slots() {
            let around = simplified
                .star(vertex)
                .iter()
                .flat_map(|&face| simplified.corners(face));
            around.for_each(|corner| self.moving.insert(corner.0));
        }
    }

    /// The vertex that shows a vertex of the working mesh beyond the scan.
    fn add(&mut self, working: &TriMesh, vertex: VertexId) -> Result<VertexId, MeshError> {
        let at = vertex.0 as usize;
        if at >= self.added.len() {
            self.added.resize(at + 1, None);
        }
        if let Some(added) = self.added[at] {
            return Ok(added);
        }
        let added = self.mesh.add_vertex(working.position(vertex))?;
        self.added[at] = Some(added);
        self.working.insert(added, vertex);
        Ok(added)
    }

    /// Removes the shown vertex of a removed vertex; whether no face uses it any more.
    pub fn remove(&mut self, vertex: VertexId) -> bool {
        let Some(added) = self.added[vertex.0 as usize] else {
            return true;
        };
        let is_removed = self.mesh.remove_vertex(added);
        if is_removed {
            self.added[vertex.0 as usize] = None;
            self.working.remove(&added);
        }
        is_removed
    }

    /// Removes the shown face of a face that the working mesh shares with the scan.
    pub fn park(&mut self, face: FaceId) {
        let shown = std::mem::replace(&mut self.shown[face.0 as usize], FaceShown::Gone);
        if let FaceShown::Same(same) = shown {
            self.mesh.remove_face(same);
        }
    }

    /// Moves the vertices of a cell to their positions in the scan.
    pub fn put_back(&mut self, scan: &TriMesh, cell: u32) {
        for &vertex in self.vertices.of(cell) {
            let vertex = VertexId(vertex);
            let place = scan.position(vertex);
            if self.mesh.position(vertex) != place {
                self.mesh.set_position(vertex, place);
            }
        }
        self.moved.remove(&cell);
    }

    pub fn hide(&mut self, scans: Scans<'_>, detail: FaceId) {
        self.part(scans, detail);
        for &face in &self.parts[detail.0 as usize] {
            remove_from(&mut self.mesh, &mut self.returned, face);
        }
    }

    pub fn bring_back(&mut self, scans: Scans<'_>, detail: FaceId) -> Result<(), MeshError> {
        self.part(scans, detail);
        for &face in &self.parts[detail.0 as usize] {
            return_to(&mut self.mesh, &mut self.returned, scans.original, face)?;
        }
        Ok(())
    }

    /// Assigns the scan faces around the corners of `detail` to the nearest faces of the simplified
    /// scan.
    fn part(&mut self, scans: Scans<'_>, detail: FaceId) {
        let (scan, simplified) = (scans.original, &scans.simplified.mesh);
        for cell in simplified.corners(detail) {
            if std::mem::replace(&mut self.is_parted[cell.0 as usize], true) {
                continue;
            }
            for &face in self.faces.of(cell.0) {
                let middle = scan.barycentre(FaceId(face));
                let off = |near: FaceId| {
                    let (point, _) = triangle::closest_point(&middle, &simplified.triangle(near));
                    (middle - point).norm_squared()
                };
                let near = simplified.star(cell).iter().map(|&near| (off(near), near));
                if let Some((_, near)) = near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
                {
                    self.parts[near.0 as usize].push(FaceId(face));
                }
            }
        }
    }

    /// Moves the vertices of cells with moved surroundings, about `most` of them.
    fn carry(&mut self, scans: Scans<'_>, working: &TriMesh, most: usize) {
        let mut left = most;
        while left > 0 && !self.moving.is_empty() {
            let mut cell = 0;
            self.moving.take(1, |id| cell = id);
            let vertices = self.vertices.of(cell);
            left = left.saturating_sub(vertices.len().max(1));
            self.moved.insert(cell);
            let mesh = &mut self.mesh;
            let members = vertices.iter().map(|&vertex| VertexId(vertex));
            scans.simplified.carry_cell(
                VertexId(cell),
                members,
                scans.original,
                working,
                |vertex, place| {
                    if mesh.position(vertex) != place {
                        mesh.set_position(vertex, place);
                    }
                },
            );
        }
    }
}

/// Removes a face of the scan.
pub(super) fn remove_from(
    mesh: &mut TriMesh,
    returned: &mut HashMap<FaceId, FaceId>,
    face: FaceId,
) {
    mesh.remove_face(returned.remove(&face).unwrap_or(face));
}

/// Restores a removed face of the scan.
pub(super) fn return_to(
    mesh: &mut TriMesh,
    returned: &mut HashMap<FaceId, FaceId>,
    scan: &TriMesh,
    face: FaceId,
) -> Result<(), MeshError> {
    let current = mesh.add_face(scan.corners(face))?;
    if current != face {
        returned.insert(face, current);
    }
    Ok(())
}

/// The face of the simplified scan with these corners, if there is one.
fn detail_of(simplified: &TriMesh, corners: &[VertexId; 3]) -> Option<FaceId> {
    if !simplified.has_vertex(corners[0]) {
        return None;
    }
    let is_same = |face: &&FaceId| {
        let [a, b, c] = simplified.corners(**face);
        [[a, b, c], [b, c, a], [c, a, b]].contains(corners)
    };
    simplified.star(corners[0]).iter().find(is_same).copied()
}
