//! Triangle meshes: positions, adjacency, closest face.

mod tri_mesh;

pub use tri_mesh::{FaceId, MeshError, TriMesh, VertexId};
