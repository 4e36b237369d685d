//! The edges of a mesh, and faces that agree on which side is outside.

use crate::mesh::{FaceId, TriMesh, VertexId};

/// A face at an edge, and whether it runs along the edge from its lower to its higher vertex.
#[derive(Clone, Copy)]
struct Side {
    face: u32,
    forward: bool,
}

/// What the edges of a mesh show.
pub(super) struct Edges {
    /// edges of one face: their vertices and that face
    pub boundary: Vec<([u32; 2], u32)>,
    /// faces whose three vertices an earlier face has as well, in rising order
    pub duplicates: Vec<u32>,
    /// number of edges of three faces or more
    pub non_manifold: usize,
    /// the faces at these, one run after the other; every run starts where the first field changes
    crowded: Vec<(usize, Side)>,
    pieces: Pieces,
}

impl Edges {
    /// Looks at every edge once.
    pub fn of(mesh: &TriMesh) -> Self {
        let mut edges = Self {
            boundary: Vec::new(),
            duplicates: Vec::new(),
            non_manifold: 0,
            crowded: Vec::new(),
            pieces: Pieces::new(mesh.face_slots()),
        };
        let mut sides = Vec::new();
        for vertex in 0..mesh.vertex_count() as u32 {
            sides_above(mesh, vertex, &mut sides);
            for edge in sides.chunk_by(|a, b| a >> 32 == b >> 32) {
                edges.add(mesh, [vertex, (edge[0] >> 32) as u32], edge);
            }
        }
        edges.duplicates.sort_unstable();
        edges.duplicates.dedup();
        edges
    }

    fn add(&mut self, mesh: &TriMesh, ends: [u32; 2], edge: &[u64]) {
        match *edge {
            [one] => self.boundary.push((ends, unpack(one).face)),
            [one, other] => {
                let (one, other) = (unpack(one), unpack(other));
                if apex(mesh, one.face, ends) == apex(mesh, other.face, ends) {
                    self.duplicates.push(other.face);
                }
                self.pieces.join(one.face, other.face, one.forward == other.forward);
            }
            _ => {
                let mut apexes: Vec<_> =
                    edge.iter().map(|&s| (apex(mesh, unpack(s).face, ends), unpack(s).face)).collect();
                apexes.sort_unstable();
                self.duplicates.extend(apexes.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1));
                self.crowded.extend(edge.iter().map(|&side| (self.non_manifold, unpack(side))));
                self.non_manifold += 1;
            }
        }
    }

    /// Turns faces over until neighbours agree and closed pieces have their normals outside.
    ///
    /// A piece is what hangs together over edges of two faces. A closed piece gets a positive volume; an open one keeps
    /// the side that the larger part of its area has. A one-sided piece (Möbius) keeps a seam.
    ///
    /// Returns the number of faces turned over and the number of pieces.
    pub fn orient(mut self, mesh: &mut TriMesh) -> (usize, usize) {
        let (piece_of, pieces) = self.pieces.number();
        let open = self.open_pieces(&piece_of, pieces);
        if !self.pieces.any_against && open.iter().all(|&o| o) {
            return (0, pieces);
        }
        let turned_parity = self.turned_parities(mesh, &piece_of, &open);
        let mut flipped = 0;
        for face in 0..mesh.face_slots() as u32 {
            if self.pieces.parity(face) == turned_parity[piece_of[face as usize] as usize] {
                mesh.flip_face(FaceId(face));
                flipped += 1;
            }
        }
        (flipped, pieces)
    }

    /// Which pieces have a border: an edge of one face, or a crowded edge at which their own faces do not cancel.
    fn open_pieces(&mut self, piece_of: &[u32], pieces: usize) -> Vec<bool> {
        let mut open = vec![false; pieces];
        for &(_, face) in &self.boundary {
            open[piece_of[face as usize] as usize] = true;
        }
        let pieces = &mut self.pieces;
        for edge in self.crowded.chunk_by(|a, b| a.0 == b.0) {
            let mut signs: Vec<(u32, i32)> = edge
                .iter()
                .map(|(_, s)| (piece_of[s.face as usize], if s.forward ^ pieces.parity(s.face) { 1 } else { -1 }))
                .collect();
            signs.sort_unstable();
            for piece in signs.chunk_by(|a, b| a.0 == b.0) {
                open[piece[0].0 as usize] |= piece.iter().map(|s| s.1).sum::<i32>() != 0;
            }
        }
        open
    }

    /// For each piece the parity of the faces to turn over.
    fn turned_parities(&mut self, mesh: &TriMesh, piece_of: &[u32], open: &[bool]) -> Vec<bool> {
        // area of parity 0 less area of parity 1, or six times the volume as parity 0 sees it
        let mut balance = vec![0.0; open.len()];
        for face in 0..mesh.face_slots() as u32 {
            let piece = piece_of[face as usize] as usize;
            let double_area_normal = mesh.double_area_normal(FaceId(face));
            let part = if open[piece] {
                double_area_normal.norm()
            } else {
                let anchor = mesh.triangle(FaceId(self.pieces.root(piece)))[0];
                double_area_normal.dot(&(mesh.triangle(FaceId(face))[0] - anchor))
            };
            balance[piece] += if self.pieces.parity(face) { -part } else { part };
        }
        balance.into_iter().map(|b| b >= 0.0).collect()
    }
}

