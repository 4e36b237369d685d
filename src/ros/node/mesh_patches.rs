//! The mesh for programs: changes from version to version, and the whole state for who has none.

use std::sync::Arc;

use super::convert::header;
use super::edits::Edits;
use super::replica::MeshVersion;
use crate::mesh::IdSet;
use crate::reconstruct::Support;
use crate::ros::messages::MeshPatch;

/// Vertices and faces of one message at most: 37 kB.
const OF_A_PART: usize = 1000;

/// What followers have, and what they lack.
#[derive(Debug, Default)]
pub struct MeshPatches {
    /// the state that they have
    version: u64,
    vertices: IdSet,
    faces: IdSet,
    /// for each number, whether they have such a vertex, or face
    has_vertex: Vec<bool>,
    has_face: Vec<bool>,
    /// variance of what rests on the scan, m²; NaN where it is not known
    scan_variance: f32,
}

impl MeshPatches {
    /// Followers have what the replica has.
    ///
    /// - `scan_sigma`: standard deviation of the scan, m, when it is known.
    pub fn of(replica: &MeshVersion, scan_sigma: Option<f64>) -> Self {
        let [vertices, faces] = replica.slots();
        Self {
            version: replica.version,
            has_vertex: (0..vertices).map(|vertex| replica.vertex(vertex).is_some()).collect(),
            has_face: (0..faces).map(|face| replica.face(face).is_some()).collect(),
            scan_variance: scan_sigma.map_or(f32::NAN, |sigma| (sigma * sigma) as f32),
            ..Self::default()
        }
    }

    /// Remembers what changed.
    pub fn note(&mut self, edits: &Edits) {
        edits.vertices.iter().for_each(|(vertex, _)| self.vertices.insert(*vertex));
        edits.faces.iter().for_each(|(face, _)| self.faces.insert(*face));
    }

    /// The change from what followers have to what the replica has, in parts; none when it is the same.
    pub fn change(&mut self, replica: &MeshVersion, frame: &str) -> Vec<MeshPatch> {
        if self.version == replica.version || (self.vertices.is_empty() && self.faces.is_empty()) {
            return Vec::new();
        }
        let mut draft = DraftPatch::default();
        let Self { vertices, faces, has_vertex, has_face, .. } = self;
        vertices.take(usize::MAX, |vertex| match (replica.vertex(vertex).is_some(), remembered(has_vertex, vertex)) {
            (true, had) => {
                draft.set.push(vertex);
                *had = true;
            }
            (false, had) if *had => {
                draft.removed_vertices.push(vertex);
                *had = false;
            }
            _ => {}
        });
        faces.take(usize::MAX, |face| match (replica.face(face).is_some(), remembered(has_face, face)) {
            (true, had) => {
                draft.faces.push(face);
                *had = true;
            }
            (false, had) if *had => {
                draft.removed_faces.push(face);
                *had = false;
            }
            _ => {}
        });
        let base = std::mem::replace(&mut self.version, replica.version);
        let part = |part| draft.part(part, replica, [base, self.version], frame, self.scan_variance);
        (0..draft.part_count()).map(part).collect()
    }

    /// The whole state, part by part: that of the replica, which followers have.
    pub fn whole(
        &self,
        replica: Arc<MeshVersion>,
        frame: String,
    ) -> impl Iterator<Item = MeshPatch> + Send + 'static + use<> {
        let [vertices, faces] = replica.slots();
        let draft = DraftPatch {
            set: (0..vertices).filter(|&vertex| replica.vertex(vertex).is_some()).collect(),
            faces: (0..faces).filter(|&face| replica.face(face).is_some()).collect(),
            ..DraftPatch::default()
        };
        let (version, variance) = (self.version, self.scan_variance);
        (0..draft.part_count()).map(move |part| draft.part(part, &replica, [0, version], &frame, variance))
    }
}

fn remembered(list: &mut Vec<bool>, id: u32) -> &mut bool {
    let at = id as usize;
    if at >= list.len() {
        list.resize(at + 1, false);
    }
    &mut list[at]
}

/// A change before it is cut into parts.
#[derive(Default)]
struct DraftPatch {
    removed_faces: Vec<u32>,
    set: Vec<u32>,
    faces: Vec<u32>,
    removed_vertices: Vec<u32>,
}

impl DraftPatch {
    fn lengths(&self) -> [usize; 4] {
        [&self.removed_faces, &self.set, &self.faces, &self.removed_vertices].map(Vec::len)
    }

    fn part_count(&self) -> u32 {
        (self.lengths().iter().sum::<usize>().div_ceil(OF_A_PART) as u32).max(1)
    }

    /// The four lists one after the other, cut into parts: so a face comes after its corners, and a vertex goes after all
    /// faces that used it.
    fn part(&self, part: u32, replica: &MeshVersion, [base, version]: [u64; 2], frame: &str, scan: f32) -> MeshPatch {
        let (mut from, mut to) = (part as usize * OF_A_PART, (part as usize + 1) * OF_A_PART);
        let mut cut = |list: &[u32]| {
            let ours = list[from.min(list.len())..to.min(list.len())].to_vec();
            (from, to) = (from.saturating_sub(list.len()), to.saturating_sub(list.len()));
            ours
        };
        let [vertex_count, face_count] = replica.counts();
        let mut message = MeshPatch {
            header: header(replica.stamp_ns, frame),
            session: replica.session.clone(),
            version,
            base_version: base,
            part,
            part_count: self.part_count(),
            removed_faces: cut(&self.removed_faces),
            vertices: cut(&self.set),
            faces: cut(&self.faces),
            removed_vertices: cut(&self.removed_vertices),
            vertex_count,
            face_count,
            ..MeshPatch::default()
        };
        for (position, support) in message.vertices.iter().filter_map(|&vertex| replica.vertex(vertex)) {
            message.positions.extend(position.coords.iter().map(|x| *x as f32));
            message.variance.push(if support == Support::Scan { scan } else { f32::NAN });
            message.support.push(number_of(support));
        }
        message.corners = message.faces.iter().filter_map(|&face| replica.face(face)).flatten().collect();
        message
    }
}

fn number_of(support: Support) -> u8 {
    match support {
        Support::Scan => MeshPatch::SUPPORT_SCAN,
        Support::Touched => MeshPatch::SUPPORT_TOUCHED,
        Support::Guessed => MeshPatch::SUPPORT_GUESSED,
        Support::Unreachable => MeshPatch::SUPPORT_UNREACHABLE,
    }
}
