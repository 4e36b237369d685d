//! Incremental update of field, faces, and the mesh that follows.

pub(in crate::reconstruct) mod delta;
pub(in crate::reconstruct) mod patcher;
pub(in crate::reconstruct) mod remesh;
pub(super) mod splice;
pub(in crate::reconstruct) mod update;
