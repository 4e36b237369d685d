//! MCAP: reading, writing, and recordings that grow.

pub mod chunked;
pub mod framing;
pub mod mcap;
pub mod writer;
