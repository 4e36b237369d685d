//! Copy of the mesh for pages of browsers, in the numbers of `MeshPatch`, with the missing parts of
//! each page.
//!
//! A slow page lacks more, and gets the then newest state: its backlog is a set of numbers, bounded
//! by the mesh.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::ros::messages::{MeshPatch, Time};
use touchup_geometry::mesh::IdSet;
use touchup_method::reconstruct::Support;

/// Maximum number of vertices, or faces, of one message: 1.4 MB.
pub(super) const OF_A_MESSAGE: usize = 1 << 16;

/// Support of a missing vertex.
const NO_VERTEX: u8 = u8::MAX;
/// Corners of a missing face.
const NO_FACE: [u32; 3] = [u32::MAX; 3];

/// A state of the shape of the mesh: session and version.
pub(super) type MeshState = (String, u64);
/// A vertex with support other than the scan: number, position in m in O, support.
pub(super) type TouchedVertex = (u32, Point3<f64>, Support);

/// Support of a vertex other than the scan.
fn known_by(support: u8) -> Option<Support> {
    match support {
        MeshPatch::SUPPORT_TOUCHED => Some(Support::Touched),
        MeshPatch::SUPPORT_GUESSED => Some(Support::Guessed),
        MeshPatch::SUPPORT_UNREACHABLE => Some(Support::Unreachable),
        _ => None,
    }
}

/// Unique number of a page.
pub(super) type PageId = u64;

/// Missing parts of one page.
#[derive(Debug, Default)]
struct PageBacklog {
    vertices: IdSet,
    faces: IdSet,
    /// the page's state; 0: none
    version: u64,
    /// number of messages since its last complete state
    part: u32,
}

/// The mesh, and the missing parts of each page.
#[derive(Debug, Default)]
pub(super) struct MeshCopy {
    frame: String,
    session: String,
    version: u64,
    /// version of the last change of shape: later ones change variances only
    shape_version: u64,
    stamp: Time,
    /// m
    positions: Vec<[f32; 3]>,
    /// m²
    variance: Vec<f32>,
    support: Vec<u8>,
    corners: Vec<[u32; 3]>,
    /// vertices and faces in the version
    counts: [u32; 2],
    pages: BTreeMap<PageId, PageBacklog>,
    /// the whole state of a new session is incomplete: pages get no mesh
    is_coming: bool,
    /// changes that wait for the complete state
    later: Vec<MeshPatch>,
    /// the first parts of a change
    begun: Vec<MeshPatch>,
}

impl MeshCopy {
    /// Applies patches of the node, in its order.
    pub fn take(&mut self, patch: MeshPatch) {
        let is_new = self.session != patch.session;
        match patch.base_version {
            0 if is_new => self.begin(patch),
            0 if self.is_coming => self.part_of_whole(&patch),
            // of another session, or a whole state for another follower
            0 => {}
            _ if is_new => {}
            _ if self.is_coming => self.later.push(patch),
            _ => self.part_of_change(patch),
        }
    }

    fn begin(&mut self, patch: MeshPatch) {
        let pages = std::mem::take(&mut self.pages);
        let pages = pages
            .into_keys()
            .map(|page| (page, PageBacklog::default()))
            .collect();
        let (frame, session) = (patch.header.frame_id.clone(), patch.session.clone());
        *self = Self {
            frame,
            session,
            pages,
            is_coming: true,
            ..Self::default()
        };
        self.part_of_whole(&patch);
    }

    fn part_of_whole(&mut self, patch: &MeshPatch) {
        self.apply(patch);
        if patch.part + 1 == patch.part_count {
            self.is_coming = false;
            for patch in std::mem::take(&mut self.later) {
                self.part_of_change(patch);
            }
        }
    }

    /// Applies a change once complete, so that readers always see one version.
    fn part_of_change(&mut self, patch: MeshPatch) {
        let is_last = patch.part + 1 == patch.part_count;
        self.begun.push(patch);
        if is_last {
            std::mem::take(&mut self.begun)
                .iter()
                .for_each(|patch| self.apply(patch));
        }
    }

