//! State of one follower of the mesh, and its way to a version: messages from version to version,
//! and the whole state for a new follower.

use std::vec::IntoIter;

use super::edits::FaceEdit;
use super::version::MeshVersion;
use crate::ros::clock::time;
use crate::ros::messages::{Header, MeshPatch};
use touchup_geometry::mesh::IdSet;
use touchup_method::reconstruct::Support;

/// The place of a follower in the versions of the mesh. A new follower without any data gets the
/// whole state first.
#[derive(Debug, Default)]
pub struct MeshCursor {
    /// version of the follower; 0: it has nothing
    version: u64,
    vertices: FollowedIds,
    faces: FollowedIds,
    /// rest of the change on its way to the follower
    change: PendingChange,
    /// number of its parts up to now
    parts: u32,
}

/// Vertices or faces of a follower.
#[derive(Debug, Default)]
struct FollowedIds {
    /// changes not yet in [`PendingChange`]
    changed: IdSet,
    /// numbers that the follower has
    had: IdBits,
}

/// A bit for each id.
#[derive(Debug, Default)]
struct IdBits(Vec<u64>);

impl IdBits {
    fn has(&self, id: u32) -> bool {
        let word = self.0.get(id as usize / 64);
        word.is_some_and(|word| word >> (id % 64) & 1 == 1)
    }

    /// Sets a bit; returns its previous state.
    fn replace(&mut self, id: u32, is_there: bool) -> bool {
        let (word, bit) = (id as usize / 64, 1 << (id % 64));
        if word >= self.0.len() {
            self.0.resize(word + 1, 0);
        }
        let was = self.0[word] & bit != 0;
        if was != is_there {
            self.0[word] ^= bit;
        }
        was
    }
}

/// A change in the order of its messages: a face comes after its corners, and a vertex goes after
/// all faces that used it.
#[derive(Debug, Default)]
struct PendingChange {
    removed_faces: IntoIter<u32>,
    vertices: IntoIter<u32>,
    faces: IntoIter<u32>,
    removed_vertices: IntoIter<u32>,
}

impl FollowedIds {
    /// All that is there.
    fn of(slots: u32, is_there: impl Fn(u32) -> bool) -> Self {
        let mut all = Self::default();
        (0..slots).filter(|&id| is_there(id)).for_each(|id| {
            all.had.replace(id, true);
        });
        all
    }

    /// Changed numbers that are there, and the others.
    ///
    /// - `all`: number of slots, for a new follower, to which everything is a change.
    fn take(&mut self, all: Option<u32>, is_there: impl Fn(u32) -> bool) -> [Vec<u32>; 2] {
        if let Some(slots) = all {
            self.changed = IdSet::default();
            return [(0..slots).filter(|&id| is_there(id)).collect(), Vec::new()];
        }
        let (mut set, mut removed) = (Vec::new(), Vec::new());
        self.changed.take(usize::MAX, |id| {
            if is_there(id) {
                set.push(id);
            } else if self.had.has(id) {
                removed.push(id);
            }
        });
        [set, removed]
    }
}

impl PendingChange {
    fn len(&self) -> usize {
        let lists = [
            &self.removed_faces,
            &self.vertices,
            &self.faces,
            &self.removed_vertices,
        ];
        lists.map(ExactSizeIterator::len).iter().sum()
    }
}

impl MeshCursor {
    /// A follower that has this version.
    pub fn at(mesh: &MeshVersion) -> Self {
        let [vertices, faces] = mesh.slots();
        Self {
            version: mesh.version,
            vertices: FollowedIds::of(vertices, |vertex| mesh.vertex(vertex).is_some()),
            faces: FollowedIds::of(faces, |face| mesh.face(face).is_some()),
            ..Self::default()
        }
    }

    /// Version of the follower.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Notes changed vertices and faces.
    pub fn note(&mut self, vertices: &[u32], faces: &[FaceEdit]) {
        for vertex in vertices {
            self.vertices.changed.insert(*vertex);
        }
        for (face, _) in faces {
            self.faces.changed.insert(*face);
        }
    }

