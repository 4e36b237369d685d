//! MCAP: reading, writing, and recordings that grow.

pub mod framing;
pub mod mcap;
pub mod resume;
pub mod segments;
pub mod writer;
