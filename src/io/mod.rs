//! Mesh files and recordings: the only room, with [`crate::scene`], that touches the disk.

pub mod atomic;
pub mod features_file;
pub mod mesh_file;
pub mod recording;
pub mod touches_file;
