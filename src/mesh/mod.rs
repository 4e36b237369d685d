//! Triangle meshes: positions, adjacency, repair, closest face.

mod closest;
mod repair;
mod stars;
mod tri_mesh;
pub mod triangle;

pub use closest::{BoxQuery, FaceHit, FaceTree, RefitPlan};
pub use repair::{RepairReport, repair};
pub use tri_mesh::{FaceId, MeshError, TriMesh, VertexId};