    /// The next part of the change to `mesh`, in its current state; `None`: the follower has all.
    ///
    /// If the mesh changes between the parts, further parts lead to its newer version, and a face
    /// may name a vertex of a later part.
    ///
    /// - `version`: of the state.
    /// - `most`: maximum number of vertices and faces in a part.
    pub fn next_part(
        &mut self,
        mesh: &MeshVersion,
        version: u64,
        most: usize,
    ) -> Option<MeshPatch> {
        let is_begun = self.version == 0 || self.parts > 0;
        if !is_begun && (self.version == version || self.changed() == 0) {
            return None;
        }
        if self.change.len() == 0 {
            self.begin_change(mesh);
        }
        let mut patch = self.take_part(mesh, most);
        let left = self.change.len() + self.changed();
        (patch.version, patch.base_version) = (version, self.version);
        (patch.part, patch.part_count) = (self.parts, self.parts + 1 + left.div_ceil(most) as u32);
        if left == 0 {
            (self.version, self.parts) = (version, 0);
            // its lists may be large
            self.change = PendingChange::default();
        } else {
            self.parts += 1;
        }
        Some(patch)
    }

    fn changed(&self) -> usize {
        self.vertices.changed.len() + self.faces.changed.len()
    }

    fn begin_change(&mut self, mesh: &MeshVersion) {
        let is_new = (self.version, self.parts) == (0, 0);
        let [vertices, faces] = mesh.slots().map(|slots| is_new.then_some(slots));
        let is_vertex = |vertex| mesh.vertex(vertex).is_some();
        let [vertices, removed_vertices] = self.vertices.take(vertices, is_vertex);
        let is_face = |face| mesh.face(face).is_some();
        let [faces, removed_faces] = self.faces.take(faces, is_face);
        self.change = PendingChange {
            removed_faces: removed_faces.into_iter(),
            vertices: vertices.into_iter(),
            faces: faces.into_iter(),
            removed_vertices: removed_vertices.into_iter(),
        };
    }

    /// Takes a part of the change; a number that has turned since its begin is among the next
    /// changes.
    fn take_part(&mut self, mesh: &MeshVersion, most: usize) -> MeshPatch {
        let Self {
            vertices,
            faces,
            change,
            ..
        } = self;
        let [vertex_count, face_count] = mesh.counts;
        let mut patch = MeshPatch {
            header: Header {
                stamp: time(mesh.stamp_ns),
                frame_id: mesh.frame.clone(),
            },
            session: mesh.session.clone(),
            vertex_count,
            face_count,
            ..MeshPatch::default()
        };
        let mut room = most;
        let mut taken = |ids: &mut IntoIter<u32>| {
            let taken: Vec<u32> = ids.take(room).collect();
            room -= taken.len();
            taken
        };
        patch.removed_faces = taken(&mut change.removed_faces);
        patch
            .removed_faces
            .retain(|&face| mesh.face(face).is_none() && faces.had.replace(face, false));
        for vertex in taken(&mut change.vertices) {
            if let Some((position, support)) = mesh.vertex(vertex) {
                vertices.had.replace(vertex, true);
                patch.vertices.push(vertex);
                patch
                    .positions
                    .extend(position.coords.iter().map(|x| *x as f32));
                patch.variance.push(mesh.variance(vertex));
                patch.support.push(number_of(support));
            }
        }
        for face in taken(&mut change.faces) {
            if let Some(corners) = mesh.face(face) {
                faces.had.replace(face, true);
                patch.faces.push(face);
                patch.corners.extend(corners);
            }
        }
        patch.removed_vertices = taken(&mut change.removed_vertices);
        patch
            .removed_vertices
            .retain(|&vertex| mesh.vertex(vertex).is_none() && vertices.had.replace(vertex, false));
        patch
    }
}