    fn apply(&mut self, patch: &MeshPatch) {
        let mut is_shape = !patch.removed_faces.is_empty()
            || !patch.faces.is_empty()
            || !patch.removed_vertices.is_empty();
        for &face in &patch.removed_faces {
            self.set_face(face, NO_FACE);
        }
        let places = patch
            .positions
            .as_chunks()
            .0
            .iter()
            .zip(&patch.variance)
            .zip(&patch.support);
        for (&vertex, ((position, variance), support)) in patch.vertices.iter().zip(places) {
            let at = vertex as usize;
            if at >= self.support.len() {
                self.positions.resize(at + 1, [0.0; 3]);
                self.variance.resize(at + 1, f32::NAN);
                self.support.resize(at + 1, NO_VERTEX);
            }
            is_shape |= (self.positions[at], self.support[at]) != (*position, *support);
            (self.positions[at], self.variance[at], self.support[at]) =
                (*position, *variance, *support);
            self.lack_vertex(vertex);
        }
        for (&face, corners) in patch.faces.iter().zip(patch.corners.as_chunks().0) {
            self.set_face(face, *corners);
        }
        for &vertex in &patch.removed_vertices {
            if let Some(support) = self.support.get_mut(vertex as usize) {
                *support = NO_VERTEX;
                self.lack_vertex(vertex);
            }
        }
        if is_shape {
            self.shape_version = patch.version;
        }
        if patch.part + 1 == patch.part_count {
            (self.version, self.stamp) = (patch.version, patch.header.stamp);
        }
        self.counts = [patch.vertex_count, patch.face_count];
    }

    fn set_face(&mut self, face: u32, corners: [u32; 3]) {
        let at = face as usize;
        if at >= self.corners.len() {
            self.corners.resize(at + 1, NO_FACE);
        }
        self.corners[at] = corners;
        self.pages
            .values_mut()
            .for_each(|lacking| lacking.faces.insert(face));
    }

    fn lack_vertex(&mut self, vertex: u32) {
        self.pages
            .values_mut()
            .for_each(|lacking| lacking.vertices.insert(vertex));
    }

    /// Adds a page without any data.
    pub fn join(&mut self, page: PageId) {
        let mut lacking = PageBacklog::default();
        let vertices = (0..)
            .zip(&self.support)
            .filter(|(_, support)| **support != NO_VERTEX);
        vertices.for_each(|(vertex, _)| lacking.vertices.insert(vertex));
        let faces = (0..)
            .zip(&self.corners)
            .filter(|(_, corners)| **corners != NO_FACE);
        faces.for_each(|(face, _)| lacking.faces.insert(face));
        self.pages.insert(page, lacking);
    }

    /// Removes a page.
    pub fn leave(&mut self, page: PageId) {
        self.pages.remove(&page);
    }

    /// Session, and the version of the shape.
    pub fn shape_state(&self) -> MeshState {
        (self.session.clone(), self.shape_version)
    }

    /// The vertices with support by touches, guessed, or unreachable.
    pub fn touched(&self) -> Vec<TouchedVertex> {
        let place = |at: usize| Point3::from(self.positions[at].map(f64::from));
        let vertices = (0..).zip(&self.support);
        let touched = vertices.filter_map(|(vertex, support)| {
            Some((vertex, place(vertex as usize), known_by(*support)?))
        });
        touched.collect()
    }

    /// Name of the session.
    pub fn session(&self) -> &str {
        &self.session
    }

