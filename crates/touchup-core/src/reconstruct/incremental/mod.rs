//! What new evidence changes: field, faces, and what follows them.

pub(in crate::reconstruct) mod delta;
pub(in crate::reconstruct) mod history;
pub(in crate::reconstruct) mod patcher;
pub(in crate::reconstruct) mod remesh;
pub(in crate::reconstruct) mod update;
