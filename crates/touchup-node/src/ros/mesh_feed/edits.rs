//! Changes of the mesh on their way from its journal to the feed.

use nalgebra::Point3;

use touchup_geometry::mesh::{Changes, FaceId, TriMesh, VertexId};
use touchup_method::reconstruct::Support;
use touchup_session::live::{Engine, LiveError};

/// Maximum number of vertices, and of faces, per transfer: some 50 µs.
const AT_ONCE: usize = 1000;

/// Faces of a tile, by number: 1500 points are 60 kB with their colours, below the 64 kB of a
/// datagram.
pub const FACES_OF_A_TILE: u32 = 500;
/// Position of a vertex, m, in O, and its support.
pub type VertexPlace = (Point3<f64>, Support);
/// Number of a face and its corners; `None`: removed.
pub type FaceEdit = (u32, Option<[u32; 3]>);

/// Uncertainty of the touched vertices of one version.
#[derive(Clone, Debug, Default)]
pub struct VertexUncertainty {
    /// changed variances along the normal, m², by vertex
    pub variances: Vec<(u32, f32)>,
    /// vertices beside a rejected contact
    pub outliers: Vec<u32>,
}

/// A list of changes.
#[derive(Clone, Debug, Default)]
pub struct Edits {
    /// version of the mesh after these changes, if they complete it
    pub version: u64,
    /// whether they do: before that, ids may not fit each other
    pub is_complete: bool,
    /// stamp of the newest sample in it, ns
    pub stamp_ns: i64,
    /// position and support; `None`: removed
    pub vertices: Vec<(u32, Option<VertexPlace>)>,
    /// changed faces
    pub faces: Vec<FaceEdit>,
    /// tiles to redraw
    pub tiles: Vec<u32>,
    taken: Changes,
}

impl Edits {
    /// Fills the list with changes.
    ///
    /// - `may_be_torn`: counts a state inside a change of the patch as complete.
    ///
    /// # Errors
    /// As [`Engine::take_changes`].
    pub fn fill(
        &mut self,
        engine: &mut Engine,
        scan: &TriMesh,
        version: u64,
        stamp_ns: i64,
        may_be_torn: bool,
    ) -> Result<(), LiveError> {
        self.clear();
        let Self {
            vertices,
            faces,
            tiles,
            taken,
            ..
        } = self;
        let is_all = engine.take_changes(AT_ONCE, taken)?;
        let mesh = engine.mesh();
        let mut note = |face: FaceId| {
            let tile = face.0 / FACES_OF_A_TILE;
            // neighbours mostly share a tile: the list stays short
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
            let corners = mesh
                .has_face(face)
                .then(|| mesh.corners(face).map(|VertexId(corner)| corner));
            faces.push((face.0, corners));
        }
        self.is_complete = is_all && (may_be_torn || engine.is_whole());
        (self.version, self.stamp_ns) = (version, stamp_ns);
        Ok(())
    }

    /// Removes all changes, keeps the memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.faces.clear();
        self.tiles.clear();
        self.taken.clear();
        self.is_complete = false;
    }

    /// Whether there are changes, or the end of some.
    pub fn is_filled(&self) -> bool {
        !self.vertices.is_empty() || !self.faces.is_empty() || self.is_complete
    }
}
