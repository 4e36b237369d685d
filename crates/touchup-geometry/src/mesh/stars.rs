//! The faces around each vertex, in one array that reuses its free blocks.
//!
//! The stars of a loaded mesh are stored one after another, without gaps. A star that outgrows its
//! place moves to a block of twice the size; a star much smaller than its block moves to one of
//! half the size. Free blocks are kept by size (powers of two) and reused first, so endless
//! replacement of faces takes no more than the largest number of blocks of each size ever in use at
//! once.

use super::FaceId;

/// No block; also the entry of a block without a face.
const NONE: u32 = u32::MAX;
/// Faces in the smallest block.
const SMALLEST_BLOCK: u32 = 4;
/// Smallest share (1/4) of its block that a star fills before it moves to a smaller one; many faces
/// come or go between two moves.
const SMALLEST_FILL: u32 = 4;
/// Largest number of entries: their names have 32 bits, and the last name means none.
const LARGEST: usize = NONE as usize;
/// Maximum number of faces of a mesh: each is in three stars.
pub(super) const MOST_FACES: usize = LARGEST / 3;

/// Place of the faces around one vertex in the list of entries.
#[derive(Clone, Copy, Debug, Default)]
struct StarSlot {
    start: u32,
    len: u32,
    capacity: u32,
}

/// The star of a vertex that was removed.
const REMOVED: StarSlot = StarSlot {
    start: 0,
    len: 0,
    capacity: NONE,
};

/// The faces around each vertex of one mesh.
#[derive(Clone, Debug)]
pub(super) struct Stars {
    slots: Vec<StarSlot>,
    entries: Vec<FaceId>,
    /// first free block of each power of two; its first entry names the next one
    free: [u32; 32],
}

impl Stars {
    /// The faces around a vertex.
    #[inline]
    pub(crate) fn of(&self, vertex: u32) -> &[FaceId] {
        let slot = self.slots[vertex as usize];
        &self.entries[slot.start as usize..(slot.start + slot.len) as usize]
    }

    /// Adds a vertex without faces: a new or a removed one.
    pub(crate) fn add_vertex(&mut self, vertex: u32) {
        match self.slots.get_mut(vertex as usize) {
            Some(slot) => *slot = StarSlot::default(),
            None => self.slots.push(StarSlot::default()),
        }
    }

    /// Whether a vertex exists.
    #[inline]
    pub(crate) fn has(&self, vertex: u32) -> bool {
        self.slots
            .get(vertex as usize)
            .is_some_and(|slot| slot.capacity != NONE)
    }

    /// Removes a vertex that no face uses.
    pub(crate) fn remove_vertex(&mut self, vertex: u32) {
        let slot = std::mem::replace(&mut self.slots[vertex as usize], REMOVED);
        debug_assert_eq!(slot.len, 0);
        self.give_back(slot);
    }

    /// Whether one more face at each of three vertices surely fits.
    #[inline]
    pub(crate) fn have_room(&self, corners: &[u32; 3]) -> bool {
        self.growth(corners) <= LARGEST - self.entries.len()
    }

    /// Entries that one more face at each of three vertices may add.
    #[inline]
    fn growth(&self, corners: &[u32; 3]) -> usize {
        let full = corners
            .iter()
            .map(|&v| self.slots[v as usize])
            .filter(|slot| slot.len == slot.capacity);
        full.map(|slot| block_for(slot.len + 1) as usize).sum()
    }

    /// Adds a face to a star; see [`Self::have_room`].
    #[inline]
    pub(crate) fn push(&mut self, vertex: u32, face: FaceId) {
        let slot = self.slots[vertex as usize];
        if slot.len == slot.capacity {
            self.move_star(vertex, block_for(slot.len + 1));
        }
        let slot = &mut self.slots[vertex as usize];
        self.entries[(slot.start + slot.len) as usize] = face;
        slot.len += 1;
    }

    /// Removes a face from a star that holds it.
    #[inline]
    pub(crate) fn remove(&mut self, vertex: u32, face: FaceId) {
        let slot = &mut self.slots[vertex as usize];
        let star = &mut self.entries[slot.start as usize..(slot.start + slot.len) as usize];
        if let Some(at) = star.iter().position(|&f| f == face) {
            star.swap(at, slot.len as usize - 1);
            slot.len -= 1;
        }
        let StarSlot { len, capacity, .. } = *slot;
        if capacity > 2 * SMALLEST_BLOCK && len < capacity / SMALLEST_FILL {
            let half = block_for(capacity / 2);
            if half as usize <= LARGEST - self.entries.len() {
                self.move_star(vertex, half);
            }
        }
    }

    /// Moves a star to a block of another size.
    fn move_star(&mut self, vertex: u32, capacity: u32) {
        let old = self.slots[vertex as usize];
        let start = self.take_block(capacity);
        self.entries.copy_within(
            old.start as usize..(old.start + old.len) as usize,
            start as usize,
        );
        self.slots[vertex as usize] = StarSlot {
            start,
            len: old.len,
            capacity,
        };
        self.give_back(old);
    }

