//! Triangle meshes: positions, adjacency, repair, closest face, signed distance.

mod closest;
mod coherent;
mod journal;
mod repair;
mod signed_distance;
mod stars;
mod tri_mesh;
pub mod triangle;

pub use closest::{BoxQuery, FaceHit, FaceTree, RefitPlan};
pub use coherent::coherent_order;
pub use journal::{Changes, IdSet};
pub use repair::{RepairReport, repair};
pub use signed_distance::{pseudo_normal, signed_distance};
pub use tri_mesh::{FaceId, MeshError, TriMesh, VertexId};
