//! The patch in the mesh that the haptic update works on.
//!
//! What the patch knows from touches is stiff. What the update moves elsewhere, scan and guesses, is there at once, and
//! for the moment: when the patch has caught up with that touch it is put back, and the patch has the contact.

use nalgebra::Point3;

use crate::mesh::{FaceId, FaceTree, MeshError, TriMesh, VertexId};
use crate::reconstruct::{PatchDelta, Splice, Support};

/// Never moved.
const NEVER: i64 = i64::MIN;

/// The patch as the mesh shows it, and what was moved beside it.
#[derive(Clone, Debug)]
pub(super) struct FollowedPatch {
    pub splice: Splice,
    /// the support of each vertex
    support: Vec<Support>,
    /// vertices that are not where scan and patch have them
    moved: Vec<VertexId>,
    /// … and when each of them moved last, ns
    moved_ns: Vec<i64>,
    refit: Vec<FaceId>,
}

impl FollowedPatch {
    /// For a scan without a patch, with room for so many new vertices.
    pub fn new(scan: &TriMesh, vertices: usize) -> Self {
        let slots = scan.vertex_slots();
        let (mut support, mut moved_ns) = (Vec::with_capacity(slots + vertices), Vec::with_capacity(slots + vertices));
        support.resize(slots, Support::Scan);
        moved_ns.resize(slots, NEVER);
        Self { splice: Splice::default(), support, moved: Vec::new(), moved_ns, refit: Vec::new() }
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

    /// Puts vertices that moved last at `until_ns` or before back to where they were `scanned`, or are in the patch; returns
    /// whether there was any.
    pub fn put_back(
        &mut self,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
        scanned: &[Point3<f64>],
        until_ns: i64,
    ) -> bool {
        let Self { moved, moved_ns, refit, .. } = self;
        refit.clear();
        moved.retain(|&vertex| {
            let at = vertex.0 as usize;
            let is_late = moved_ns[at] > until_ns;
            if !is_late {
                moved_ns[at] = NEVER;
                if mesh.position(vertex) != scanned[at] {
                    mesh.set_position(vertex, scanned[at]);
                    refit.extend_from_slice(mesh.star(vertex));
                }
            }
            is_late
        });
        tree.refit(mesh, refit);
        !refit.is_empty()
    }

    /// Takes up some more of a delta, as [`Splice::go_on`]; notes the support of its vertices, and where they are `scanned`.
    pub fn go_on(
        &mut self,
        delta: &PatchDelta,
        most: usize,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
        scanned: &mut Vec<Point3<f64>>,
    ) -> Result<bool, MeshError> {
        let before = self.splice.placed().len();
        let is_done = self.splice.go_on(delta, most, mesh, tree)?;
        self.support.resize(mesh.vertex_slots(), Support::Scan);
        self.moved_ns.resize(mesh.vertex_slots(), NEVER);
        scanned.resize(mesh.vertex_slots(), Point3::origin());
        for (vertex, placed) in self.splice.placed().iter().zip(&delta.vertices).skip(before) {
            self.support[vertex.0 as usize] = placed.support;
            scanned[vertex.0 as usize] = placed.position;
        }
        Ok(is_done)
    }
}
