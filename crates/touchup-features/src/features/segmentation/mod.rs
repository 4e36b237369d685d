//! Segments of a mesh: pieces of one surface each, their edges and curvature.

pub(super) mod bodies;
pub(super) mod clusters;
pub(super) mod creases;
pub(super) mod curvature;
pub(super) mod facets;
pub(super) mod flats;
pub(super) mod grow;
pub(super) mod k_means;
pub(super) mod marks;
pub(super) mod primitive;
pub(super) mod rays;
pub(super) mod scene;
pub(super) mod segment;
mod spheres;
