//! Strokes that are removed, restored and replayed.

pub mod replayed;
pub mod take_out;
pub mod taking_out;