fn number_of(support: Support) -> u8 {
    match support {
        Support::Scan => MeshPatch::SUPPORT_SCAN,
        Support::Touched => MeshPatch::SUPPORT_TOUCHED,
        Support::Guessed => MeshPatch::SUPPORT_GUESSED,
        Support::Unreachable => MeshPatch::SUPPORT_UNREACHABLE,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::BTreeMap;

    use nalgebra::Point3;

    use super::super::edits::Edits;
    use super::super::version::tests::scan;
    use super::*;
    use touchup_geometry::mesh::TriMesh;

    /// A follower by `msg/MeshPatch.msg`, for changes that may come in parts of several versions.
    #[derive(Debug, Default, PartialEq)]
    pub struct PatchReader {
        pub session: String,
        pub version: u64,
        pub vertices: BTreeMap<u32, [f32; 3]>,
        pub faces: BTreeMap<u32, [u32; 3]>,
    }

    impl PatchReader {
        pub fn take(&mut self, patch: &MeshPatch) {
            if patch.base_version == 0 && patch.part == 0 {
                *self = Self {
                    session: patch.session.clone(),
                    ..Self::default()
                };
            }
            assert_eq!(
                (&self.session, self.version),
                (&patch.session, patch.base_version)
            );
            for face in &patch.removed_faces {
                assert!(self.faces.remove(face).is_some(), "face {face}");
            }
            let places = patch.positions.as_chunks().0.iter().copied();
            self.vertices
                .extend(patch.vertices.iter().copied().zip(places));
            let corners = patch.corners.as_chunks().0.iter().copied();
            self.faces.extend(patch.faces.iter().copied().zip(corners));
            for vertex in &patch.removed_vertices {
                assert!(self.vertices.remove(vertex).is_some(), "vertex {vertex}");
            }
            if patch.part + 1 == patch.part_count {
                self.version = patch.version;
                let counts = [self.vertices.len() as u32, self.faces.len() as u32];
                assert_eq!(counts, [patch.vertex_count, patch.face_count]);
            }
        }
    }

    /// The corners of faces between them, one after another.
    fn fan(vertices: u32) -> MeshVersion {
        let place = |i: u32| Point3::new(f64::from(i), f64::from(i % 2), 0.0);
        let faces = (0..vertices - 2).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = TriMesh::new((0..vertices).map(place).collect(), faces).unwrap();
        MeshVersion::of(scan(mesh), "object", "a", f32::NAN)
    }

    fn moved(version: u64, vertex: u32, x: f64) -> Edits {
        let mut edits = Edits::default();
        (edits.version, edits.is_complete) = (version, true);
        let place = (Point3::new(x, x, x), Support::Touched);
        edits.vertices.push((vertex, Some(place)));
        edits
    }

    fn apply(mesh: &mut MeshVersion, cursor: &mut MeshCursor, edits: &Edits) {
        let changed = mesh.apply(edits);
        cursor.note(&changed, &edits.faces);
    }

    #[test]
    fn a_large_change_comes_in_parts_with_vertices_before_faces() {
        let mesh = fan(25);
        let (mut cursor, mut reader) = (MeshCursor::default(), PatchReader::default());
        let mut parts = Vec::new();
        while let Some(patch) = cursor.next_part(&mesh, 1, 10) {
            reader.take(&patch);
            let corners = reader.faces.values().flatten();
            assert!(
                corners
                    .into_iter()
                    .all(|corner| reader.vertices.contains_key(corner))
            );
            parts.push((patch.part, patch.part_count));
        }
        assert_eq!(parts, [0, 1, 2, 3, 4].map(|part| (part, 5)));
        assert_eq!((reader.vertices.len(), reader.faces.len()), (25, 23));
        assert_eq!(cursor.version(), 1);
    }

    /// The mesh after the last part is the one of its version, whatever happened between the parts.
    #[test]
    fn a_mesh_that_changes_between_the_parts_comes_in_further_parts() {
        let mut mesh = fan(25);
        let (mut cursor, mut reader) = (MeshCursor::default(), PatchReader::default());
        reader.take(&cursor.next_part(&mesh, 1, 10).unwrap());
        // of those that have come and of those to come, one vertex moves and another goes
        for (version, vertex) in [(2, 3), (3, 20)] {
            apply(&mut mesh, &mut cursor, &moved(version, vertex, 7.0));
        }
        let mut gone = Edits::default();
        (gone.version, gone.is_complete) = (4, true);
        gone.faces = vec![(0, None), (22, None)];
        gone.vertices = vec![(0, None), (24, None)];
        apply(&mut mesh, &mut cursor, &gone);
        while let Some(patch) = cursor.next_part(&mesh, mesh.version, 10) {
            reader.take(&patch);
        }
        let vertices: Vec<u32> = reader.vertices.keys().copied().collect();
        assert_eq!(vertices, (1..24).collect::<Vec<_>>());
        let faces: Vec<u32> = reader.faces.keys().copied().collect();
        assert_eq!(faces, (1..22).collect::<Vec<_>>());
        assert_eq!(
            (reader.vertices[&3], reader.vertices[&20]),
            ([7.0; 3], [7.0; 3])
        );
        assert_eq!((reader.version, cursor.version()), (4, 4));
    }

    #[test]
    fn a_late_or_slow_follower_gets_the_newest_state_once() {
        let mut mesh = fan(3);
        let (mut early, mut late) = (PatchReader::default(), PatchReader::default());
        let mut cursor = MeshCursor::default();
        early.take(&cursor.next_part(&mesh, 1, 10).unwrap());
        for version in 2..100 {
            let edits = moved(version, 1, version as f64);
            apply(&mut mesh, &mut cursor, &edits);
        }
        let mut joined = MeshCursor::default();
        early.take(&cursor.next_part(&mesh, 99, 10).unwrap());
        late.take(&joined.next_part(&mesh, 99, 10).unwrap());
        assert_eq!(early, late);
        assert_eq!(late.vertices[&1], [99.0; 3]);
        for cursor in [&mut cursor, &mut joined] {
            assert!(cursor.next_part(&mesh, 99, 10).is_none());
        }
    }

    #[test]
    fn only_numbers_of_the_follower_go_and_each_once() {
        let mut mesh = fan(200);
        let mut cursor = MeshCursor::at(&mesh);
        let mut gone = Edits::default();
        (gone.version, gone.is_complete) = (2, true);
        // the last two were never there
        gone.faces = [0, 63, 64, 197, 198, 256].map(|face| (face, None)).to_vec();
        for version in [2, 3] {
            gone.version = version;
            apply(&mut mesh, &mut cursor, &gone);
        }
        let mut patch = cursor.next_part(&mesh, 3, 1000).unwrap();
        patch.removed_faces.sort_unstable();
        assert_eq!(patch.removed_faces, [0, 63, 64, 197]);
        gone.version = 4;
        apply(&mut mesh, &mut cursor, &gone);
        assert!(
            cursor
                .next_part(&mesh, 4, 1000)
                .unwrap()
                .removed_faces
                .is_empty()
        );
    }

    #[test]
    fn a_vertex_that_came_and_went_since_the_last_message_is_not_sent() {
        let mut mesh = fan(3);
        let mut cursor = MeshCursor::at(&mesh);
        let mut edits = moved(2, 5, 1.0);
        edits.faces.push((4, Some([0, 1, 5])));
        apply(&mut mesh, &mut cursor, &edits);
        edits.version = 3;
        edits.faces[0].1 = None;
        edits.vertices[0].1 = None;
        apply(&mut mesh, &mut cursor, &edits);
        let patch = cursor.next_part(&mesh, 3, 10).unwrap();
        assert_eq!((patch.part_count, patch.version), (1, 3));
        let lists = [patch.removed_faces, patch.faces, patch.removed_vertices];
        assert!(lists.iter().all(Vec::is_empty));
        // faces used two others for a while
        assert!(patch.vertices.iter().all(|vertex| *vertex < 3));
    }
}
