//! The mesh at one version: plain arrays by id.

use nalgebra::Point3;

use super::edits::Edits;
use touchup_geometry::mesh::{MeshError, TriMesh, VertexId};
use touchup_method::reconstruct::Support;

/// Corners of a missing face.
const NO_FACE: [u32; 3] = [u32::MAX; 3];

/// The mesh at one version.
#[derive(Clone, Debug)]
pub struct MeshVersion {
    /// frame of the positions
    pub frame: String,
    /// name of the session
    pub session: String,
    /// state of the mesh, as in `MeshPatch`
    pub version: u64,
    /// version of its shape: later ones only change variances
    pub shape_version: u64,
    /// stamp of the newest sample in it, ns
    pub stamp_ns: i64,
    positions: Vec<Point3<f64>>,
    support: Vec<Option<Support>>,
    /// along the normal, m²; NaN if unknown
    variance: Vec<f32>,
    /// variance of vertices on the scan, m²; NaN if unknown
    pub scan_variance: f32,
    /// number of faces at each vertex: unused vertices are not shown
    uses: Vec<u32>,
    corners: Vec<[u32; 3]>,
    /// numbers of used vertices and of faces
    pub counts: [u32; 2],
}

impl MeshVersion {
    /// The scan before any touch.
    ///
    /// - `scan_variance`: of its vertices along their normals, m²; NaN if unknown.
    pub fn of(scan: &TriMesh, frame: &str, session: &str, scan_variance: f32) -> Self {
        let slots = scan.vertex_slots() as u32;
        let is_there = |vertex| scan.has_vertex(VertexId(vertex)).then_some(Support::Scan);
        let mut corners = vec![NO_FACE; scan.face_slots()];
        let mut uses = vec![0; scan.vertex_slots()];
        for (face, ours) in scan.faces() {
            corners[face.0 as usize] = ours.map(|v| v.0);
            ours.iter().for_each(|v| uses[v.0 as usize] += 1);
        }
        let used = uses.iter().filter(|uses| **uses > 0).count();
        Self {
            frame: frame.to_owned(),
            session: session.to_owned(),
            version: 1,
            shape_version: 1,
            stamp_ns: 0,
            positions: scan.positions().to_vec(),
            support: (0..slots).map(is_there).collect(),
            variance: vec![f32::NAN; scan.vertex_slots()],
            scan_variance,
            uses,
            corners,
            counts: [used as u32, scan.face_count() as u32],
        }
    }

    /// Applies changes; returns vertices that faces use from now on, or no longer.
    pub fn apply(&mut self, edits: &Edits) -> Vec<u32> {
        for &(vertex, place) in &edits.vertices {
            self.make_room(vertex);
            let at = vertex as usize;
            self.support[at] = place.map(|(_, support)| support);
            self.variance[at] = f32::NAN;
            if let Some((position, _)) = place {
                self.positions[at] = position;
            }
        }
        let mut turned = Vec::new();
        for &(face, corners) in &edits.faces {
            let at = face as usize;
            if at >= self.corners.len() {
                self.corners.resize(at + 1, NO_FACE);
            }
            let was = std::mem::replace(&mut self.corners[at], corners.unwrap_or(NO_FACE));
            let was = (was != NO_FACE).then_some(was);
            self.counts[1] =
                self.counts[1] + u32::from(corners.is_some()) - u32::from(was.is_some());
            for vertex in corners.into_iter().flatten() {
                self.make_room(vertex);
                let uses = &mut self.uses[vertex as usize];
                *uses += 1;
                if *uses == 1 {
                    self.counts[0] += 1;
                    turned.push(vertex);
                }
            }
            for vertex in was.into_iter().flatten() {
                let uses = &mut self.uses[vertex as usize];
                *uses -= 1;
                if *uses == 0 {
                    self.counts[0] -= 1;
                    turned.push(vertex);
                }
            }
        }
        if edits.is_complete {
            (self.version, self.shape_version, self.stamp_ns) =
                (edits.version, edits.version, edits.stamp_ns);
        }
        turned
    }

    /// Applies variances of vertices, m²; returns the changed vertices.
    pub fn apply_variances(&mut self, version: u64, variances: &[(u32, f32)]) -> Vec<u32> {
        self.version = version;
        let known = variances
            .iter()
            .filter(|(vertex, _)| self.vertex(*vertex).is_some());
        let known: Vec<_> = known.collect();
        for &&(vertex, variance) in &known {
            self.variance[vertex as usize] = variance;
        }
        known.into_iter().map(|(vertex, _)| *vertex).collect()
    }

