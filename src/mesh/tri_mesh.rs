//! The triangle mesh and its adjacency, in compact arrays that allow local change.

use nalgebra::{Point3, Vector3};

/// A face of one [`TriMesh`]; stays valid until that face is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FaceId(pub u32);

/// A vertex of one [`TriMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

/// Marks the slot of a removed face.
const REMOVED: u32 = u32::MAX;

/// What makes a triangle soup unusable as a [`TriMesh`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No face is left to touch.
    #[error("the mesh has no face of non-zero area")]
    Empty,
    /// An index beyond the vertices.
    #[error("face {face} uses vertex {vertex}, but there are only {vertices} vertices")]
    VertexOutOfRange {
        /// which face, counted from 0
        face: usize,
        /// the index found
        vertex: u32,
        /// how many vertices there are
        vertices: usize,
    },
    /// A face that names a vertex twice.
    #[error("face {face} uses vertex {vertex} twice")]
    RepeatedVertex {
        /// which face, counted from 0
        face: usize,
        /// the index found twice
        vertex: u32,
    },
    /// NaN or infinite coordinate.
    #[error("vertex {vertex} has a coordinate that is not finite")]
    NotFinite {
        /// which vertex, counted from 0
        vertex: usize,
    },
    /// More faces or vertices than 32-bit ids can name.
    #[error("{count} {what} are more than 32-bit numbers can count: reduce the mesh first")]
    TooMany {
        /// "faces" or "vertices"
        what: &'static str,
        /// how many
        count: usize,
    },
}

/// Where the faces around one vertex stand in [`TriMesh::star_entries`].
#[derive(Clone, Copy, Debug, Default)]
struct StarSlot {
    start: u32,
    len: u32,
    capacity: u32,
}

/// A triangle mesh whose vertices are expressed in the object frame O.
///
/// `positions`: V × 3, m, in O; `faces`: F × 3, counter-clockwise seen from outside.
///
/// Invariants: every position is finite; every index is in range; no face uses a vertex twice. Faces may have any
/// shape, edges may be shared by any number of faces (scans are like that): what a scan lacks is in
/// [`crate::mesh::RepairReport`], not refused here.
#[derive(Clone, Debug)]
pub struct TriMesh {
    positions: Vec<Point3<f64>>,
    faces: Vec<[u32; 3]>,
    star_slots: Vec<StarSlot>,
    star_entries: Vec<FaceId>,
    free_faces: Vec<FaceId>,
}

