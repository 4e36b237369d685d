//! The triangle mesh and its adjacency, in compact arrays that allow local change.

use nalgebra::{Point3, Vector3};

use super::journal::{Changes, Journal};
use super::stars::{MOST_FACES, Stars, Valences};
use super::{FaceId, VertexId};
use crate::numeric::direction;

/// Sample size in faces for the mean edge.
const EDGE_SAMPLE: usize = 20_000;
/// Marks the slot of a removed face; no id.
const REMOVED: u32 = u32::MAX;
/// Largest coordinate of a place, m; larger ones are faults. Products of six such lengths are still
/// far from overflow.
pub const FARTHEST: f64 = 1e9;
/// Maximum number of vertices that ids can name.
const MOST_VERTICES: usize = REMOVED as usize - 1;

/// Faults that make a triangle soup unusable as a [`TriMesh`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No usable face.
    #[error("the mesh has no face of non-zero area")]
    Empty,
    /// A part that no longer fits into the rest it was cut from.
    #[error(
        "what was touched reaches the rim of the part that may be: make scan.region_low_mm and scan.region_high_mm wider, \
         and refine the recording again"
    )]
    TornRim,
    /// An index beyond the vertices.
    #[error("face {face} uses vertex {vertex}, but there are only {vertices} vertices")]
    VertexOutOfRange {
        /// index of the face, from 0
        face: usize,
        /// its index
        vertex: u32,
        /// number of vertices
        vertices: usize,
    },
    /// A face that names a removed vertex.
    #[error("face {face} uses vertex {vertex}, which was removed")]
    RemovedVertex {
        /// index of the face, from 0
        face: usize,
        /// the removed vertex
        vertex: u32,
    },
    /// A face that names a vertex twice.
    #[error("face {face} uses vertex {vertex} twice")]
    RepeatedVertex {
        /// index of the face, from 0
        face: usize,
        /// the repeated vertex
        vertex: u32,
    },
    /// NaN, infinite or implausibly large coordinate.
    #[error("vertex {vertex} has a coordinate that is not a number within {FARTHEST:e} m")]
    NotFinite {
        /// index of the vertex, from 0
        vertex: usize,
    },
    /// More faces or vertices than 32-bit ids can name or memory can hold.
    #[error(
        "{count} {what} are more than 32-bit numbers can count or memory can hold: reduce the mesh first"
    )]
    TooMany {
        /// "faces" or "vertices"
        what: &'static str,
        /// their number
        count: usize,
    },
}

/// A triangle mesh with vertices in the object frame O.
///
/// `positions`: V × 3, m, in O; `faces`: F × 3, counter-clockwise seen from outside.
///
/// Invariants: every coordinate is within [`FARTHEST`]; every index is in range; no face uses a
/// vertex twice. Faces may have any shape, and any number of faces may share an edge, as in scans:
/// [`crate::mesh::RepairReport`] counts such faults, this type allows them.
#[derive(Clone, Debug)]
pub struct TriMesh {
    positions: Vec<Point3<f64>>,
    faces: Vec<[u32; 3]>,
    stars: Stars,
    free_faces: Vec<FaceId>,
    free_vertices: Vec<VertexId>,
    /// changes since the last [`Self::take_changes`], after a call of [`Self::watch`]
    journal: Option<Box<Journal>>,
}

impl TriMesh {
    /// Builds the adjacency after checking the arrays.
    ///
    /// # Errors
    /// Every breach of the invariants above; repairs nothing.
    pub fn new(positions: Vec<Point3<f64>>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        for (what, count, limit) in [
            ("vertices", positions.len(), MOST_VERTICES),
            ("faces", faces.len(), MOST_FACES),
        ] {
            if count > limit {
                return Err(MeshError::TooMany { what, count });
            }
        }
        if let Some(vertex) = positions.iter().position(|p| !is_place(p)) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (face, corners) in faces.iter().enumerate() {
            check_corners(corners, face, positions.len())?;
        }
        let mut valences = Valences::new(positions.len());
        faces.iter().for_each(|corners| valences.add(corners));
        Ok(Self::of_sound(positions, faces, valences))
    }

