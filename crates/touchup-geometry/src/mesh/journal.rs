//! Changed vertices and faces of a mesh, for callers that keep a copy of it.

use super::{FaceId, VertexId};

/// Changes of a watched [`super::TriMesh`], each id once, in no particular order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// moved, added or removed: see [`super::TriMesh::has_vertex`]
    pub vertices: Vec<VertexId>,
    /// added, removed, or with other corners: see [`super::TriMesh::has_face`]
    pub faces: Vec<FaceId>,
}

impl Changes {
    /// Removes all entries, keeps the memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
    }
}

/// Changes not taken yet: one bit for each slot, so the mesh bounds the memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Journal {
    vertices: IdSet,
    faces: IdSet,
    /// number of edits
    edits: u64,
}

impl Journal {
    /// An empty journal with room for the given slots.
    pub(crate) fn new(vertices: usize, faces: usize) -> Self {
        Self {
            vertices: IdSet::with_slots(vertices),
            faces: IdSet::with_slots(faces),
            edits: 0,
        }
    }

    /// Never inlined: most meshes have no journal.
    #[inline(never)]
    pub(crate) fn note_vertex(&mut self, vertex: u32) {
        self.edits += 1;
        self.vertices.insert(vertex);
    }

    #[inline]
    pub(crate) fn note_face(&mut self, face: u32) {
        self.edits += 1;
        self.faces.insert(face);
    }

    /// Moves up to `most` vertices and up to `most` faces to `into`; returns whether none remain.
    pub(crate) fn take(&mut self, most: usize, into: &mut Changes) -> bool {
        self.vertices
            .take(most, |vertex| into.vertices.push(VertexId(vertex)));
        self.faces.take(most, |face| into.faces.push(FaceId(face)));
        self.vertices.is_empty() && self.faces.is_empty()
    }

    pub(crate) fn edits(&self) -> u64 {
        self.edits
    }

    pub(crate) fn bytes(&self) -> usize {
        [&self.vertices, &self.faces]
            .map(|noted: &IdSet| 8 * noted.is_in.capacity() + 4 * noted.ids.capacity())
            .iter()
            .sum()
    }
}

/// A set of ids for repeated filling and emptying: a bit for each id, and a list of its members.
#[derive(Clone, Debug, Default)]
pub struct IdSet {
    /// bit `id % 64` of word `id / 64`: the list has the id
    is_in: Vec<u64>,
    ids: Vec<u32>,
}

impl IdSet {
    /// An empty set with room for ids below `slots`; larger ids are allowed too.
    pub(crate) fn with_slots(slots: usize) -> Self {
        Self {
            is_in: vec![0; slots.div_ceil(64)],
            ids: Vec::new(),
        }
    }

    /// Adds an id.
    #[inline]
    pub fn insert(&mut self, id: u32) {
        let (word, bit) = (id as usize / 64, 1 << (id % 64));
        if word >= self.is_in.len() {
            self.is_in.resize(word + 1, 0);
        }
        if self.is_in[word] & bit == 0 {
            self.is_in[word] |= bit;
            self.ids.push(id);
        }
    }

    /// Whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Number of ids in the set.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Removes up to `most` ids and passes them to `each`.
    pub fn take(&mut self, most: usize, mut each: impl FnMut(u32)) {
        for id in self.ids.drain(self.ids.len().saturating_sub(most)..) {
            self.is_in[id as usize / 64] &= !(1 << (id % 64));
            each(id);
        }
    }
}
