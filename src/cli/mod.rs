//! cli
pub mod step;
