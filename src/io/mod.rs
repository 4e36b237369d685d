//! Mesh files and recordings: the only room, with [`crate::scene`], that touches the disk.

pub mod atomic;
pub mod mesh_file;
pub mod png;
pub mod recording;
