//! Connected components of faces, and the orientation of each face against the others.

/// Disjoint sets of faces; each face stores its orientation: as the root of its set (parity false)
/// or upside down.
pub(super) struct FaceSets {
    /// parent (31 bits) and parity against it (1 bit)
    parents: Vec<u32>,
    /// whether any two neighbours disagreed
    pub any_against: bool,
}

impl FaceSets {
    /// Each face in a set of its own.
    pub(crate) fn new(faces: usize) -> Self {
        Self {
            parents: (0..faces as u32).map(|f| f << 1).collect(),
            any_against: false,
        }
    }

    /// Root of the set and parity against it; shortens the path on the way.
    #[inline]
    fn find(&mut self, mut face: u32) -> (u32, u32) {
        let mut parity = 0;
        loop {
            let up = self.parents[face as usize];
            if up >> 1 == face {
                return (face, parity);
            }
            let further = self.parents[(up >> 1) as usize] ^ (up & 1);
            self.parents[face as usize] = further;
            parity ^= further & 1;
            face = further >> 1;
        }
    }

    /// Joins the sets of two neighbours; `against`: one of the two is upside down. The lowest face
    /// becomes the root.
    #[inline]
    pub(crate) fn join(&mut self, a: u32, b: u32, against: bool) {
        self.any_against |= against;
        // most share a parent already
        if self.parents[a as usize] != self.parents[b as usize] ^ u32::from(against) {
            self.join_roots(a, b, against);
        }
    }

    /// Joins the sets by their roots.
    fn join_roots(&mut self, a: u32, b: u32, against: bool) {
        let ((root_a, parity_a), (root_b, parity_b)) = (self.find(a), self.find(b));
        if root_a != root_b {
            let parity = parity_a ^ parity_b ^ u32::from(against);
            self.parents[root_a.max(root_b) as usize] = root_a.min(root_b) << 1 | parity;
        }
    }

    /// Numbers the sets in the order of their lowest faces.
    pub(crate) fn number(self) -> FaceComponents {
        let (mut pieces, mut roots) = (self.parents, Vec::new());
        for face in 0..pieces.len() {
            let up = pieces[face];
            // a parent is lower than its children, and has its number already
            pieces[face] = if up as usize >> 1 == face {
                roots.push(face as u32);
                (roots.len() as u32 - 1) << 1
            } else {
                pieces[up as usize >> 1] ^ (up & 1)
            };
        }
        FaceComponents { pieces, roots }
    }
}

/// Connected components of faces, numbered.
pub(super) struct FaceComponents {
    /// number (31 bits) and parity against its root (1 bit) for each face
    pieces: Vec<u32>,
    /// the lowest face of each set
    pub roots: Vec<u32>,
}

impl FaceComponents {
    /// Number of the set of a face.
    #[inline]
    pub(crate) fn piece(&self, face: u32) -> usize {
        (self.pieces[face as usize] >> 1) as usize
    }

    /// Whether a face lies upside down against the root of its set.
    #[inline]
    pub(crate) fn parity(&self, face: u32) -> bool {
        self.pieces[face as usize] & 1 == 1
    }
}
