//! Probing of flagged features by an arm.

pub mod arm;
pub mod execute;
pub mod plan;
