mod mesh_files;
mod pipeline;
mod recordings;