    /// Builds the adjacency of arrays that keep the invariants above, with their faces counted.
    pub(super) fn of_sound(
        positions: Vec<Point3<f64>>,
        faces: Vec<[u32; 3]>,
        valences: Valences,
    ) -> Self {
        debug_assert!(
            faces
                .iter()
                .all(|corners| check_corners(corners, 0, positions.len()).is_ok())
        );
        let stars = valences.stars_of(&faces);
        Self {
            positions,
            faces,
            stars,
            free_faces: Vec::new(),
            free_vertices: Vec::new(),
            journal: None,
        }
    }

    /// Number of vertices without the removed ones.
    pub fn vertex_count(&self) -> usize {
        self.positions.len() - self.free_vertices.len()
    }

    /// One more than the largest vertex id ever given out: the size of an array indexed by
    /// [`VertexId`].
    pub fn vertex_slots(&self) -> usize {
        self.positions.len()
    }

    /// Number of faces without the removed ones.
    pub fn face_count(&self) -> usize {
        self.faces.len() - self.free_faces.len()
    }

    /// One more than the largest face id ever given out: the size of an array indexed by
    /// [`FaceId`].
    pub fn face_slots(&self) -> usize {
        self.faces.len()
    }

    /// All positions, m, in O, indexed by [`VertexId`]; a removed vertex keeps its last one.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// The lowest and the highest corner of the box around all vertices, m, in O; inverted without
    /// vertices.
    pub fn bounds(&self) -> [Point3<f64>; 2] {
        let empty = [f64::INFINITY, f64::NEG_INFINITY].map(|x| Point3::new(x, x, x));
        self.positions
            .iter()
            .fold(empty, |[lo, hi], p| [lo.inf(p), hi.sup(p)])
    }

