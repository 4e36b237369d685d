//! Geometry: triangle meshes with their queries and repair, the form of fitted elements, boundary
//! representations, numerics.
//!
//! Nothing in this crate, nor in `touchup-method`, `touchup-features` and `touchup-probing` above
//! it, opens a file, reads a clock, starts a thread or speaks ROS: the same input gives the same
//! bytes. The modules, in the order in which they may use one another:
//!
//! | module | purpose |
//! |---|---|
//! | [`numeric`] | quantiles, means, bases, voxels, disjoint sets, robust weights, least squares, small rigid motions |
//! | [`mesh`] | the triangle mesh, its repair, its exact closest-face tree, its Laplacian |
//! | [`form`] | roundness, flatness, parallelism, position, … of points and of fitted features, with their uncertainty |
//! | [`brep`] | trimmed analytic faces with their shells, and the curves in which surfaces meet |
//!
//! # Units
//!
//! SI throughout: m, N, N·m, kg, s, rad. A bare number that leaves the code carries its unit in its
//! name (`mass_kg`, `stamp_ns`). Stamps are `i64` nanoseconds.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod brep;
pub mod form;
pub mod mesh;
pub mod numeric;