impl TriMesh {
    /// Builds the adjacency of checked arrays.
    ///
    /// # Errors
    /// Every breach of the invariants above; nothing is repaired here.
    pub fn new(positions: Vec<Point3<f64>>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        for (what, count) in [("vertices", positions.len()), ("faces", faces.len())] {
            if count >= REMOVED as usize {
                return Err(MeshError::TooMany { what, count });
            }
        }
        if let Some(vertex) = positions.iter().position(|p| !p.coords.iter().all(|x| x.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (face, corners) in faces.iter().enumerate() {
            check_corners(corners, face, positions.len())?;
        }
        let mut valences = Valences::new(positions.len());
        faces.iter().for_each(|corners| valences.add(corners));
        Ok(Self::of_sound(positions, faces, valences))
    }

    /// Builds the adjacency of arrays that keep the invariants above, and whose faces have been counted.
    pub(super) fn of_sound(positions: Vec<Point3<f64>>, faces: Vec<[u32; 3]>, valences: Valences) -> Self {
        debug_assert!(faces.iter().all(|corners| check_corners(corners, 0, positions.len()).is_ok()));
        let (star_slots, star_entries) = valences.stars_of(&faces);
        Self { positions, faces, star_slots, star_entries, free_faces: Vec::new() }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of faces, removed ones not counted.
    pub fn face_count(&self) -> usize {
        self.faces.len() - self.free_faces.len()
    }

    /// One more than the largest face id ever given out: the size of an array indexed by [`FaceId`].
    pub fn face_slots(&self) -> usize {
        self.faces.len()
    }

    /// All positions, m, in O, indexed by [`VertexId`].
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// All faces with their ids, in order of id, removed ones left out.
    pub fn faces(&self) -> impl Iterator<Item = (FaceId, [VertexId; 3])> + '_ {
        self.faces
            .iter()
            .enumerate()
            .filter(|(_, corners)| corners[0] != REMOVED)
            .map(|(face, corners)| (FaceId(face as u32), corners.map(VertexId)))
    }

    /// Whether `face` names a face that is there.
    pub fn has_face(&self, face: FaceId) -> bool {
        self.faces.get(face.0 as usize).is_some_and(|corners| corners[0] != REMOVED)
    }

    /// The corners of a face, counter-clockwise seen from outside.
    #[inline]
    pub fn corners(&self, face: FaceId) -> [VertexId; 3] {
        self.faces[face.0 as usize].map(VertexId)
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

    /// Outward unit normal of a face; zero when the face has no area.
    #[inline]
    pub fn normal(&self, face: FaceId) -> Vector3<f64> {
        self.double_area_normal(face).try_normalize(0.0).unwrap_or_else(Vector3::zeros)
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
        let slot = self.star_slots[vertex.0 as usize];
        &self.star_entries[slot.start as usize..(slot.start + slot.len) as usize]
    }

    /// The faces that share the edge from `a` to `b` (either direction), in no particular order.
    pub fn faces_at_edge(&self, a: VertexId, b: VertexId) -> impl Iterator<Item = FaceId> + '_ {
        self.star(a).iter().copied().filter(move |&f| self.corners(f).contains(&b))
    }

    /// Moves one vertex; an index over the faces must be told ([`crate::mesh::FaceTree::refit`]).
    #[inline]
    pub fn set_position(&mut self, vertex: VertexId, position: Point3<f64>) {
        debug_assert!(position.coords.iter().all(|x| x.is_finite()));
        self.positions[vertex.0 as usize] = position;
    }

    /// Adds a vertex that no face uses yet.
    ///
    /// # Errors
    /// [`MeshError::NotFinite`], [`MeshError::TooMany`].
    pub fn add_vertex(&mut self, position: Point3<f64>) -> Result<VertexId, MeshError> {
        let vertex = self.positions.len();
        if !position.coords.iter().all(|x| x.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        if vertex >= REMOVED as usize - 1 {
            return Err(MeshError::TooMany { what: "vertices", count: vertex + 1 });
        }
        self.positions.push(position);
        self.star_slots.push(StarSlot::default());
        Ok(VertexId(vertex as u32))
    }

    /// Adds a face, counter-clockwise seen from outside; the slot of a removed face is used again first.
    ///
    /// # Errors
    /// [`MeshError::VertexOutOfRange`], [`MeshError::RepeatedVertex`], [`MeshError::TooMany`].
    pub fn add_face(&mut self, corners: [VertexId; 3]) -> Result<FaceId, MeshError> {
        let corners = corners.map(|v| v.0);
        check_corners(&corners, self.faces.len(), self.positions.len())?;
        if self.free_faces.is_empty() && self.faces.len() >= REMOVED as usize - 1 {
            return Err(MeshError::TooMany { what: "faces", count: self.faces.len() + 1 });
        }
        let face = self.free_faces.pop().unwrap_or_else(|| {
            self.faces.push([REMOVED; 3]);
            FaceId(self.faces.len() as u32 - 1)
        });
        self.faces[face.0 as usize] = corners;
        for vertex in corners {
            self.push_star(vertex, face);
        }
        Ok(face)
    }

    /// Removes a face; its vertices stay. Returns whether there was such a face.
    pub fn remove_face(&mut self, face: FaceId) -> bool {
        if !self.has_face(face) {
            return false;
        }
        for vertex in std::mem::replace(&mut self.faces[face.0 as usize], [REMOVED; 3]) {
            let slot = &mut self.star_slots[vertex as usize];
            let star = &mut self.star_entries[slot.start as usize..(slot.start + slot.len) as usize];
            if let Some(at) = star.iter().position(|&f| f == face) {
                star.swap(at, slot.len as usize - 1);
                slot.len -= 1;
            }
        }
        self.free_faces.push(face);
        true
    }

    /// Turns a face over: its normal changes sign; its id and its neighbours stay.
    pub fn flip_face(&mut self, face: FaceId) {
        self.faces[face.0 as usize].swap(1, 2);
    }

    fn push_star(&mut self, vertex: u32, face: FaceId) {
        let slot = &mut self.star_slots[vertex as usize];
        if slot.len == slot.capacity {
            // the star moves to the end with room to grow; the old entries are left behind
            let old = slot.start as usize..(slot.start + slot.len) as usize;
            slot.start = self.star_entries.len() as u32;
            slot.capacity = (2 * slot.len).max(8);
            self.star_entries.extend_from_within(old);
            self.star_entries.resize((slot.start + slot.capacity) as usize, FaceId(REMOVED));
        }
        self.star_entries[(slot.start + slot.len) as usize] = face;
        slot.len += 1;
    }
}

fn check_corners(corners: &[u32; 3], face: usize, vertices: usize) -> Result<(), MeshError> {
    if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
        return Err(MeshError::VertexOutOfRange { face, vertex, vertices });
    }
    let [a, b, c] = *corners;
    if a == b || b == c || c == a {
        return Err(MeshError::RepeatedVertex { face, vertex: if b == c { b } else { a } });
    }
    Ok(())
}

/// How many faces each vertex has: the first half of the counting sort that finds the stars, in the place of its result.
pub(super) struct Valences(Vec<StarSlot>);

impl Valences {
    /// No faces yet.
    pub fn new(vertices: usize) -> Self {
        Self(vec![StarSlot::default(); vertices])
    }

    /// Counts a face.
    #[inline]
    pub fn add(&mut self, corners: &[u32; 3]) {
        corners.iter().for_each(|&v| self.0[v as usize].capacity += 1);
    }

    /// Whether each vertex has a face.
    pub fn used(&self) -> impl Iterator<Item = bool> {
        self.0.iter().map(|slot| slot.capacity > 0)
    }

    /// Forgets the vertices without a face.
    pub fn retain_used(&mut self) {
        self.0.retain(|slot| slot.capacity > 0);
    }

    /// The faces around each vertex, in rising order; `faces`: those that were counted.
    fn stars_of(self, faces: &[[u32; 3]]) -> (Vec<StarSlot>, Vec<FaceId>) {
        let mut slots = self.0;
        let mut end = 0;
        for slot in &mut slots {
            slot.start = end;
            end += slot.capacity;
        }
        let mut entries = vec![FaceId(REMOVED); end as usize];
        for (face, corners) in faces.iter().enumerate() {
            for &vertex in corners {
                let slot = &mut slots[vertex as usize];
                entries[(slot.start + slot.len) as usize] = FaceId(face as u32);
                slot.len += 1;
            }
        }
        (slots, entries)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share the edge 1–2.
    fn quad() -> TriMesh {
        let positions =
            vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0), Point3::new(1.0, 1.0, 0.0)];
        TriMesh::new(positions, vec![[0, 1, 2], [1, 3, 2]]).unwrap()
    }

    #[test]
    fn stars_follow_removed_and_added_faces() {
        let mut mesh = quad();
        assert_eq!(mesh.star(VertexId(1)), [FaceId(0), FaceId(1)]);
        assert!(mesh.remove_face(FaceId(0)));
        assert!(!mesh.remove_face(FaceId(0)));
        assert_eq!((mesh.face_count(), mesh.star(VertexId(0)).len(), mesh.star(VertexId(1)).len()), (1, 0, 1));
        let centre = mesh.add_vertex(Point3::new(0.2, 0.2, 0.0)).unwrap();
        let added: Vec<_> =
            [[0, 1], [1, 2], [2, 0]].map(|[a, b]| mesh.add_face([VertexId(a), VertexId(b), centre]).unwrap()).into();
        assert_eq!(added, [FaceId(0), FaceId(2), FaceId(3)], "a freed slot is used first");
        assert_eq!(mesh.star(centre).len(), 3);
        assert_eq!(mesh.faces_at_edge(VertexId(2), VertexId(1)).count(), 2);
        assert_eq!(mesh.faces().count(), 4);
    }

    #[test]
    fn breaches_of_the_invariants_are_refused() {
        let p = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        assert_eq!(
            TriMesh::new(p.clone(), vec![[0, 1, 3]]).unwrap_err(),
            MeshError::VertexOutOfRange { face: 0, vertex: 3, vertices: 3 }
        );
        assert_eq!(
            TriMesh::new(p.clone(), vec![[0, 1, 1]]).unwrap_err(),
            MeshError::RepeatedVertex { face: 0, vertex: 1 }
        );
        let mut bad = p;
        bad[2].y = f64::NAN;
        assert_eq!(TriMesh::new(bad, vec![[0, 1, 2]]).unwrap_err(), MeshError::NotFinite { vertex: 2 });
    }
}