    /// The next part that a page lacks, in its present state, vertices before faces; `None`: the
    /// page is complete.
    ///
    /// A state may change between parts: a face may name a vertex of the next part.
    pub fn next_for(&mut self, page: PageId) -> Option<MeshPatch> {
        // no mesh yet
        if self.is_coming || self.version == 0 {
            return None;
        }
        let Self {
            pages,
            positions,
            variance,
            support,
            corners,
            ..
        } = self;
        let lacking = pages.get_mut(&page)?;
        let is_first_whole = lacking.version == 0 && lacking.part == 0;
        if lacking.vertices.is_empty() && lacking.faces.is_empty() && !is_first_whole {
            return None;
        }
        let mut patch = MeshPatch::default();
        lacking.vertices.take(OF_A_MESSAGE, |vertex| {
            let at = vertex as usize;
            if support[at] == NO_VERTEX {
                return patch.removed_vertices.push(vertex);
            }
            patch.vertices.push(vertex);
            patch.positions.extend(positions[at]);
            patch.variance.push(variance[at]);
            patch.support.push(support[at]);
        });
        let room = OF_A_MESSAGE - patch.vertices.len() - patch.removed_vertices.len();
        lacking
            .faces
            .take(room, |face| match corners[face as usize] {
                NO_FACE => patch.removed_faces.push(face),
                corners => {
                    patch.faces.push(face);
                    patch.corners.extend(corners);
                }
            });
        let left = lacking.vertices.len() + lacking.faces.len();
        (patch.part, patch.part_count) = (
            lacking.part,
            lacking.part + 1 + left.div_ceil(OF_A_MESSAGE) as u32,
        );
        (patch.base_version, patch.version) = (lacking.version, self.version);
        if left == 0 {
            (lacking.version, lacking.part) = (self.version, 0);
        } else {
            lacking.part += 1;
        }
        [patch.vertex_count, patch.face_count] = self.counts;
        (patch.header.stamp, patch.header.frame_id) = (self.stamp, self.frame.clone());
        patch.session.clone_from(&self.session);
        Some(patch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Vertices = BTreeMap<u32, [f32; 3]>;
    type Faces = BTreeMap<u32, [u32; 3]>;

    /// A follower as msg/MeshPatch.msg describes it.
    #[derive(Debug, Default, PartialEq)]
    struct Page {
        session: String,
        vertices: Vertices,
        faces: Faces,
    }

    impl Page {
        fn take(&mut self, patch: &MeshPatch) {
            if patch.base_version == 0 && patch.part == 0 {
                *self = Self {
                    session: patch.session.clone(),
                    ..Self::default()
                };
            }
            assert_eq!(self.session, patch.session);
            self.faces
                .retain(|face, _| !patch.removed_faces.contains(face));
            self.vertices.extend(
                patch
                    .vertices
                    .iter()
                    .copied()
                    .zip(patch.positions.as_chunks().0.iter().copied()),
            );
            self.faces.extend(
                patch
                    .faces
                    .iter()
                    .copied()
                    .zip(patch.corners.as_chunks().0.iter().copied()),
            );
            self.vertices
                .retain(|vertex, _| !patch.removed_vertices.contains(vertex));
        }

        /// Applies all pending messages; returns their number.
        fn catch_up(&mut self, copy: &mut MeshCopy, page: PageId) -> usize {
            std::iter::from_fn(|| copy.next_for(page))
                .inspect(|patch| self.take(patch))
                .count()
        }
    }

    fn patch(
        session: &str,
        versions: [u64; 2],
        vertices: &[(u32, f32)],
        faces: &[(u32, [u32; 3])],
    ) -> MeshPatch {
        MeshPatch {
            session: session.to_owned(),
            base_version: versions[0],
            version: versions[1],
            part_count: 1,
            vertices: vertices.iter().map(|(id, _)| *id).collect(),
            positions: vertices.iter().flat_map(|(_, x)| [*x; 3]).collect(),
            variance: vec![f32::NAN; vertices.len()],
            support: vec![0; vertices.len()],
            faces: faces.iter().map(|(id, _)| *id).collect(),
            corners: faces.iter().flat_map(|(_, corners)| *corners).collect(),
            ..MeshPatch::default()
        }
    }

    fn triangle(session: &str) -> MeshPatch {
        patch(
            session,
            [0, 1],
            &[(0, 0.0), (1, 1.0), (2, 2.0)],
            &[(0, [0, 1, 2])],
        )
    }

    #[test]
    fn who_joins_late_or_is_slow_gets_the_newest_state_once() {
        let mut copy = MeshCopy::default();
        copy.take(triangle("a"));
        copy.join(1);
        let mut early = Page::default();
        assert_eq!(early.catch_up(&mut copy, 1), 1);
        for version in 2..100 {
            copy.take(patch(
                "a",
                [version - 1, version],
                &[(1, version as f32)],
                &[],
            ));
        }
        copy.join(2);
        let mut late = Page::default();
        assert_eq!(
            (early.catch_up(&mut copy, 1), late.catch_up(&mut copy, 2)),
            (1, 1)
        );
        assert_eq!(early, late);
        assert_eq!(late.vertices[&1], [99.0; 3]);
        assert_eq!(late.catch_up(&mut copy, 2), 0);
        copy.take(MeshPatch {
            removed_faces: vec![0],
            removed_vertices: vec![0],
            ..patch("a", [99, 100], &[], &[])
        });
        early.catch_up(&mut copy, 1);
        assert_eq!((early.vertices.len(), early.faces.len()), (2, 0));
        copy.leave(1);
        assert!(copy.next_for(1).is_none());
    }

    #[test]
    fn a_whole_state_that_another_follower_asked_for_changes_nothing() {
        let mut copy = MeshCopy::default();
        copy.take(triangle("a"));
        copy.join(1);
        let mut page = Page::default();
        page.catch_up(&mut copy, 1);
        copy.take(patch("a", [1, 2], &[(0, 5.0)], &[]));
        copy.take(triangle("a"));
        page.catch_up(&mut copy, 1);
        assert_eq!(page.vertices[&0], [5.0; 3]);
    }

    #[test]
    fn changes_that_come_between_the_parts_of_a_new_session_wait_for_its_last_part() {
        let mut copy = MeshCopy::default();
        copy.take(triangle("a"));
        copy.join(1);
        let mut page = Page::default();
        page.catch_up(&mut copy, 1);
        let parts = |part| MeshPatch {
            part,
            part_count: 2,
            ..triangle("b")
        };
        copy.take(parts(0));
        copy.take(patch("b", [1, 2], &[(2, 7.0)], &[]));
        copy.take(parts(1));
        page.catch_up(&mut copy, 1);
        assert_eq!((page.session.as_str(), page.vertices[&2]), ("b", [7.0; 3]));
        assert_eq!(page.faces.len(), 1);
    }

    /// Touch variances come when the mesh rests: they need no new evaluation of the shape.
    #[test]
    fn a_variance_comes_to_the_pages_and_is_no_other_shape() {
        let mut copy = MeshCopy::default();
        copy.take(triangle("a"));
        copy.join(1);
        Page::default().catch_up(&mut copy, 1);
        assert_eq!(copy.shape_state(), ("a".to_owned(), 1));
        copy.take(MeshPatch {
            variance: vec![1e-10],
            ..patch("a", [1, 2], &[(1, 1.0)], &[])
        });
        let shown = copy.next_for(1).unwrap();
        assert_eq!(
            (shown.version, shown.vertices, shown.variance),
            (2, vec![1], vec![1e-10])
        );
        assert_eq!(copy.shape_state(), ("a".to_owned(), 1));
        copy.take(patch("a", [2, 3], &[(1, 1.5)], &[]));
        assert_eq!(copy.shape_state(), ("a".to_owned(), 3));
    }

    #[test]
    fn a_change_in_parts_is_taken_up_with_its_last_part() {
        let mut copy = MeshCopy::default();
        copy.take(triangle("a"));
        copy.join(1);
        let mut page = Page::default();
        page.catch_up(&mut copy, 1);
        let part = |part, x| MeshPatch {
            part,
            part_count: 2,
            ..patch("a", [1, 2], &[(part, x)], &[])
        };
        copy.take(part(0, 3.0));
        assert!(copy.next_for(1).is_none());
        copy.take(part(1, 4.0));
        page.catch_up(&mut copy, 1);
        assert_eq!((page.vertices[&0], page.vertices[&1]), ([3.0; 3], [4.0; 3]));
    }

    #[test]
    fn a_large_mesh_comes_in_parts_with_vertices_before_faces() {
        let count = OF_A_MESSAGE as u32 + 10;
        let vertices: Vec<_> = (0..count).map(|id| (id, id as f32)).collect();
        let faces: Vec<_> = (0..count - 2)
            .map(|id| (id, [id, id + 1, id + 2]))
            .collect();
        let mut copy = MeshCopy::default();
        copy.take(patch("a", [0, 1], &vertices, &faces));
        copy.join(1);
        let mut page = Page::default();
        let mut parts = Vec::new();
        while let Some(patch) = copy.next_for(1) {
            let last = (patch.part, patch.part_count);
            page.take(&patch);
            assert!(
                page.faces
                    .values()
                    .flatten()
                    .all(|corner| page.vertices.contains_key(corner))
            );
            parts.push(last);
        }
        assert_eq!(parts, [(0, 3), (1, 3), (2, 3)]);
        assert_eq!(
            (page.vertices.len(), page.faces.len()),
            (vertices.len(), faces.len())
        );
    }
}
