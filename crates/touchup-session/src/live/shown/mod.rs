//! The shown mesh if haptic update and patch work on a simplified scan: the faces of the scan,
//! moved with the simplified ones, and the faces of the patch in place of replaced ones. At rest it
//! is the scan with the patch of all touches.

mod at_rest;
mod followed;
mod groups;

use at_rest::AtRest;
use followed::FollowedScan;
pub(in crate::live) use followed::Scans;
use touchup_geometry::mesh::{Changes, FaceId, MeshError, TriMesh, VertexId};
use touchup_method::haptic::Refiner;
use touchup_method::reconstruct::{PatchDelta, Support};

/// The shown mesh.
#[derive(Debug)]
pub(super) struct ShownMesh {
    followed: FollowedScan,
    at_rest: AtRest,
}

impl ShownMesh {
    /// The scan itself.
    pub fn new(scans: Scans<'_>) -> Self {
        Self {
            followed: FollowedScan::new(scans),
            at_rest: AtRest::default(),
        }
    }

    /// The mesh in its current state.
    pub fn mesh(&self) -> &TriMesh {
        &self.followed.mesh
    }

    /// Takes over up to `most` changes of each kind from the working mesh, or at rest from the
    /// patch of all touches; returns whether none is left.
    ///
    /// # Errors
    /// [`MeshError::TooMany`].
    pub fn follow(
        &mut self,
        scans: Scans<'_>,
        refiner: &mut Refiner,
        most: usize,
    ) -> Result<bool, MeshError> {
        let Self { followed, at_rest } = self;
        if !at_rest.go_on(followed, scans, refiner.mesh(), most)? {
            return Ok(false);
        }
        if at_rest.is_there() {
            return Ok(true);
        }
        let has_followed = followed.follow(scans, refiner, most)?;
        Ok(has_followed && !at_rest.begin(followed, scans, refiner.mesh()))
    }

    /// Changes of the shown mesh, as [`TriMesh::take_changes`].
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> bool {
        self.followed.mesh.take_changes(most, into)
    }

    /// Requests the patch of all touches once the shown mesh has followed the working mesh, until
    /// that changes.
    pub fn rest(&mut self, patch: PatchDelta, working: &TriMesh) {
        self.at_rest.want(patch, working);
    }

    /// Whether the patch of all touches is visible, or will be by [`Self::follow`].
    pub fn rests(&self, working: &TriMesh) -> bool {
        self.at_rest.is_wanted(working)
    }

    /// The support of a vertex of the patch, in the shown mesh; `None` for a vertex of the scan.
    pub fn support(&self, refiner: &Refiner, vertex: VertexId) -> Option<Support> {
        self.at_rest
            .support(vertex)
            .or_else(|| self.followed.support(refiner, vertex))
    }

    /// A face that shows a face of the working mesh.
    pub fn face(&self, scans: Scans<'_>, working: FaceId) -> Option<FaceId> {
        self.followed.face(scans, working)
    }
}
