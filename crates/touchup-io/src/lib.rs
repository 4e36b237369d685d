//! Mesh files, recordings and picked points: with the scene file the only code that touches the disk.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod atomic;
pub mod features_file;
pub mod file_error;
pub mod machine;
pub mod mesh_file;
pub mod pairs_file;
pub mod parameters_file;
pub mod png;
pub mod probed_touches_file;
pub mod recording;
mod scalar;
pub mod session_folder;
pub mod static_poses;
pub mod table;
pub mod touches_file;
