//! The mesh at one version: the scan, and blocks of changed vertices and faces over it.

use std::sync::Arc;

use nalgebra::Point3;

use super::blocks::Blocks;
use super::edits::{Edits, VertexPlace, VertexUncertainty};
use touchup_geometry::mesh::{FaceId, FaceTree, MeshError, TriMesh, VertexId};
use touchup_method::reconstruct::Support;

/// The mesh at one version. A copy shares all that does not change afterwards.
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
    scan: Arc<(TriMesh, FaceTree)>,
    /// variance of vertices on the scan, m²; NaN if unknown
    scan_variance: f32,
    vertices: Blocks<VertexState>,
    /// corners; `None`: missing
    faces: Blocks<Option<[u32; 3]>>,
    /// largest number of a vertex and of a face, plus one
    slots: [u32; 2],
    /// numbers of used vertices and of faces
    pub counts: [u32; 2],
    /// vertices beside a rejected contact, as of the last variances
    pub outliers: Arc<[u32]>,
}

/// State of one vertex.
#[derive(Clone, Copy, Debug)]
struct VertexState {
    /// m; of a missing vertex the last one
    position: Point3<f64>,
    /// `None`: missing
    support: Option<Support>,
    /// along the normal, m²; NaN if unknown
    variance: f32,
    /// number of faces at it: unused vertices are not shown
    uses: u32,
}

impl VertexState {
    fn of_scan(scan: &TriMesh, vertex: u32) -> Self {
        let id = VertexId(vertex);
        let is_there = scan.has_vertex(id);
        Self {
            position: scan
                .positions()
                .get(vertex as usize)
                .copied()
                .unwrap_or_default(),
            support: is_there.then_some(Support::Scan),
            variance: f32::NAN,
            uses: if is_there {
                scan.star(id).len() as u32
            } else {
                0
            },
        }
    }

    fn place(self) -> Option<VertexPlace> {
        let support = self.support.filter(|_| self.uses > 0)?;
        Some((self.position, support))
    }
}

fn corners_of_scan(scan: &TriMesh, face: u32) -> Option<[u32; 3]> {
    let id = FaceId(face);
    scan.has_face(id)
        .then(|| scan.corners(id).map(|VertexId(corner)| corner))
}

impl MeshVersion {
    /// The scan before any touch.
    ///
    /// - `scan_variance`: of its vertices along their normals, m²; NaN if unknown.
    pub fn of(
        scan: Arc<(TriMesh, FaceTree)>,
        frame: &str,
        session: &str,
        scan_variance: f32,
    ) -> Self {
        let mesh = &scan.0;
        let slots = [mesh.vertex_slots(), mesh.face_slots()].map(|slots| slots as u32);
        let is_used = |vertex: &u32| VertexState::of_scan(mesh, *vertex).uses > 0;
        let used = (0..slots[0]).filter(is_used).count();
        Self {
            frame: frame.to_owned(),
            session: session.to_owned(),
            version: 1,
            shape_version: 1,
            stamp_ns: 0,
            scan_variance,
            vertices: Blocks::new(),
            faces: Blocks::new(),
            slots,
            counts: [used as u32, mesh.face_count() as u32],
            outliers: Arc::default(),
            scan,
        }
    }

    /// The scan before any touch, for another session.
    pub fn of_session(&self, session: &str) -> Self {
        Self::of(
            Arc::clone(&self.scan),
            &self.frame,
            session,
            self.scan_variance,
        )
    }