    /// All faces except removed ones with their ids, in order of id.
    pub fn faces(&self) -> impl Iterator<Item = (FaceId, [VertexId; 3])> + '_ {
        let there = self
            .faces
            .iter()
            .enumerate()
            .filter(|(_, corners)| corners[0] != REMOVED);
        there.map(|(face, corners)| (FaceId(face as u32), corners.map(VertexId)))
    }

    /// Whether `vertex` names an existing vertex.
    pub fn has_vertex(&self, vertex: VertexId) -> bool {
        self.stars.has(vertex.0)
    }

    /// Whether `face` names an existing face.
    pub fn has_face(&self, face: FaceId) -> bool {
        self.faces
            .get(face.0 as usize)
            .is_some_and(|corners| corners[0] != REMOVED)
    }

    /// The corners of a face, counter-clockwise seen from outside.
    #[inline]
    pub fn corners(&self, face: FaceId) -> [VertexId; 3] {
        self.faces[face.0 as usize].map(VertexId)
    }

    /// The two corners of a face that follow `vertex`, in the order of [`Self::corners`].
    #[inline]
    pub fn other_corners(&self, face: FaceId, vertex: VertexId) -> [VertexId; 2] {
        let [a, b, c] = self.corners(face);
        // separate choices, which need no branch
        let (at_a, at_b) = (vertex == a, vertex == b);
        let next = if at_a {
            b
        } else if at_b {
            c
        } else {
            a
        };
        let last = if at_a {
            c
        } else if at_b {
            a
        } else {
            b
        };
        [next, last]
    }

    /// Position of a vertex, m, in O.
    #[inline]
    pub fn position(&self, vertex: VertexId) -> Point3<f64> {
        self.positions[vertex.0 as usize]
    }

    /// The corners of a face as points, m, in O.
    #[inline]
    pub fn triangle(&self, face: FaceId) -> [Point3<f64>; 3] {
        self.faces[face.0 as usize].map(|v| self.positions[v as usize])
    }

    /// Twice the area of a face times its outward normal, m².
    #[inline]
    pub fn double_area_normal(&self, face: FaceId) -> Vector3<f64> {
        let [a, b, c] = self.triangle(face);
        (b - a).cross(&(c - a))
    }

    /// Outward unit normal of a face; zero if the face has no area.
    #[inline]
    pub fn normal(&self, face: FaceId) -> Vector3<f64> {
        direction(&self.double_area_normal(face)).unwrap_or_else(Vector3::zeros)
    }

    /// Barycentre of a face, m, in O.
    #[inline]
    pub fn barycentre(&self, face: FaceId) -> Point3<f64> {
        let [a, b, c] = self.triangle(face);
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    }

    /// The faces around a vertex, in no particular order.
    #[inline]
    pub fn star(&self, vertex: VertexId) -> &[FaceId] {
        self.stars.of(vertex.0)
    }

    /// The faces that share the edge from `a` to `b` (either direction), in no particular order.
    pub fn faces_at_edge(&self, a: VertexId, b: VertexId) -> impl Iterator<Item = FaceId> + '_ {
        self.star(a)
            .iter()
            .copied()
            .filter(move |&f| self.corners(f).contains(&b))
    }

    /// Whether no edge belongs to a single face. O(F).
    pub fn is_closed(&self) -> bool {
        let is_rim = |a, b| self.faces_at_edge(a, b).nth(1).is_none();
        self.faces()
            .all(|(_, [a, b, c])| !is_rim(a, b) && !is_rim(b, c) && !is_rim(c, a))
    }

    /// Moves one vertex; refit any index over the faces afterwards
    /// ([`crate::mesh::FaceTree::refit`]).
    #[inline]
    pub fn set_position(&mut self, vertex: VertexId, position: Point3<f64>) {
        debug_assert!(is_place(&position));
        self.positions[vertex.0 as usize] = position;
        self.note_vertex(vertex.0);
    }

    /// Starts to record changes for [`Self::take_changes`].
    pub fn watch(&mut self) {
        self.journal = Some(Box::new(Journal::new(
            self.vertex_slots(),
            self.face_slots(),
        )));
    }

    /// Adds the changes since the last call, up to `most` vertices and up to `most` faces, to
    /// `into`; returns whether none remain. Nothing before [`Self::watch`].
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> bool {
        self.journal
            .as_mut()
            .is_none_or(|journal| journal.take(most, into))
    }

    /// Mean edge length, m, of up to 20,000 faces spread over the mesh; 0 without faces.
    pub fn mean_edge(&self) -> f64 {
        let step = (self.face_count() / EDGE_SAMPLE).max(1);
        let (mut sum, mut count) = (0.0, 0.0);
        for (face, _) in self.faces().step_by(step) {
            let [a, b, c] = self.triangle(face);
            sum += (b - a).norm() + (c - b).norm() + (a - c).norm();
            count += 3.0;
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }

    /// Number of edits since [`Self::watch`].
    pub fn edits(&self) -> u64 {
        self.journal.as_ref().map_or(0, |journal| journal.edits())
    }

    #[inline]
    fn note_vertex(&mut self, vertex: u32) {
        if let Some(journal) = &mut self.journal {
            journal.note_vertex(vertex);
        }
    }

    #[inline]
    fn note_face(&mut self, face: FaceId) {
        if let Some(journal) = &mut self.journal {
            journal.note_face(face.0);
        }
    }

    /// Makes room for more vertices and faces: adding them in the shape of a regular mesh then
    /// allocates nothing.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] if memory is short.
    pub fn reserve(&mut self, vertices: usize, faces: usize) -> Result<(), MeshError> {
        let short = |what, count| MeshError::TooMany { what, count };
        self.positions
            .try_reserve(vertices)
            .map_err(|_| short("vertices", vertices))?;
        self.faces
            .try_reserve(faces)
            .map_err(|_| short("faces", faces))?;
        self.stars
            .reserve(vertices, faces)
            .ok_or(short("faces", faces))
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let ids = self.free_faces.capacity() + self.free_vertices.capacity();
        self.positions.capacity() * size_of::<Point3<f64>>()
            + self.faces.capacity() * size_of::<[u32; 3]>()
            + ids * size_of::<u32>()
            + self.stars.bytes()
            + self.journal.as_ref().map_or(0, |journal| journal.bytes())
    }

    /// Adds a vertex without faces; reuses the slot of a removed vertex first.
    ///
    /// # Errors
    /// [`MeshError::NotFinite`], [`MeshError::TooMany`].
    pub fn add_vertex(&mut self, position: Point3<f64>) -> Result<VertexId, MeshError> {
        let next = self.positions.len();
        let vertex = self
            .free_vertices
            .last()
            .map_or(next, |vertex| vertex.0 as usize);
        if !is_place(&position) {
            return Err(MeshError::NotFinite { vertex });
        }
        if vertex >= MOST_VERTICES {
            return Err(MeshError::TooMany {
                what: "vertices",
                count: vertex + 1,
            });
        }
        match self.free_vertices.pop() {
            Some(_) => self.positions[vertex] = position,
            None => self.positions.push(position),
        }
        self.stars.add_vertex(vertex as u32);
        self.note_vertex(vertex as u32);
        Ok(VertexId(vertex as u32))
    }

    /// Removes a vertex that no face uses; the ids of the others stay. Returns whether there was
    /// such a vertex.
    pub fn remove_vertex(&mut self, vertex: VertexId) -> bool {
        if !self.has_vertex(vertex) || !self.star(vertex).is_empty() {
            return false;
        }
        self.stars.remove_vertex(vertex.0);
        self.free_vertices.push(vertex);
        self.note_vertex(vertex.0);
        true
    }

    /// Adds a face, counter-clockwise seen from outside; reuses the slot of a removed face first.
    ///
    /// # Errors
    /// [`MeshError::VertexOutOfRange`], [`MeshError::RemovedVertex`],
    /// [`MeshError::RepeatedVertex`], [`MeshError::TooMany`].
    pub fn add_face(&mut self, corners: [VertexId; 3]) -> Result<FaceId, MeshError> {
        let corners = corners.map(|v| v.0);
        let next = self.faces.len();
        let face = self.free_faces.last().map_or(next, |face| face.0 as usize);
        check_corners(&corners, face, self.positions.len())?;
        if let Some(&vertex) = corners.iter().find(|&&v| !self.stars.has(v)) {
            return Err(MeshError::RemovedVertex { face, vertex });
        }
        if face >= MOST_FACES || !self.stars.have_room(&corners) {
            return Err(MeshError::TooMany {
                what: "faces",
                count: self.face_count() + 1,
            });
        }
        match self.free_faces.pop() {
            Some(_) => self.faces[face] = corners,
            None => self.faces.push(corners),
        }
        let face = FaceId(face as u32);
        corners
            .into_iter()
            .for_each(|vertex| self.stars.push(vertex, face));
        self.note_face(face);
        Ok(face)
    }

    /// Removes a face; its vertices stay. Returns whether there was such a face.
    ///
    /// Remove it from any index over the faces first ([`crate::mesh::FaceTree::remove`]).
    pub fn remove_face(&mut self, face: FaceId) -> bool {
        if !self.has_face(face) {
            return false;
        }
        let corners = std::mem::replace(&mut self.faces[face.0 as usize], [REMOVED; 3]);
        corners
            .into_iter()
            .for_each(|vertex| self.stars.remove(vertex, face));
        self.free_faces.push(face);
        self.note_face(face);
        true
    }

    /// Turns a face over: its normal changes sign; its id and its neighbours stay.
    pub fn flip_face(&mut self, face: FaceId) {
        self.faces[face.0 as usize].swap(1, 2);
        self.note_face(face);
    }
}

