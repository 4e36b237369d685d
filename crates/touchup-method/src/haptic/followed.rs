//! The patch in the working mesh of the haptic update.
//!
//! Touched parts of the patch are stiff. The update moves other parts, scan and guesses, at once
//! but temporarily: they return to their place once the patch has caught up with that touch and
//! holds the contact.

use crate::reconstruct::{Splice, Support};
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// Stamp of a vertex that never moved.
pub(super) const NEVER: i64 = i64::MIN;

/// The patch in the mesh, and the vertices moved beside it.
#[derive(Clone, Debug)]
pub(super) struct FollowedPatch {
    pub splice: Splice,
    /// support of each vertex
    pub support: Vec<Support>,
    /// vertices away from their place in scan and patch
    pub moved: Vec<VertexId>,
    /// time of the last motion of each vertex, ns
    pub moved_ns: Vec<i64>,
    /// buffer for the faces around the moved vertices
    pub refit: Vec<FaceId>,
}

impl FollowedPatch {
    /// For a scan without a patch, with room for `vertices` new vertices.
    pub(crate) fn new(scan: &TriMesh, vertices: usize) -> Self {
        let slots = scan.vertex_slots();
        let (mut support, mut moved_ns) = (
            Vec::with_capacity(slots + vertices),
            Vec::with_capacity(slots + vertices),
        );
        support.resize(slots, Support::Scan);
        moved_ns.resize(slots, NEVER);
        Self {
            splice: Splice::default(),
            support,
            moved: Vec::new(),
            moved_ns,
            refit: Vec::new(),
        }
    }

    /// Memory of the data per vertex, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.support.capacity() * size_of::<Support>()
            + self.moved_ns.capacity() * size_of::<i64>()
            + self.moved.capacity() * size_of::<VertexId>()
    }

    #[inline]
    pub(crate) fn is_touched(&self, vertex: VertexId) -> bool {
        self.support(vertex) == Support::Touched
    }

    /// Support of a vertex in the patch.
    #[inline]
    pub(crate) fn support(&self, vertex: VertexId) -> Support {
        self.support[vertex.0 as usize]
    }

    /// Records the motion of these vertices.
    pub(crate) fn note_moved(&mut self, vertices: &[VertexId], stamp_ns: i64) {
        for &vertex in vertices {
            let moved_ns = &mut self.moved_ns[vertex.0 as usize];
            if *moved_ns == NEVER {
                self.moved.push(vertex);
            }
            *moved_ns = stamp_ns;
        }
    }
}