    /// Applies changes; returns the changed vertices, with those that faces use from now on, or no
    /// longer.
    pub fn apply(&mut self, edits: &Edits) -> Vec<u32> {
        for &(vertex, place) in &edits.vertices {
            let state = self.vertex_mut(vertex);
            state.support = place.map(|(_, support)| support);
            state.variance = f32::NAN;
            if let Some((position, _)) = place {
                state.position = position;
            }
        }
        let mut changed = Vec::new();
        for &(face, corners) in &edits.faces {
            let was = std::mem::replace(self.face_mut(face), corners);
            self.counts[1] =
                self.counts[1] + u32::from(corners.is_some()) - u32::from(was.is_some());
            let added = corners.into_iter().flatten().map(|corner| (corner, 1));
            let removed = was.into_iter().flatten().map(|corner| (corner, -1));
            for (vertex, step) in added.chain(removed) {
                let uses = &mut self.vertex_mut(vertex).uses;
                *uses = uses.wrapping_add_signed(step);
                // the first face, or the last
                if *uses == u32::from(step > 0) {
                    self.counts[0] = self.counts[0].wrapping_add_signed(step);
                    changed.push(vertex);
                }
            }
        }
        if edits.is_complete {
            (self.version, self.shape_version, self.stamp_ns) =
                (edits.version, edits.version, edits.stamp_ns);
        }
        changed.extend(edits.vertices.iter().map(|(vertex, _)| *vertex));
        changed
    }

    /// Applies the uncertainty of vertices; returns the changed vertices.
    pub fn apply_uncertainty(&mut self, version: u64, uncertainty: VertexUncertainty) -> Vec<u32> {
        self.version = version;
        self.outliers = uncertainty.outliers.into();
        let mut changed = Vec::new();
        for (vertex, variance) in uncertainty.variances {
            if self.vertex(vertex).is_some() {
                self.vertex_mut(vertex).variance = variance;
                changed.push(vertex);
            }
        }
        changed
    }

    fn vertex_mut(&mut self, vertex: u32) -> &mut VertexState {
        self.slots[0] = self.slots[0].max(vertex + 1);
        let scan = &self.scan.0;
        self.vertices
            .get_mut(vertex, |vertex| VertexState::of_scan(scan, vertex))
    }

    fn face_mut(&mut self, face: u32) -> &mut Option<[u32; 3]> {
        self.slots[1] = self.slots[1].max(face + 1);
        let scan = &self.scan.0;
        self.faces.get_mut(face, |face| corners_of_scan(scan, face))
    }

    fn state(&self, vertex: u32) -> VertexState {
        let changed = self.vertices.get(vertex);
        changed.unwrap_or_else(|| VertexState::of_scan(&self.scan.0, vertex))
    }

    /// Largest number of a vertex and of a face, plus one.
    pub fn slots(&self) -> [u32; 2] {
        self.slots
    }

    /// Position of a vertex, m, and its support; `None` for a missing or unused vertex.
    pub fn vertex(&self, vertex: u32) -> Option<VertexPlace> {
        self.state(vertex).place()
    }

    /// Variance of a vertex along its normal, m²; NaN if unknown.
    pub fn variance(&self, vertex: u32) -> f32 {
        match self.state(vertex) {
            VertexState {
                support: Some(Support::Scan),
                ..
            } => self.scan_variance,
            state => state.variance,
        }
    }

    /// The vertices not supported by the scan: number, position, m, and support.
    pub fn touched(&self) -> impl Iterator<Item = (u32, VertexPlace)> + '_ {
        let all = self.vertices.changed();
        all.filter_map(|(vertex, state)| Some((vertex, state.place()?)))
            .filter(|(_, (_, support))| *support != Support::Scan)
    }

    /// Corners of a face; `None` for a missing one.
    pub fn face(&self, face: u32) -> Option<[u32; 3]> {
        let changed = self.faces.get(face);
        changed.unwrap_or_else(|| corners_of_scan(&self.scan.0, face))
    }

    /// As a mesh of its own: vertices keep their numbers, faces their order.
    ///
    /// # Errors
    /// [`MeshError`] if faces name missing vertices.
    pub fn mesh(&self) -> Result<TriMesh, MeshError> {
        let [vertices, faces] = self.slots;
        let positions = (0..vertices).map(|vertex| self.state(vertex).position);
        let faces = (0..faces).filter_map(|face| self.face(face));
        TriMesh::new(positions.collect(), faces.collect())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A scan with the tree over its faces.
    pub fn scan(mesh: TriMesh) -> Arc<(TriMesh, FaceTree)> {
        let tree = FaceTree::new(&mesh);
        Arc::new((mesh, tree))
    }

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
        let scan = scan(strip(1000));
        let mut mesh = MeshVersion::of(Arc::clone(&scan), "object", "some", f32::NAN);
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
            .0
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
