//! The mesh for viewers, its variances, and the tip.

pub mod tiles;
pub mod tip;
pub mod view;
