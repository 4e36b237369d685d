//! The mesh for viewers, its variances, and the tip.

pub mod evaluating_variances;
pub mod tiles;
pub mod tip;
pub mod variances;
pub mod view;
