//! Shown mesh of a pause in touching: the scan with the patch of all touches, as in a result file.

use std::collections::HashMap;

use touchup_geometry::mesh::{FaceId, MeshError, TriMesh, VertexId};
use touchup_method::reconstruct::{Owner, PatchDelta, Support, VertexKey};

use super::followed::{
    FaceShown, FollowedScan, Scans, VERTICES_OF_A_CHANGE, remove_from, return_to,
};

/// The patch of all touches, and its progress in the shown mesh.
#[derive(Debug, Default)]
pub(super) struct AtRest {
    phase: RestPhase,
    /// the patch to show once the shown mesh has followed the working mesh
    wanted: Option<PatchDelta>,
    /// the shown patch
    patch: PatchDelta,
    /// number of edits of the working mesh at departure from it
    edits: u64,
    /// pending steps, the last first
    steps: Vec<Step>,
    /// steps back to the working mesh
    back: Vec<Step>,
    /// vertices of `patch`, in its order
    placed: Vec<VertexId>,
    support: HashMap<VertexId, Support>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum RestPhase {
    /// the shown mesh follows the working mesh
    #[default]
    Following,
    /// the patch of all touches is visible, or becomes so
    Resting,
    /// the working mesh returns
    Leaving,
}

/// A step for some vertices or faces at once.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// removes a face of the working mesh
    Park(FaceId),
    /// shows a face of the working mesh again
    Follow(FaceId),
    /// restores the scan faces of a face of the simplified scan
    BringBack(FaceId),
    /// removes the scan faces of a face of the simplified scan
    Hide(FaceId),
    /// moves the vertices of a cell to their positions in the scan
    PutBack(u32),
    /// moves the vertices of a cell to the working mesh
    Carry(u32),
    /// removes a vertex of the working mesh; it returns with its faces
    Forget(VertexId),
    /// adds the next vertex of the patch, or moves a scan vertex to its position in the patch
    Place(u32),
    /// removes a vertex of the patch
    Unplace(VertexId),
    /// moves a scan vertex back
    Return(VertexId),
    /// removes a scan face that the patch replaces
    Cut(FaceId),
    /// restores a scan face that the patch replaced
    Restore(FaceId),
    /// adds a face of the patch
    Fill(u32),
    /// removes a face of the patch
    Empty(FaceId),
}

impl AtRest {
    /// Whether the shown mesh contains the whole patch of all touches.
    pub fn is_there(&self) -> bool {
        self.phase == RestPhase::Resting && self.steps.is_empty()
    }

    /// The support of a vertex of the patch of all touches.
    pub fn support(&self, vertex: VertexId) -> Option<Support> {
        self.support.get(&vertex).copied()
    }

    /// Requests the patch of all touches once the shown mesh has followed the working mesh, until
    /// that changes.
    pub fn want(&mut self, patch: PatchDelta, working: &TriMesh) {
        let Self {
            phase,
            patch: shown,
            edits,
            wanted,
            ..
        } = self;
        let is_same = shown.vertices == patch.vertices
            && shown.owners == patch.owners
            && shown.faces == patch.faces;
        let is_shown = is_same && *phase == RestPhase::Resting && *edits == working.edits();
        *wanted = (!is_shown).then_some(patch);
    }

    /// Whether the patch of all touches is visible, or about to be.
    pub fn is_wanted(&self, working: &TriMesh) -> bool {
        self.wanted.is_some() || self.phase == RestPhase::Resting && self.edits == working.edits()
    }

    /// Begins with a requested patch of all touches; returns whether there is anything to do for
    /// it.
    pub fn begin(&mut self, followed: &FollowedScan, scans: Scans<'_>, working: &TriMesh) -> bool {
        let Some(patch) = self.wanted.take() else {
            return false;
        };
        let slots = || (0..followed.shown.len() as u32).map(FaceId);
        let mut is_hidden: Vec<bool> = vec![true; followed.parts.len()];
        for shown in &followed.shown {
            if let FaceShown::Detail(detail) = shown {
                is_hidden[detail.0 as usize] = false;
            }
        }
        let details = scans.simplified.mesh.faces().map(|(detail, _)| detail);
        let hidden = details.filter(|detail| is_hidden[detail.0 as usize]);
        let mut steps: Vec<Step> = Vec::new();
        steps.extend(
            slots()
                .filter(|face| matches!(followed.shown[face.0 as usize], FaceShown::Same(_)))
                .map(Step::Park),
        );
        steps.extend(hidden.map(Step::BringBack));
        // sorted, as the order of the table is random
        let mut moved: Vec<u32> = followed.moved.iter().copied().collect();
        moved.sort_unstable();
        steps.extend(moved.into_iter().map(Step::PutBack));
        let added =
            (0..followed.added.len() as u32).filter(|&at| followed.added[at as usize].is_some());
        steps.extend(added.map(|at| Step::Forget(VertexId(at))));
        steps.extend((0..patch.vertices.len() as u32).map(Step::Place));
        steps.extend(patch.owners.iter().filter_map(|(owner, _)| match owner {
            Owner::Scan(face) => Some(Step::Cut(*face)),
            Owner::Edge(_) | Owner::Square(_) => None,
        }));
        steps.extend((0..patch.faces.len() as u32).map(Step::Fill));
        steps.reverse();
        (self.phase, self.steps, self.edits) = (RestPhase::Resting, steps, working.edits());
        self.patch = patch;
        self.placed.clear();
        true
    }

