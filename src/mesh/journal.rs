//! Which vertices and faces of a mesh changed, for who keeps a copy of it.

use super::{FaceId, VertexId};

/// What changed in a [`super::TriMesh`] that is watched; each thing is named once, in no particular order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// moved, added or removed: [`super::TriMesh::has_vertex`] tells which
    pub vertices: Vec<VertexId>,
    /// added, removed, or with other corners: [`super::TriMesh::has_face`] tells which
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
    vertices: Noted,
    faces: Noted,
}

#[derive(Clone, Debug, Default)]
struct Noted {
    /// bit `id % 64` of word `id / 64`: noted
    is_noted: Vec<u64>,
    ids: Vec<u32>,
}

impl Journal {
    /// Nothing noted yet, room for so many slots.
    pub fn new(vertices: usize, faces: usize) -> Self {
        Self { vertices: Noted::with_slots(vertices), faces: Noted::with_slots(faces) }
    }

    #[inline]
    pub fn note_vertex(&mut self, vertex: u32) {
        self.vertices.note(vertex);
    }

    #[inline]
    pub fn note_face(&mut self, face: u32) {
        self.faces.note(face);
    }

    /// Moves up to `most` vertices and as many faces over; returns whether that was all.
    pub fn take(&mut self, most: usize, into: &mut Changes) -> bool {
        self.vertices.take(most, |vertex| into.vertices.push(VertexId(vertex)));
        self.faces.take(most, |face| into.faces.push(FaceId(face)));
        self.vertices.ids.is_empty() && self.faces.ids.is_empty()
    }

    pub fn bytes(&self) -> usize {
        [&self.vertices, &self.faces].map(|noted| 8 * noted.is_noted.capacity() + 4 * noted.ids.capacity()).iter().sum()
    }
}

impl Noted {
    fn with_slots(slots: usize) -> Self {
        Self { is_noted: vec![0; slots.div_ceil(64)], ids: Vec::new() }
    }

    #[inline]
    fn note(&mut self, id: u32) {
        let (word, bit) = (id as usize / 64, 1 << (id % 64));
        if word >= self.is_noted.len() {
            self.is_noted.resize(word + 1, 0);
        }
        if self.is_noted[word] & bit == 0 {
            self.is_noted[word] |= bit;
            self.ids.push(id);
        }
    }

    fn take(&mut self, most: usize, mut each: impl FnMut(u32)) {
        for id in self.ids.drain(self.ids.len().saturating_sub(most)..) {
            self.is_noted[id as usize / 64] &= !(1 << (id % 64));
            each(id);
        }
    }
}
