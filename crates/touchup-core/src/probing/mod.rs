//! An arm that touches flagged features by itself.

pub mod arm;
pub mod execute;
pub mod plan;