    /// Takes up to `most` steps from the working mesh to the patch of all touches or back; returns
    /// whether none is left.
    ///
    /// # Errors
    /// [`MeshError::TooMany`].
    pub fn go_on(
        &mut self,
        followed: &mut FollowedScan,
        scans: Scans<'_>,
        working: &TriMesh,
        most: usize,
    ) -> Result<bool, MeshError> {
        let mut left = most;
        while left > 0 {
            let Some(step) = self.steps.pop() else {
                let has_changed = working.edits() != self.edits || self.wanted.is_some();
                self.phase = match self.phase {
                    RestPhase::Resting if has_changed => {
                        self.steps = std::mem::take(&mut self.back);
                        RestPhase::Leaving
                    }
                    RestPhase::Leaving => {
                        (self.patch, self.placed, self.support) = Default::default();
                        RestPhase::Following
                    }
                    phase => return Ok(phase != RestPhase::Leaving),
                };
                continue;
            };
            left = left.saturating_sub(match step {
                Step::BringBack(detail) | Step::Hide(detail) => {
                    followed.parts[detail.0 as usize].len().max(1)
                }
                Step::PutBack(cell) => followed
                    .vertices
                    .of(cell)
                    .len()
                    .div_ceil(VERTICES_OF_A_CHANGE)
                    .max(1),
                _ => 1,
            });
            self.take_step(step, followed, scans, working)?;
        }
        Ok(false)
    }

    /// Takes a step, and notes its reverse.
    fn take_step(
        &mut self,
        step: Step,
        followed: &mut FollowedScan,
        scans: Scans<'_>,
        working: &TriMesh,
    ) -> Result<(), MeshError> {
        let back = match step {
            Step::Park(face) => {
                followed.park(face);
                Some(Step::Follow(face))
            }
            Step::BringBack(detail) => {
                followed.bring_back(scans, detail)?;
                Some(Step::Hide(detail))
            }
            Step::PutBack(cell) => {
                followed.put_back(scans.original, cell);
                Some(Step::Carry(cell))
            }
            Step::Forget(vertex) => {
                followed.remove(vertex);
                None
            }
            Step::Place(at) => self.place(at, &mut followed.mesh)?,
            Step::Cut(face) => {
                remove_from(&mut followed.mesh, &mut followed.returned, face);
                Some(Step::Restore(face))
            }
            Step::Fill(face) => {
                let Self { patch, placed, .. } = &*self;
                let corners = patch.faces[face as usize].map(|corner| placed[corner as usize]);
                Some(Step::Empty(followed.mesh.add_face(corners)?))
            }
            Step::Follow(face) => return followed.follow_face(scans, working, face),
            Step::Hide(detail) => {
                followed.hide(scans, detail);
                None
            }
            Step::Carry(cell) => {
                followed.moving.insert(cell);
                None
            }
            Step::Return(vertex) => {
                self.support.remove(&vertex);
                let place = scans.original.position(vertex);
                followed.mesh.set_position(vertex, place);
                None
            }
            Step::Unplace(vertex) => {
                self.support.remove(&vertex);
                followed.mesh.remove_vertex(vertex);
                None
            }
            Step::Restore(face) => {
                let FollowedScan { mesh, returned, .. } = followed;
                return return_to(mesh, returned, scans.original, face);
            }
            Step::Empty(face) => {
                followed.mesh.remove_face(face);
                None
            }
        };
        self.back.extend(back);
        Ok(())
    }

    /// Places a vertex of the patch; returns the reverse, if there is anything to reverse.
    fn place(&mut self, at: u32, mesh: &mut TriMesh) -> Result<Option<Step>, MeshError> {
        let vertex = self.patch.vertices[at as usize];
        let VertexKey::Scan(moved) = vertex.key else {
            let placed = mesh.add_vertex(vertex.position)?;
            self.placed.push(placed);
            self.support.insert(placed, vertex.support);
            return Ok(Some(Step::Unplace(placed)));
        };
        self.placed.push(moved);
        if vertex.support != Support::Scan {
            self.support.insert(moved, vertex.support);
        }
        if mesh.position(moved) == vertex.position {
            return Ok(None);
        }
        mesh.set_position(moved, vertex.position);
        Ok(Some(Step::Return(moved)))
    }
}
