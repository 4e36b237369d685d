//! The patch in the mesh that the haptic update works on.
//!
//! What the patch knows from touches is stiff. What the update moves elsewhere, scan and guesses,
//! is there at once, and for the moment: when the patch has caught up with that touch it is put
//! back, and the patch has the contact.

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::reconstruct::{Splice, Support};

/// Never moved.
pub(super) const NEVER: i64 = i64::MIN;

/// The patch as the mesh shows it, and what was moved beside it.
#[derive(Clone, Debug)]
pub(super) struct FollowedPatch {
    pub splice: Splice,
    /// the support of each vertex
    pub support: Vec<Support>,
    /// vertices that are not where scan and patch have them
    pub moved: Vec<VertexId>,
    /// … and when each of them moved last, ns
    pub moved_ns: Vec<i64>,
    /// room for the faces around them
    pub refit: Vec<FaceId>,
}

impl FollowedPatch {
    /// For a scan without a patch, with room for so many new vertices.
    pub fn new(scan: &TriMesh, vertices: usize) -> Self {
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

    /// Memory of what is kept for each vertex, bytes.
    pub fn bytes(&self) -> usize {
        self.support.capacity() * size_of::<Support>()
            + self.moved_ns.capacity() * size_of::<i64>()
            + self.moved.capacity() * size_of::<VertexId>()
    }

    #[inline]
    pub fn is_touched(&self, vertex: VertexId) -> bool {
        self.support(vertex) == Support::Touched
    }

    /// The support of a vertex in the patch.
    #[inline]
    pub fn support(&self, vertex: VertexId) -> Support {
        self.support[vertex.0 as usize]
    }

    /// Remembers that these were moved.
    pub fn note_moved(&mut self, vertices: &[VertexId], stamp_ns: i64) {
        for &vertex in vertices {
            let moved_ns = &mut self.moved_ns[vertex.0 as usize];
            if *moved_ns == NEVER {
                self.moved.push(vertex);
            }
            *moved_ns = stamp_ns;
        }
    }
}
