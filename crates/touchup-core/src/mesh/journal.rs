//! Which vertices and faces of a mesh changed, for a caller that keeps a copy of it.

use super::{FaceId, VertexId};

/// What changed in a [`super::TriMesh`] that is watched; each thing is named once, in no particular
/// order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// moved, added or removed: see [`super::TriMesh::has_vertex`]
    pub vertices: Vec<VertexId>,
    /// added, removed, or with other corners: see [`super::TriMesh::has_face`]
    pub faces: Vec<FaceId>,
}

impl Changes {
    /// Forgets all, keeps the memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
    }
}

/// What changed and was not taken yet: a bit for each slot, so memory is bounded by the mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Journal {
    vertices: IdSet,
    faces: IdSet,
    /// edits so far
    edits: u64,
}

impl Journal {
    /// Nothing noted yet, room for so many slots.
    pub fn new(vertices: usize, faces: usize) -> Self {
        Self {
            vertices: IdSet::with_slots(vertices),
            faces: IdSet::with_slots(faces),
            edits: 0,
        }
    }

    /// Never inlined: most meshes are not watched.
    #[inline(never)]
    pub fn note_vertex(&mut self, vertex: u32) {
        self.edits += 1;
        self.vertices.insert(vertex);
    }

    #[inline]
    pub fn note_face(&mut self, face: u32) {
        self.edits += 1;
        self.faces.insert(face);
    }

    /// Moves up to `most` vertices and as many faces over; returns whether that was all.
    pub fn take(&mut self, most: usize, into: &mut Changes) -> bool {
        self.vertices
            .take(most, |vertex| into.vertices.push(VertexId(vertex)));
        self.faces.take(most, |face| into.faces.push(FaceId(face)));
        self.vertices.is_empty() && self.faces.is_empty()
    }

    pub fn edits(&self) -> u64 {
        self.edits
    }

    pub fn bytes(&self) -> usize {
        [&self.vertices, &self.faces]
            .map(|noted: &IdSet| 8 * noted.is_in.capacity() + 4 * noted.ids.capacity())
            .iter()
            .sum()
    }
}

/// A set of ids that is filled and emptied again and again: a bit for each, and a list of those
/// that are in it.
#[derive(Clone, Debug, Default)]
pub struct IdSet {
    /// bit `id % 64` of word `id / 64`: it is in the list
    is_in: Vec<u64>,
    ids: Vec<u32>,
}

impl IdSet {
    /// An empty one with room for ids below `slots`; others are taken too.
    pub(crate) fn with_slots(slots: usize) -> Self {
        Self {
            is_in: vec![0; slots.div_ceil(64)],
            ids: Vec::new(),
        }
    }

    /// Puts an id in.
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

    /// Whether none is in.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// How many are in.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Takes up to `most` out and gives them to `each`.
    pub fn take(&mut self, most: usize, mut each: impl FnMut(u32)) {
        for id in self.ids.drain(self.ids.len().saturating_sub(most)..) {
            self.is_in[id as usize / 64] &= !(1 << (id % 64));
            each(id);
        }
    }
}
