//! The ring: the faces around the moving vertices, and their connectivity. Found once, then used by
//! number.

use std::hint::select_unpredictable;
use std::ops::Range;

use super::scratch_map::ScratchMap;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// Fixed vertices around the ring, for each moving one: all around a single face.
const RIM_SHARE: usize = 4;
/// Faces around a vertex; six in a regular mesh.
const STAR_FACES: usize = 8;
/// Placeholder for no vertex.
const NONE: u32 = u32::MAX;

/// Numbers of faces and vertices are their order in `faces`, and in the scratch map of the region.
#[derive(Clone, Debug, Default)]
pub(super) struct Ring {
    /// faces with a moving vertex, then the faces that share an edge with one of these
    pub faces: Vec<FaceId>,
    /// number of moving faces
    pub moving: usize,
    /// faces that share an edge, the first one moving; repeated if they share several
    pub edges: Vec<(u32, u32)>,
    /// number of each face
    known: ScratchMap,
    /// corners of the moving faces
    corners: Vec<[u32; 3]>,
    /// faces around the moving vertices, vertex after vertex
    stars: Vec<u32>,
    /// neighbours of the moving vertices, and the start of each vertex's own
    neighbours: Vec<u32>,
    starts: Vec<usize>,
    /// for each vertex: centre of the last visit, the face there, and number of visits before
    met: Vec<(u32, u32, u32)>,
}

/// Numbers of edges and neighbours.
#[derive(Clone, Copy, Default)]
struct RingCount {
    edges: usize,
    neighbours: usize,
    /// whether an edge has more than two faces
    crowded: bool,
}

impl Ring {
    /// Makes room for moving `vertices`: two to three faces each, three edges for two faces.
    pub(crate) fn reserve(&mut self, vertices: usize) {
        let faces = 3 * vertices;
        self.faces.reserve(faces);
        self.known.reserve(faces);
        self.corners.reserve(faces);
        self.met.reserve(RIM_SHARE * vertices);
        self.starts.reserve(vertices + 1);
        self.stars.reserve(STAR_FACES * vertices);
        // as many as corners of faces, before the removal of duplicates
        self.edges.reserve(2 * STAR_FACES * vertices);
        self.neighbours.reserve(2 * STAR_FACES * vertices);
    }

    /// Faces with a moving vertex.
    pub(crate) fn moving(&self) -> &[FaceId] {
        &self.faces[..self.moving]
    }

    /// Number of a face.
    pub(crate) fn number_of(&self, face: FaceId) -> Option<u32> {
        self.known.of(face.0)
    }

    /// Neighbours of the moving vertex `vertex`.
    pub(crate) fn neighbours(&self, vertex: usize) -> &[u32] {
        &self.neighbours[self.starts[vertex]..self.starts[vertex + 1]]
    }

    /// Numbers the faces around the moving vertices.
    pub(crate) fn gather(&mut self, mesh: &TriMesh, vertices: &[VertexId]) {
        self.known.clear();
        self.faces.clear();
        self.stars.clear();
        for &face in vertices.iter().flat_map(|&vertex| mesh.star(vertex)) {
            let [number] = self.known.number([face.0]);
            self.stars.push(number);
            // no branches: the repetition of a face is unpredictable
            self.faces.push(face);
            self.faces[number as usize] = face;
            self.faces.truncate(self.known.len());
        }
        self.moving = self.faces.len();
    }

    /// Finds the connectivity for the same vertices, which have the first numbers in `scratch_map`;
    /// their neighbours get the next.
    pub(crate) fn link(
        &mut self,
        mesh: &TriMesh,
        vertices: &[VertexId],
        scratch_map: &mut ScratchMap,
    ) {
        self.corners.clear();
        self.corners.extend(
            self.faces
                .iter()
                .map(|&face| scratch_map.number(mesh.corners(face).map(|corner| corner.0))),
        );
        self.met.clear();
        self.met.resize(scratch_map.len(), (NONE, NONE, 0));
        self.edges.clear();
        self.edges.resize(2 * self.stars.len(), (NONE, NONE));
        self.neighbours.resize(2 * self.stars.len(), NONE);
        self.starts.clear();
        self.starts.push(0);
        let (mut found, mut star) = (RingCount::default(), 0);
        for (vertex, id) in (0..).zip(vertices) {
            let end = star + mesh.star(*id).len();
            found = self.go_around(vertex, star..end, found);
            self.starts.push(found.neighbours);
            star = end;
        }
        self.edges.truncate(found.edges);
        if found.crowded {
            self.link_crowded(mesh, vertices);
        }
        self.link_outside(mesh, vertices.len() as u32);
    }

    /// Finds the neighbours of a vertex, and the edges from it to later ones.
    fn go_around(&mut self, vertex: u32, star: Range<usize>, mut found: RingCount) -> RingCount {
        let (met, edges, neighbours) = (
            &mut self.met[..],
            &mut self.edges[..],
            &mut self.neighbours[..],
        );
        for &face in &self.stars[star] {
            let [a, b, c] = self.corners[face as usize];
            for corner in [
                select_unpredictable(a == vertex, b, a),
                select_unpredictable(c == vertex, b, c),
            ] {
                // no branches: the repetition of a corner is unpredictable
                let (around, other, times) = met[corner as usize];
                let is_met = around == vertex;
                met[corner as usize] = (vertex, face, (times + 1) * u32::from(is_met));
                neighbours[found.neighbours] = corner;
                found.neighbours += usize::from(!is_met);
                edges[found.edges] = (other, face);
                found.edges += usize::from(is_met & (corner > vertex));
                found.crowded |= is_met & (times > 0);
            }
        }
        found
    }

    /// Notes all pairs of faces at the edges of moving vertices, also of more than two at an edge.
    fn link_crowded(&mut self, mesh: &TriMesh, vertices: &[VertexId]) {
        self.edges.clear();
        let mut rest = &self.stars[..];
        for (vertex, id) in (0..).zip(vertices) {
            let (star, others) = rest.split_at(mesh.star(*id).len());
            rest = others;
            for (at, &face) in star.iter().enumerate() {
                let later =
                    self.corners[face as usize].map(|corner| (corner > vertex).then_some(corner));
                for &other in &star[..at] {
                    let corners = &self.corners[other as usize];
                    if later
                        .iter()
                        .flatten()
                        .any(|corner| corners.contains(corner))
                    {
                        self.edges.push((other, face));
                    }
                }
            }
        }
    }

    /// Notes the other faces at edges of moving faces without a moving end.
    fn link_outside(&mut self, mesh: &TriMesh, moving_vertices: u32) {
        for index in 0..self.moving {
            let fixed = self.corners[index].map(|corner| corner >= moving_vertices);
            let Some(side) = (0..3).find(|&side| fixed[side] & fixed[(side + 1) % 3]) else {
                continue;
            };
            let corners = mesh.corners(self.faces[index]);
            let end = corners[(side + 1) % 3];
            for &face in mesh.star(corners[side]) {
                let [a, b, c] = mesh.corners(face);
                if (a == end) | (b == end) | (c == end) {
                    self.link_pair(index as u32, face);
                }
            }
        }
    }

    fn link_pair(&mut self, index: u32, face: FaceId) {
        let [other] = self.known.number([face.0]);
        if other as usize == self.faces.len() {
            self.faces.push(face);
        }
        // both sides find a pair of moving faces
        if other > index {
            self.edges.push((index, other));
        }
    }
}
