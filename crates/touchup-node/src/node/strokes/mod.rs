//! Strokes that are removed, restored and replayed.

pub mod replayed;
pub mod taking_out;
