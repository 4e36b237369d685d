//! The edges of a mesh, and consistent orientation of its faces.

use super::pieces::{FaceComponents, FaceSets};
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::numeric::distinct;

/// A face at an edge: the higher vertex of the edge (upper 32 bits) and the face, as one sort key.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct EdgeSide(u64);

impl EdgeSide {
    fn new(higher: u32, face: FaceId) -> Self {
        Self(u64::from(higher) << 32 | u64::from(face.0))
    }

    fn higher(self) -> u32 {
        (self.0 >> 32) as u32
    }

    fn face(self) -> u32 {
        self.0 as u32
    }
}

/// Edge statistics of a mesh.
pub(super) struct Edges {
    /// edges of one face: their vertices and the face
    pub boundary: Vec<([u32; 2], u32)>,
    /// faces with the same three vertices as an earlier face, in rising order
    pub duplicates: Vec<u32>,
    /// number of edges of three faces or more
    pub non_manifold: usize,
    /// the faces at these edges: index of the edge, face, and whether it runs along the edge from
    /// its lower to its higher vertex; sorted by edge
    crowded: Vec<(usize, u32, bool)>,
    pieces: FaceSets,
}

impl Edges {
    /// Visits every edge once.
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        let mut edges = Self {
            boundary: Vec::new(),
            duplicates: Vec::new(),
            non_manifold: 0,
            crowded: Vec::new(),
            pieces: FaceSets::new(mesh.face_slots()),
        };
        let mut room = [Vec::new(), Vec::new()];
        for vertex in 0..mesh.vertex_count() as u32 {
            let [mut forward, mut backward] = sides_above(mesh, vertex, &mut room);
            while let Some(higher) = lowest(forward, backward) {
                let (along, against);
                (along, forward) = split_run(forward, higher);
                (against, backward) = split_run(backward, higher);
                edges.add(mesh, [vertex, higher], along, against);
            }
        }
        edges.duplicates = distinct(edges.duplicates);
        edges
    }

    /// Adds one edge: the faces that run along it from its lower to its higher vertex, and those
    /// that run against it.
    #[inline]
    fn add(&mut self, mesh: &TriMesh, ends: [u32; 2], along: &[EdgeSide], against: &[EdgeSide]) {
        match (along, against) {
            ([one], [other]) => self.add_pair(mesh, one.face(), other.face(), false),
            ([one, other], []) | ([], [one, other]) => {
                self.add_pair(mesh, one.face(), other.face(), true)
            }
            ([one], []) | ([], [one]) => self.boundary.push((ends, one.face())),
            _ => self.add_crowd(mesh, along, against),
        }
    }

    #[inline]
    fn add_pair(&mut self, mesh: &TriMesh, one: u32, other: u32, against: bool) {
        if corner_sum(mesh, one) == corner_sum(mesh, other) {
            self.duplicates.push(one.max(other));
        }
        self.pieces.join(one, other, against);
    }

    #[cold]
    fn add_crowd(&mut self, mesh: &TriMesh, along: &[EdgeSide], against: &[EdgeSide]) {
        let mut corners: Vec<_> = along
            .iter()
            .chain(against)
            .map(|side| (corner_sum(mesh, side.face()), side.face()))
            .collect();
        corners.sort_unstable();
        self.duplicates.extend(
            corners
                .windows(2)
                .filter(|w| w[0].0 == w[1].0)
                .map(|w| w[1].1),
        );
        let edge = self.non_manifold;
        self.crowded
            .extend(along.iter().map(|side| (edge, side.face(), true)));
        self.crowded
            .extend(against.iter().map(|side| (edge, side.face(), false)));
        self.non_manifold += 1;
    }

    /// Turns faces over until neighbours agree and closed pieces have their normals outside.
    ///
    /// Faces are of one piece if they hang together over edges of two faces. A closed piece gets a
    /// positive volume; an open one keeps the side of the larger part of its area. A one-sided
    /// piece (Möbius) keeps a seam.
    ///
    /// Returns the number of faces turned over and the number of pieces.
    pub(crate) fn orient(self, mesh: &mut TriMesh) -> (usize, usize) {
        let any_against = self.pieces.any_against;
        let pieces = self.pieces.number();
        let open = open_pieces(&self.boundary, &self.crowded, &pieces);
        if !any_against && open.iter().all(|&o| o) {
            return (0, open.len());
        }
        let turned_parity = turned_parities(mesh, &pieces, &open);
        let mut flipped = 0;
        for face in 0..mesh.face_slots() as u32 {
            if pieces.parity(face) == turned_parity[pieces.piece(face)] {
                mesh.flip_face(FaceId(face));
                flipped += 1;
            }
        }
        (flipped, open.len())
    }
}

