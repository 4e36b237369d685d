mod mesh_files;
mod pipeline;
mod point_clouds;
mod recordings;