/// Whether all coordinates are within [`FARTHEST`]; false for NaN.
#[inline]
pub fn is_place(p: &Point3<f64>) -> bool {
    p.coords.iter().all(|x| x.abs() <= FARTHEST)
}

fn check_corners(corners: &[u32; 3], face: usize, vertices: usize) -> Result<(), MeshError> {
    if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
        return Err(MeshError::VertexOutOfRange {
            face,
            vertex,
            vertices,
        });
    }
    let [a, b, c] = *corners;
    if a == b || b == c || c == a {
        return Err(MeshError::RepeatedVertex {
            face,
            vertex: if b == c { b } else { a },
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share the edge 1–2.
    fn quad() -> TriMesh {
        let positions = vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(1.0, 1.0, 0.0),
        ];
        TriMesh::new(positions, vec![[0, 1, 2], [1, 3, 2]]).unwrap()
    }

    #[test]
    fn stars_follow_removed_and_added_faces() {
        let mut mesh = quad();
        assert_eq!(mesh.star(VertexId(1)), [FaceId(0), FaceId(1)]);
        assert!(mesh.remove_face(FaceId(0)));
        assert!(!mesh.remove_face(FaceId(0)));
        assert_eq!(
            (
                mesh.face_count(),
                mesh.star(VertexId(0)).len(),
                mesh.star(VertexId(1)).len()
            ),
            (1, 0, 1)
        );
        let centre = mesh.add_vertex(Point3::new(0.2, 0.2, 0.0)).unwrap();
        let added: Vec<_> = [[0, 1], [1, 2], [2, 0]]
            .map(|[a, b]| mesh.add_face([VertexId(a), VertexId(b), centre]).unwrap())
            .into();
        assert_eq!(
            added,
            [FaceId(0), FaceId(2), FaceId(3)],
            "a freed slot is used first"
        );
        assert_eq!(mesh.star(centre).len(), 3);
        assert_eq!(mesh.faces_at_edge(VertexId(2), VertexId(1)).count(), 2);
        assert_eq!(mesh.faces().count(), 4);
    }

    #[test]
    fn breaches_of_the_invariants_are_refused() {
        let p = vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
        ];
        assert_eq!(
            TriMesh::new(p.clone(), vec![[0, 1, 3]]).unwrap_err(),
            MeshError::VertexOutOfRange {
                face: 0,
                vertex: 3,
                vertices: 3
            }
        );
        assert_eq!(
            TriMesh::new(p.clone(), vec![[0, 1, 1]]).unwrap_err(),
            MeshError::RepeatedVertex { face: 0, vertex: 1 }
        );
        let mut bad = p;
        bad[2].y = f64::NAN;
        assert_eq!(
            TriMesh::new(bad, vec![[0, 1, 2]]).unwrap_err(),
            MeshError::NotFinite { vertex: 2 }
        );
    }

    #[test]
    fn a_vertex_goes_only_when_no_face_uses_it() {
        let mut mesh = quad();
        assert!(!mesh.remove_vertex(VertexId(3)), "in use");
        assert!(mesh.remove_face(FaceId(1)));
        assert!(mesh.remove_vertex(VertexId(3)));
        assert!(
            !mesh.remove_vertex(VertexId(3)) && !mesh.has_vertex(VertexId(3)),
            "gone"
        );
        assert!(!mesh.remove_vertex(VertexId(4)), "never there");
        assert_eq!(
            (
                mesh.vertex_count(),
                mesh.vertex_slots(),
                mesh.star(VertexId(3)).len()
            ),
            (3, 4, 0)
        );
        let corners = [1, 3, 2].map(VertexId);
        assert_eq!(
            mesh.add_face(corners),
            Err(MeshError::RemovedVertex { face: 1, vertex: 3 })
        );
        assert_eq!(
            mesh.add_vertex(Point3::new(2.0, 2.0, 0.0)),
            Ok(VertexId(3)),
            "a freed slot is used first"
        );
        assert_eq!(mesh.add_face(corners), Ok(FaceId(1)));
        assert_eq!(
            (mesh.position(VertexId(3)).x, mesh.star(VertexId(3))),
            (2.0, &[FaceId(1)][..])
        );
    }
}
