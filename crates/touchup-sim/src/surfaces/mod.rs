//! Known surfaces: signed distance and closest point of each, and their triangles.

pub mod contour;
pub mod field;
pub mod mesh_surface;
pub mod peaks;
pub mod plate;
pub mod plate_mesh;
pub mod surface;
pub mod triangulate;
pub mod wavy;
pub mod with_spheres;
