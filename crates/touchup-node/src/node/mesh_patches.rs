//! The mesh for programs: changes from version to version, and the whole state for new followers.

use std::sync::Arc;

use super::replica::{Edits, MeshVersion};
use crate::ros::convert::header;
use crate::ros::messages::MeshPatch;
use touchup_geometry::mesh::IdSet;
use touchup_method::reconstruct::Support;

/// Maximum number of vertices and faces of one message: 37 kB.
const OF_A_PART: usize = 1000;

/// State of the followers, and pending changes.
#[derive(Debug)]
pub struct MeshPatches {
    /// version of the followers
    version: u64,
    vertices: FollowedIds,
    faces: FollowedIds,
    /// variance of vertices on the scan, m²; NaN if unknown
    scan_variance: f32,
}

/// Vertices or faces of followers.
#[derive(Debug)]
struct FollowedIds {
    changed: IdSet,
    /// for each number, whether followers have it
    had: Vec<bool>,
}

impl FollowedIds {
    fn of(slots: u32, is_there: impl Fn(u32) -> bool) -> Self {
        Self {
            changed: IdSet::default(),
            had: (0..slots).map(is_there).collect(),
        }
    }

    /// Numbers to set and numbers to remove; marks them as sent.
    fn take(&mut self, is_there: impl Fn(u32) -> bool) -> [Vec<u32>; 2] {
        let Self { changed, had } = self;
        let (mut set, mut removed) = (Vec::new(), Vec::new());
        changed.take(usize::MAX, |id| {
            let at = id as usize;
            if at >= had.len() {
                had.resize(at + 1, false);
            }
            let is_there = is_there(id);
            match (is_there, std::mem::replace(&mut had[at], is_there)) {
                (true, _) => set.push(id),
                (false, true) => removed.push(id),
                (false, false) => {}
            }
        });
        [set, removed]
    }
}

impl MeshPatches {
    /// Followers have the state of the replica.
    ///
    /// - `scan_sigma`: standard deviation of the scan, m, if known.
    pub fn of(replica: &MeshVersion, scan_sigma: Option<f64>) -> Self {
        let [vertices, faces] = replica.slots();
        Self {
            version: replica.version,
            vertices: FollowedIds::of(vertices, |vertex| replica.vertex(vertex).is_some()),
            faces: FollowedIds::of(faces, |face| replica.face(face).is_some()),
            scan_variance: scan_sigma.map_or(f32::NAN, |sigma| (sigma * sigma) as f32),
        }
    }

    /// Notes changes.
    ///
    /// - `turned`: vertices that faces use from now on, or no longer.
    pub fn note(&mut self, edits: &Edits, turned: &[u32]) {
        turned
            .iter()
            .for_each(|vertex| self.vertices.changed.insert(*vertex));
        edits
            .vertices
            .iter()
            .for_each(|(vertex, _)| self.vertices.changed.insert(*vertex));
        edits
            .faces
            .iter()
            .for_each(|(face, _)| self.faces.changed.insert(*face));
    }

    /// Notes changes of vertices other than their position.
    pub fn note_vertices(&mut self, vertices: impl IntoIterator<Item = u32>) {
        vertices
            .into_iter()
            .for_each(|vertex| self.vertices.changed.insert(vertex));
    }

    /// The change from the followers' state to the replica, in parts; empty if both are equal.
    pub fn change(&mut self, replica: &MeshVersion, frame: &str) -> Vec<MeshPatch> {
        let is_same = self.vertices.changed.is_empty() && self.faces.changed.is_empty();
        if self.version == replica.version || is_same {
            return Vec::new();
        }
        let [set, removed_vertices] = self
            .vertices
            .take(|vertex| replica.vertex(vertex).is_some());
        let [faces, removed_faces] = self.faces.take(|face| replica.face(face).is_some());
        let draft = DraftPatch {
            removed_faces,
            set,
            faces,
            removed_vertices,
        };
        let base = std::mem::replace(&mut self.version, replica.version);
        let part = |part| {
            draft.part(
                part,
                replica,
                [base, self.version],
                frame,
                self.scan_variance,
            )
        };
        (0..draft.part_count()).map(part).collect()
    }

    /// The whole state of the replica, equal to the followers', part by part.
    pub fn whole(
        &self,
        replica: Arc<MeshVersion>,
        frame: String,
    ) -> impl Iterator<Item = MeshPatch> + Send + 'static + use<> {
        let [vertices, faces] = replica.slots();
        let draft = DraftPatch {
            set: (0..vertices)
                .filter(|&vertex| replica.vertex(vertex).is_some())
                .collect(),
            faces: (0..faces)
                .filter(|&face| replica.face(face).is_some())
                .collect(),
            ..DraftPatch::default()
        };
        let (version, variance) = (self.version, self.scan_variance);
        (0..draft.part_count())
            .map(move |part| draft.part(part, &replica, [0, version], &frame, variance))
    }
}

/// A change before its division into parts.
#[derive(Default)]
struct DraftPatch {
    removed_faces: Vec<u32>,
    set: Vec<u32>,
    faces: Vec<u32>,
    removed_vertices: Vec<u32>,
}

impl DraftPatch {
    fn part_count(&self) -> u32 {
        let lists = [
            &self.removed_faces,
            &self.set,
            &self.faces,
            &self.removed_vertices,
        ];
        (lists
            .map(Vec::len)
            .iter()
            .sum::<usize>()
            .div_ceil(OF_A_PART) as u32)
            .max(1)
    }

    /// The four lists in sequence, cut into parts: so a face comes after its corners, and a vertex
    /// goes after all faces that used it.
    fn part(
        &self,
        part: u32,
        replica: &MeshVersion,
        [base, version]: [u64; 2],
        frame: &str,
        scan: f32,
    ) -> MeshPatch {
        let (mut from, mut to) = (part as usize * OF_A_PART, (part as usize + 1) * OF_A_PART);
        let mut cut = |list: &[u32]| {
            let ours = list[from.min(list.len())..to.min(list.len())].to_vec();
            (from, to) = (
                from.saturating_sub(list.len()),
                to.saturating_sub(list.len()),
            );
            ours
        };
        let [vertex_count, face_count] = replica.counts;
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
        for (vertex, (position, support)) in message
            .vertices
            .iter()
            .filter_map(|&vertex| Some((vertex, replica.vertex(vertex)?)))
        {
            message
                .positions
                .extend(position.coords.iter().map(|x| *x as f32));
            message.variance.push(if support == Support::Scan {
                scan
            } else {
                replica.variance(vertex)
            });
            message.support.push(number_of(support));
        }
        message.corners = message
            .faces
            .iter()
            .filter_map(|&face| replica.face(face))
            .flatten()
            .collect();
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
