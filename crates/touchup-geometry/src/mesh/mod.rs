//! Triangle meshes: positions, adjacency, repair, closest face, signed distance.

mod appearance;
mod closest;
mod coherent;
mod ids;
mod journal;
mod point_cloud;
mod point_tree;
mod polygon;
mod region;
mod repair;
mod signed_distance;
mod simplified;
mod stars;
mod tri_mesh;
pub mod triangle;
mod workers;

pub use appearance::{Appearance, Texture, VertexColours};
pub use closest::{BoxQuery, FaceHit, FaceTree, NearbyLeaves, RefitPlan};
pub use coherent::coherent_order;
pub use ids::{FaceId, VertexId};
pub use journal::{Changes, IdSet};
pub use point_cloud::{PointCloud, ScanStation};
pub use point_tree::PointTree;
pub use polygon::{fill, triangulate};
pub use region::{MeshRemainder, Region, SewnMesh};
pub use repair::{RepairReport, repair};
pub use signed_distance::{corner_normal, is_on_rim, pseudo_normal, signed_distance};
pub use simplified::SimplifiedMesh;
pub use tri_mesh::{FARTHEST, MeshError, TriMesh, is_place};
pub use workers::{SerialWorkers, Task, Workers, map_by, map_pieces_by};
