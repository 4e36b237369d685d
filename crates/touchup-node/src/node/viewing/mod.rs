//! The mesh for viewers, and the tip.

pub mod tiles;
pub mod tip;
pub mod view;