/// The sides of all edges from `vertex` to a higher vertex, ordered by that vertex, then by face.
fn sides_above(mesh: &TriMesh, vertex: u32, sides: &mut Vec<u64>) {
    sides.clear();
    for &face in mesh.star(VertexId(vertex)) {
        let [a, b, c] = mesh.corners(face).map(|v| v.0);
        let (next, previous) = if a == vertex {
            (b, c)
        } else if b == vertex {
            (c, a)
        } else {
            (a, b)
        };
        if next > vertex {
            sides.push(pack(next, Side { face: face.0, forward: true }));
        }
        if previous > vertex {
            sides.push(pack(previous, Side { face: face.0, forward: false }));
        }
    }
    sides.sort_unstable();
}

/// Higher vertex of the edge (32 bits), face (31 bits), direction (1 bit): one key to sort by.
fn pack(higher: u32, side: Side) -> u64 {
    u64::from(higher) << 32 | u64::from(side.face) << 1 | u64::from(side.forward)
}

fn unpack(key: u64) -> Side {
    Side { face: key as u32 >> 1, forward: key & 1 == 1 }
}

/// The corner of a face that is not on this edge.
fn apex(mesh: &TriMesh, face: u32, [a, b]: [u32; 2]) -> u32 {
    let [p, q, r] = mesh.corners(FaceId(face)).map(|v| v.0);
    p ^ q ^ r ^ a ^ b
}

/// Disjoint sets of faces; each face knows whether it lies as the root of its set does (parity false) or upside down.
struct Pieces {
    /// parent (31 bits) and parity against it (1 bit)
    parents: Vec<u32>,
    roots: Vec<u32>,
    /// whether any two neighbours disagreed
    any_against: bool,
}

impl Pieces {
    fn new(faces: usize) -> Self {
        Self { parents: (0..faces as u32).map(|f| f << 1).collect(), roots: Vec::new(), any_against: false }
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

    fn parity(&mut self, face: u32) -> bool {
        self.find(face).1 == 1
    }

    /// Joins the sets of two neighbours; `against`: one of them is upside down. The lowest face is the root.
    #[inline]
    fn join(&mut self, a: u32, b: u32, against: bool) {
        self.any_against |= against;
        let ((root_a, parity_a), (root_b, parity_b)) = (self.find(a), self.find(b));
        if root_a != root_b {
            let parity = parity_a ^ parity_b ^ u32::from(against);
            self.parents[root_a.max(root_b) as usize] = root_a.min(root_b) << 1 | parity;
        }
    }

    /// Numbers the sets in the order of their lowest faces: number for each face, and how many there are.
    fn number(&mut self) -> (Vec<u32>, usize) {
        let mut piece_of = vec![0; self.parents.len()];
        for face in 0..self.parents.len() as u32 {
            let (root, _) = self.find(face);
            if root == face {
                piece_of[face as usize] = self.roots.len() as u32;
                self.roots.push(face);
            } else {
                piece_of[face as usize] = piece_of[root as usize];
            }
        }
        (piece_of, self.roots.len())
    }

    fn root(&self, piece: usize) -> u32 {
        self.roots[piece]
    }
}

/// How many chains the boundary edges form: one for each hole or outer rim; rims that touch in a vertex count as one.
pub(super) fn boundary_loops(boundary: &[([u32; 2], u32)]) -> usize {
    let mut vertices: Vec<u32> = boundary.iter().flat_map(|(ends, _)| *ends).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let index = |v: u32| vertices.partition_point(|&w| w < v) as u32;
    let mut chains = Pieces::new(vertices.len());
    for (ends, _) in boundary {
        chains.join(index(ends[0]), index(ends[1]), false);
    }
    chains.number().1
}