    fn make_room(&mut self, vertex: u32) {
        let slots = vertex as usize + 1;
        if slots > self.positions.len() {
            self.positions.resize(slots, Point3::origin());
            self.support.resize(slots, None);
            self.variance.resize(slots, f32::NAN);
            self.uses.resize(slots, 0);
        }
    }

    /// Largest number of a vertex and of a face, plus one.
    pub fn slots(&self) -> [u32; 2] {
        [self.positions.len() as u32, self.corners.len() as u32]
    }

    /// Session, and the version of the shape.
    pub fn shape_state(&self) -> (String, u64) {
        (self.session.clone(), self.shape_version)
    }

    /// Position of a vertex, m, and its support; `None` for a missing or unused vertex.
    pub fn vertex(&self, vertex: u32) -> Option<(Point3<f64>, Support)> {
        let at = vertex as usize;
        let is_used = self.uses.get(at).is_some_and(|uses| *uses > 0);
        is_used.then_some((*self.positions.get(at)?, (*self.support.get(at)?)?))
    }

    /// Variance of a vertex along its normal, m²; NaN if unknown.
    pub fn variance(&self, vertex: u32) -> f32 {
        let at = vertex as usize;
        match self.support.get(at) {
            Some(Some(Support::Scan)) => self.scan_variance,
            _ => self.variance.get(at).copied().unwrap_or(f32::NAN),
        }
    }

    /// The vertices not supported by the scan: number, position, m, and support.
    pub fn touched(&self) -> impl Iterator<Item = (u32, Point3<f64>, Support)> + '_ {
        let all = (0..self.positions.len() as u32)
            .filter_map(|vertex| Some((vertex, self.vertex(vertex)?)));
        all.filter(|(_, (_, support))| *support != Support::Scan)
            .map(|(vertex, (place, support))| (vertex, place, support))
    }

    /// Corners of a face; `None` for a missing one.
    pub fn face(&self, face: u32) -> Option<[u32; 3]> {
        self.corners
            .get(face as usize)
            .copied()
            .filter(|corners| *corners != NO_FACE)
    }

    /// As a mesh of its own: vertices keep their numbers, faces their order.
    ///
    /// # Errors
    /// [`MeshError`] if faces name missing vertices.
    pub fn mesh(&self) -> Result<TriMesh, MeshError> {
        let faces = self
            .corners
            .iter()
            .copied()
            .filter(|corners| *corners != NO_FACE)
            .collect();
        TriMesh::new(self.positions.clone(), faces)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::edits::VertexPlace;
    use super::*;

    /// A strip of triangles between two rows of `columns` vertices.
    pub fn strip(columns: u32) -> TriMesh {
        let at = |i: u32| Point3::new(f64::from(i / 2), f64::from(i % 2), 0.0);
        let faces = (0..2 * columns - 2).map(|i| {
            if i % 2 == 0 {
                [i, i + 2, i + 1]
            } else {
                [i, i + 1, i + 2]
            }
        });
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
        let mut mesh = MeshVersion::of(&scan, "object", "some", f32::NAN);
        let moved = |i: u32, step: u32| {
            Point3::new(f64::from(i), f64::from(step), f64::from(i * step) * 0.1)
        };
        for step in 1..=3 {
            let place = |i: u32| Some((moved(i, step), Support::Touched));
            let vertices: Vec<_> = (0..2000).map(|i| (i, place(i))).collect();
            let mut edits = edits(&vertices, &[]);
            (edits.version, edits.is_complete) = (u64::from(step), step == 3);
            mesh.apply(&edits);
            assert!((0..2000).all(|i| mesh.vertex(i) == place(i)), "step {step}");
            // an incomplete state is no version
            assert_eq!(mesh.version, if step == 3 { 3 } else { 1 });
        }
        let faces: Vec<_> = scan
            .faces()
            .map(|(_, corners)| corners.map(|v| v.0))
            .collect();
        assert!((0..1998).all(|face| mesh.face(face) == Some(faces[face as usize])));
        assert_eq!((mesh.counts, mesh.slots()), ([2000, 1998], [2000, 1998]));
        // the first vertex goes with its face, and a new one has a far larger number
        let new = (Point3::new(7.0, 8.0, 9.0), Support::Scan);
        mesh.apply(&edits(
            &[(0, None), (2500, Some(new))],
            &[(0, None), (2100, Some([1, 2, 2500]))],
        ));
        assert_eq!(
            (mesh.vertex(0), mesh.vertex(2400), mesh.vertex(2500)),
            (None, None, Some(new))
        );
        assert_eq!(
            (mesh.face(0), mesh.face(2050), mesh.face(2100)),
            (None, None, Some([1, 2, 2500]))
        );
        assert_eq!((mesh.counts, mesh.slots()), ([2000, 1998], [2501, 2101]));
    }
}
