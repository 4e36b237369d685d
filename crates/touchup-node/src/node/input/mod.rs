//! Arrival of the input: streams, frames, acceptance, doubts.

pub mod acceptance;
pub mod doubts;
pub mod frame_resolver;
pub mod streams;
