//! Paths of the hand over a part.

pub mod habit;
pub mod path;
pub mod sides;
pub mod waterline;
