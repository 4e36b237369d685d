//! Triangle meshes: positions, adjacency, closest face.

mod closest;
mod tri_mesh;
pub mod triangle;

pub use closest::{FaceHit, FaceTree};
pub use tri_mesh::{FaceId, MeshError, TriMesh, VertexId};