/// Pieces with a border: an edge of one face, or a crowded edge at which their own faces do not
/// cancel.
fn open_pieces(
    boundary: &[([u32; 2], u32)],
    crowded: &[(usize, u32, bool)],
    pieces: &FaceComponents,
) -> Vec<bool> {
    let mut open = vec![false; pieces.roots.len()];
    for &(_, face) in boundary {
        open[pieces.piece(face)] = true;
    }
    for edge in crowded.chunk_by(|a, b| a.0 == b.0) {
        let sign = |face, along| if along ^ pieces.parity(face) { 1 } else { -1 };
        let mut signs: Vec<(usize, i32)> = edge
            .iter()
            .map(|&(_, face, along)| (pieces.piece(face), sign(face, along)))
            .collect();
        signs.sort_unstable();
        for piece in signs.chunk_by(|a, b| a.0 == b.0) {
            open[piece[0].0] |= piece.iter().map(|s| s.1).sum::<i32>() != 0;
        }
    }
    open
}

/// Parity of the faces to turn over, for each piece.
fn turned_parities(mesh: &TriMesh, pieces: &FaceComponents, open: &[bool]) -> Vec<bool> {
    // area of parity 0 less area of parity 1, or six times the volume as parity 0 sees it
    let mut balance = vec![0.0; open.len()];
    for face in 0..mesh.face_slots() as u32 {
        let piece = pieces.piece(face);
        let double_area_normal = mesh.double_area_normal(FaceId(face));
        let part = if open[piece] {
            double_area_normal.norm()
        } else {
            let anchor = mesh.triangle(FaceId(pieces.roots[piece]))[0];
            double_area_normal.dot(&(mesh.triangle(FaceId(face))[0] - anchor))
        };
        balance[piece] += if pieces.parity(face) { -part } else { part };
    }
    balance.into_iter().map(|b| b >= 0.0).collect()
}

/// The sides of all edges from `vertex` to a higher vertex, ordered by that vertex, then by face:
/// first the faces that run along the edge upwards, then the others.
#[inline]
fn sides_above<'a>(
    mesh: &TriMesh,
    vertex: u32,
    room: &'a mut [Vec<EdgeSide>; 2],
) -> [&'a [EdgeSide]; 2] {
    let star = mesh.star(VertexId(vertex));
    let [forward, backward] = room.each_mut().map(|sides| {
        if sides.len() < star.len() {
            sides.resize(star.len(), EdgeSide::default());
        }
        &mut sides[..star.len()]
    });
    let (mut ahead, mut behind) = (0, 0);
    for &face in star {
        let [VertexId(next), VertexId(previous)] = mesh.other_corners(face, VertexId(vertex));
        // written first and counted afterwards: their order is unpredictable, so no branch depends
        // on it
        forward[ahead] = EdgeSide::new(next, face);
        ahead += usize::from(next > vertex);
        backward[behind] = EdgeSide::new(previous, face);
        behind += usize::from(previous > vertex);
    }
    [(forward, ahead), (backward, behind)].map(|(sides, len)| {
        let sides = &mut sides[..len];
        sides.sort_unstable();
        &*sides
    })
}

/// Distinguishes the third corners of faces at the same edge.
#[inline]
fn corner_sum(mesh: &TriMesh, face: u32) -> u32 {
    let [a, b, c] = mesh.corners(FaceId(face)).map(|v| v.0);
    a ^ b ^ c
}

/// The lowest of the higher vertices of these sides.
#[inline]
fn lowest(forward: &[EdgeSide], backward: &[EdgeSide]) -> Option<u32> {
    match (forward, backward) {
        ([a, ..], [b, ..]) => Some(a.higher().min(b.higher())),
        ([a, ..], []) | ([], [a, ..]) => Some(a.higher()),
        ([], []) => None,
    }
}

/// The sides at the edge to `higher`, and the rest.
#[inline]
fn split_run(sides: &[EdgeSide], higher: u32) -> (&[EdgeSide], &[EdgeSide]) {
    sides.split_at(
        sides
            .iter()
            .take_while(|side| side.higher() == higher)
            .count(),
    )
}

/// Number of chains of boundary edges: one for each hole or outer rim; rims that touch in a vertex
/// count as one.
pub(super) fn boundary_loops(boundary: &[([u32; 2], u32)]) -> usize {
    let vertices = distinct(boundary.iter().flat_map(|(ends, _)| *ends));
    let index = |v: u32| vertices.partition_point(|&w| w < v) as u32;
    let mut chains = FaceSets::new(vertices.len());
    for (ends, _) in boundary {
        chains.join(index(ends[0]), index(ends[1]), false);
    }
    chains.number().roots.len()
}
