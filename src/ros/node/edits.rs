//! Changes of the mesh on their way from the thread that makes them to the one that publishes them.
//!
//! Two of them go round, each bounded. When both are on their way, what changes stays in the mesh's journal, which is bounded
//! by the mesh: the view can be as slow as it likes.

use nalgebra::Point3;

use crate::live::Engine;
use crate::mesh::{Changes, FaceId, TriMesh, VertexId};
use crate::reconstruct::Support;

/// Vertices, and faces, that go at once: some 50 µs.
const AT_ONCE: usize = 1000;

/// Faces of a tile, by number: 1500 points are 60 kB with their colours, below the 64 kB of a datagram.
pub const FACES_OF_A_TILE: u32 = 500;
/// Where a vertex is, m, in O, and what it rests on.
pub type VertexPlace = (Point3<f64>, Support);

/// Some changes.
#[derive(Clone, Debug, Default)]
pub struct Edits {
    /// state of the mesh with these in it, when they are the last of it
    pub version: u64,
    /// whether they are: before that, ids may not fit each other
    pub is_complete: bool,
    /// stamp of the newest sample in it, ns
    pub stamp_ns: i64,
    /// place and support; `None`: gone
    pub vertices: Vec<(u32, Option<VertexPlace>)>,
    /// corners; `None`: gone
    pub faces: Vec<(u32, Option<[u32; 3]>)>,
    /// tiles in which something is to be drawn anew
    pub tiles: Vec<u32>,
    taken: Changes,
}

impl Edits {
    /// Fills it with what changed.
    ///
    /// - `may_be_torn`: count as complete what is in the middle of a change of the patch.
    pub fn fill(&mut self, engine: &mut Engine, scan: &TriMesh, version: u64, stamp_ns: i64, may_be_torn: bool) {
        let Self { vertices, faces, tiles, taken, .. } = self;
        vertices.clear();
        faces.clear();
        tiles.clear();
        taken.clear();
        let is_all = engine.take_changes(AT_ONCE, taken);
        let mesh = engine.refiner().mesh();
        let mut note = |face: FaceId| {
            let tile = face.0 / FACES_OF_A_TILE;
            // neighbours are mostly in one tile: the list stays short
            if tiles.last() != Some(&tile) {
                tiles.push(tile);
            }
        };
        for &vertex in &taken.vertices {
            let place = mesh.has_vertex(vertex).then(|| {
                mesh.star(vertex).iter().for_each(|&face| note(face));
                (mesh.position(vertex), engine.support(scan, vertex))
            });
            vertices.push((vertex.0, place));
        }
        for &face in &taken.faces {
            note(face);
            let corners = mesh.has_face(face).then(|| mesh.corners(face).map(|VertexId(corner)| corner));
            faces.push((face.0, corners));
        }
        self.is_complete = is_all && (may_be_torn || engine.is_whole());
        (self.version, self.stamp_ns) = (version, stamp_ns);
    }

    /// Whether nothing has changed.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty() && self.faces.is_empty()
    }
}
