//! A program that follows the mesh as docs/ros.md says, written from that and from MeshPatch.msg
//! alone; tests/python/mesh_follower.py is the same in Python.

use std::collections::BTreeMap;

use touchup::mesh::TriMesh;
use touchup::ros::messages::MeshPatch;

#[derive(Debug, Default)]
pub struct Follower {
    pub session: String,
    pub version: u64,
    next_part: u32,
    pub vertices: BTreeMap<u32, [f32; 3]>,
    /// support of each received vertex, and the bits of its variance, m²
    pub known: BTreeMap<u32, (u8, u32)>,
    pub faces: BTreeMap<u32, [u32; 3]>,
    /// requests the whole state
    pub asks: bool,
    waits: bool,
    /// session and version of the whole state that has begun
    begun: Option<(String, u64)>,
    kept: Vec<MeshPatch>,
    quiet: u32,
}

impl Follower {
    /// One that was there from the beginning, and has the scan: it never misses anything.
    pub fn of(scan: &TriMesh) -> Self {
        Self {
            version: 1,
            vertices: (0..)
                .zip(scan.positions())
                .map(|(v, p)| (v, [p.x as f32, p.y as f32, p.z as f32]))
                .collect(),
            known: BTreeMap::new(),
            faces: scan
                .faces()
                .map(|(face, corners)| (face.0, corners.map(|v| v.0)))
                .collect(),
            ..Self::default()
        }
    }

    pub fn is_waiting(&self) -> bool {
        self.waits
    }

    pub fn take(&mut self, patch: &MeshPatch) {
        if self.session.is_empty() && self.version > 0 {
            self.session.clone_from(&patch.session);
        }
        if self.waits && patch.base_version == 0 {
            self.take_whole(patch);
        } else if self.waits {
            if self.begun.is_some() {
                self.kept.push(patch.clone());
            }
        } else if patch.session == self.session && patch.version <= self.version {
            // has it already
        } else if patch.session == self.session
            && (patch.base_version, patch.part) == (self.version, self.next_part)
        {
            self.apply(patch);
        } else {
            self.ask();
        }
    }

    fn take_whole(&mut self, patch: &MeshPatch) {
        if patch.part == 0 {
            (self.vertices, self.known, self.faces, self.kept) = Default::default();
            (self.begun, self.next_part) = (Some((patch.session.clone(), patch.version)), 0);
        }
        if self.begun != Some((patch.session.clone(), patch.version))
            || patch.part != self.next_part
        {
            return;
        }
        self.quiet = 0;
        self.apply(patch);
        if self.next_part == 0 {
            self.waits = false;
            for later in std::mem::take(&mut self.kept) {
                self.take(&later);
            }
        }
    }

    fn ask(&mut self) {
        (self.waits, self.asks, self.begun, self.quiet) = (true, true, None, 0);
    }

    /// Asks again after a long silence in the whole state.
    pub fn tick(&mut self) {
        self.quiet += 1;
        if self.waits && self.quiet > 20 {
            self.ask();
        }
    }

    fn apply(&mut self, patch: &MeshPatch) {
        for face in &patch.removed_faces {
            assert!(
                self.faces.remove(face).is_some(),
                "face {face} was not there"
            );
        }
        for (vertex, position) in patch.vertices.iter().zip(patch.positions.chunks(3)) {
            self.vertices
                .insert(*vertex, [position[0], position[1], position[2]]);
        }
        let known = patch.support.iter().zip(&patch.variance);
        for (vertex, (support, variance)) in patch.vertices.iter().zip(known) {
            self.known.insert(*vertex, (*support, variance.to_bits()));
        }
        for (face, corners) in patch.faces.iter().zip(patch.corners.chunks(3)) {
            let corners = [corners[0], corners[1], corners[2]];
            assert!(
                corners
                    .iter()
                    .all(|corner| self.vertices.contains_key(corner)),
                "face {face} has no corners"
            );
            self.faces.insert(*face, corners);
        }
        for vertex in &patch.removed_vertices {
            assert!(
                self.vertices.remove(vertex).is_some(),
                "vertex {vertex} was not there"
            );
            self.known.remove(vertex);
        }
        let count = patch.vertices.len();
        assert_eq!(
            (
                patch.positions.len(),
                patch.variance.len(),
                patch.support.len()
            ),
            (3 * count, count, count)
        );
        self.next_part = patch.part + 1;
        if self.next_part == patch.part_count {
            (self.session, self.version, self.next_part) =
                (patch.session.clone(), patch.version, 0);
            let counts = (self.vertices.len() as u32, self.faces.len() as u32);
            assert_eq!(
                counts,
                (patch.vertex_count, patch.face_count),
                "version {}",
                patch.version
            );
        }
    }
}
