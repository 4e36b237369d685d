//! Tables of text: rows and columns, picked points, static poses.

pub mod pairs_file;
pub mod static_poses;
pub mod table;
pub(crate) mod table_rows;