    fn take_block(&mut self, capacity: u32) -> u32 {
        let first = &mut self.free[capacity.trailing_zeros() as usize];
        let start = *first;
        if start != NONE {
            *first = self.entries[start as usize].0;
            return start;
        }
        let start = self.entries.len();
        self.entries.resize(start + capacity as usize, FaceId(NONE));
        start as u32
    }

    /// Frees a block; of a star in its first place, the largest power of two in it.
    fn give_back(&mut self, slot: StarSlot) {
        if slot.capacity >= SMALLEST_BLOCK {
            let first = &mut self.free[slot.capacity.ilog2() as usize];
            self.entries[slot.start as usize] = FaceId(*first);
            *first = slot.start;
        }
    }

    /// Makes room for more vertices and faces; `None` if memory is short.
    pub(crate) fn reserve(&mut self, vertices: usize, faces: usize) -> Option<()> {
        // each face is in three stars, of six faces in blocks of eight
        let entries = faces.checked_mul(4)?;
        self.slots.try_reserve(vertices).ok()?;
        self.entries.try_reserve(entries).ok()
    }

    /// Memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<StarSlot>()
            + self.entries.capacity() * size_of::<FaceId>()
    }
}

/// Size of the smallest block for `faces` faces.
#[inline]
fn block_for(faces: u32) -> u32 {
    faces.max(SMALLEST_BLOCK).next_power_of_two()
}

/// Number of faces of each vertex: the first half of the counting sort that finds the stars, in the
/// place of its result.
pub(super) struct Valences(Vec<StarSlot>);

impl Valences {
    /// No faces yet.
    pub(crate) fn new(vertices: usize) -> Self {
        Self(vec![StarSlot::default(); vertices])
    }

    /// Counts a face.
    #[inline]
    pub(crate) fn add(&mut self, corners: &[u32; 3]) {
        corners
            .iter()
            .for_each(|&v| self.0[v as usize].capacity += 1);
    }

    /// Whether each vertex has a face.
    pub(crate) fn used(&self) -> impl Iterator<Item = bool> {
        self.0.iter().map(|slot| slot.capacity > 0)
    }

    /// Removes the vertices without a face.
    pub(crate) fn retain_used(&mut self) {
        self.0.retain(|slot| slot.capacity > 0);
    }

    /// The faces around each vertex, in rising order; `faces`: the counted ones, at most
    /// [`MOST_FACES`].
    pub(crate) fn stars_of(self, faces: &[[u32; 3]]) -> Stars {
        let mut slots = self.0;
        let mut end = 0;
        for slot in &mut slots {
            slot.start = end;
            end += slot.capacity;
        }
        let mut entries = vec![FaceId(NONE); end as usize];
        for (face, corners) in faces.iter().enumerate() {
            for &vertex in corners {
                let slot = &mut slots[vertex as usize];
                entries[(slot.start + slot.len) as usize] = FaceId(face as u32);
                slot.len += 1;
            }
        }
        Stars {
            slots,
            entries,
            free: [NONE; 32],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stars of one vertex for each valence.
    fn stars(valences: &[u32]) -> Stars {
        let mut counted = Valences::new(valences.len());
        for (vertex, &valence) in valences.iter().enumerate() {
            counted.0[vertex].capacity = valence;
        }
        counted.stars_of(&[])
    }

    #[test]
    fn a_block_that_is_left_is_used_again() {
        let mut stars = stars(&[6, 0]);
        for face in 0..7 {
            stars.push(0, FaceId(face));
        }
        assert_eq!(
            (stars.entries.len(), stars.slots[0].start),
            (6 + 8, 6),
            "the seventh does not fit in six"
        );
        stars.push(1, FaceId(7));
        assert_eq!(
            (stars.entries.len(), stars.slots[1].start),
            (6 + 8, 0),
            "four of the six are used again"
        );
        (0..7).for_each(|face| stars.remove(0, FaceId(face)));
        stars.remove_vertex(0);
        (8..12).for_each(|face| stars.push(1, FaceId(face)));
        assert_eq!(
            (stars.entries.len(), stars.of(1).len()),
            (6 + 8, 5),
            "the eight are used again"
        );
    }

    #[test]
    fn a_star_that_loses_most_of_its_faces_gives_back_half() {
        let mut stars = stars(&[0]);
        (0..33).for_each(|face| stars.push(0, FaceId(face)));
        assert_eq!(stars.slots[0].capacity, 64);
        (0..17).for_each(|face| stars.remove(0, FaceId(face)));
        assert_eq!((stars.of(0).len(), stars.slots[0].capacity), (16, 64));
        stars.remove(0, FaceId(17));
        assert_eq!((stars.of(0).len(), stars.slots[0].capacity), (15, 32));
        let mut left = stars.of(0).to_vec();
        left.sort_unstable();
        assert_eq!(left, (18..33).map(FaceId).collect::<Vec<_>>());
    }

    #[test]
    fn a_face_is_known_to_fit_before_anything_changes() {
        let mut stars = stars(&[0, 4, 4]);
        (0..4).for_each(|face| stars.push(1, FaceId(face)));
        stars.push(2, FaceId(0));
        assert_eq!(
            stars.growth(&[0, 1, 2]),
            4 + 8,
            "one block of four, one of eight, and a place that is there"
        );
        assert!(stars.have_room(&[0, 1, 2]));
    }
}
