//! Segments of a mesh: pieces of one surface each, their edges and curvature.

pub mod bodies;
pub mod clusters;
pub mod creases;
pub mod curvature;
pub mod facets;
pub mod flats;
pub mod grow;
pub mod k_means;
pub mod marks;
pub mod primitive;
pub mod rays;
pub mod scene;
pub mod segment;
