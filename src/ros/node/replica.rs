//! The mesh as the view knows it: plain arrays by id, brought up to date by what it is told.

use std::ops::Deref;
use std::sync::Arc;

use nalgebra::Point3;

use super::edits::Edits;
use crate::clock::Working;
use crate::mesh::{MeshError, TriMesh, VertexId};
use crate::patch::Support;

/// Corners of a face that is not there.
const NO_FACE: [u32; 3] = [u32::MAX; 3];

/// The mesh at one version.
#[derive(Clone, Debug, Default)]
pub struct Replica {
    /// name of the session
    pub session: String,
    /// state of the mesh, as in `MeshPatch`
    pub version: u64,
    /// stamp of the newest sample in it, ns
    pub stamp_ns: i64,
    positions: Vec<Point3<f64>>,
    support: Vec<Option<Support>>,
    corners: Vec<[u32; 3]>,
    vertex_count: u32,
    face_count: u32,
}

impl Replica {
    /// The scan, before anything was touched.
    pub fn of(scan: &TriMesh, session: &str) -> Self {
        let slots = scan.vertex_slots() as u32;
        let is_there = |vertex| scan.has_vertex(VertexId(vertex)).then_some(Support::Scan);
        let mut corners = vec![NO_FACE; scan.face_slots()];
        scan.faces().for_each(|(face, ours)| corners[face.0 as usize] = ours.map(|v| v.0));
        Self {
            session: session.to_owned(),
            version: 1,
            stamp_ns: 0,
            positions: scan.positions().to_vec(),
            support: (0..slots).map(is_there).collect(),
            corners,
            vertex_count: scan.vertex_count() as u32,
            face_count: scan.face_count() as u32,
        }
    }

    /// Takes changes up.
    pub fn apply(&mut self, edits: &Edits) {
        for &(vertex, place) in &edits.vertices {
            let at = vertex as usize;
            if at >= self.positions.len() {
                self.positions.resize(at + 1, Point3::origin());
                self.support.resize(at + 1, None);
            }
            let was_there = self.support[at].is_some();
            self.support[at] = place.map(|(_, support)| support);
            if let Some((position, _)) = place {
                self.positions[at] = position;
            }
            self.vertex_count = self.vertex_count + u32::from(place.is_some()) - u32::from(was_there);
        }
        for &(face, corners) in &edits.faces {
            let at = face as usize;
            if at >= self.corners.len() {
                self.corners.resize(at + 1, NO_FACE);
            }
            let was_there = self.corners[at] != NO_FACE;
            self.corners[at] = corners.unwrap_or(NO_FACE);
            self.face_count = self.face_count + u32::from(corners.is_some()) - u32::from(was_there);
        }
        if edits.is_complete {
            (self.version, self.stamp_ns) = (edits.version, edits.stamp_ns);
        }
    }

    /// How many vertices and faces there are.
    pub fn counts(&self) -> [u32; 2] {
        [self.vertex_count, self.face_count]
    }

    /// One more than the largest numbers of a vertex and of a face.
    pub fn slots(&self) -> [u32; 2] {
        [self.positions.len() as u32, self.corners.len() as u32]
    }

    /// Place of a vertex, m, and what it rests on; `None` where there is none.
    pub fn vertex(&self, vertex: u32) -> Option<(Point3<f64>, Support)> {
        let at = vertex as usize;
        Some((*self.positions.get(at)?, (*self.support.get(at)?)?))
    }

    /// Corners of a face; `None` where there is none.
    pub fn face(&self, face: u32) -> Option<[u32; 3]> {
        self.corners.get(face as usize).copied().filter(|corners| *corners != NO_FACE)
    }

    /// As a mesh of its own: vertices keep their numbers, faces their order.
    ///
    /// # Errors
    /// [`MeshError`], when faces name vertices that are not there yet.
    pub fn mesh(&self) -> Result<TriMesh, MeshError> {
        let faces = self.corners.iter().copied().filter(|corners| *corners != NO_FACE).collect();
        TriMesh::new(self.positions.clone(), faces)
    }
}

/// A replica that no longer changes. Time waits for who does something with it.
#[derive(Debug)]
pub struct Snapshot {
    replica: Arc<Replica>,
    _working: Working,
}

impl Snapshot {
    /// For one who asked.
    pub fn new(replica: Arc<Replica>, working: Working) -> Self {
        Self { replica, _working: working }
    }
}

impl Deref for Snapshot {
    type Target = Replica;

    fn deref(&self) -> &Replica {
        &self.replica
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::node::edits::VertexPlace;

    /// A strip of triangles between two rows of `columns` vertices.
    fn strip(columns: u32) -> TriMesh {
        let at = |i: u32| Point3::new(f64::from(i / 2), f64::from(i % 2), 0.0);
        let faces = (0..2 * columns - 2).map(|i| if i % 2 == 0 { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] });
        TriMesh::new((0..2 * columns).map(at).collect(), faces.collect()).unwrap()
    }

    fn edits(vertices: &[(u32, Option<VertexPlace>)], faces: &[(u32, Option<[u32; 3]>)]) -> Edits {
        let mut edits = Edits::default();
        edits.vertices.extend(vertices);
        edits.faces.extend(faces);
        edits
    }

    #[test]
    fn every_change_of_the_mesh_is_in_it() {
        let scan = strip(1000);
        let mut replica = Replica::of(&scan, "some");
        let moved = |i: u32, step: u32| Point3::new(f64::from(i), f64::from(step), f64::from(i * step) * 0.1);
        for step in 1..=3 {
            let place = |i: u32| Some((moved(i, step), Support::Touched));
            let vertices: Vec<_> = (0..2000).map(|i| (i, place(i))).collect();
            let mut edits = edits(&vertices, &[]);
            (edits.version, edits.is_complete) = (u64::from(step), step == 3);
            replica.apply(&edits);
            assert!((0..2000).all(|i| replica.vertex(i) == place(i)), "step {step}");
            // what is not complete is no version
            assert_eq!(replica.version, if step == 3 { 3 } else { 1 });
        }
        let faces: Vec<_> = scan.faces().map(|(_, corners)| corners.map(|v| v.0)).collect();
        assert!((0..1998).all(|face| replica.face(face) == Some(faces[face as usize])));
        assert_eq!((replica.counts(), replica.slots()), ([2000, 1998], [2000, 1998]));
        // the first vertex goes with its face, and one comes far beyond the last
        let new = (Point3::new(7.0, 8.0, 9.0), Support::Scan);
        replica.apply(&edits(&[(0, None), (2500, Some(new))], &[(0, None), (2100, Some([1, 2, 2500]))]));
        assert_eq!((replica.vertex(0), replica.vertex(2400), replica.vertex(2500)), (None, None, Some(new)));
        assert_eq!((replica.face(0), replica.face(2050), replica.face(2100)), (None, None, Some([1, 2, 2500])));
        assert_eq!((replica.counts(), replica.slots()), ([2000, 1998], [2501, 2101]));
    }
}
