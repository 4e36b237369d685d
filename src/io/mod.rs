//! Mesh files: the only room, with [`crate::scene`], that touches the disk.

pub mod atomic;
pub mod mesh_file;
//! io

pub mod recording;
