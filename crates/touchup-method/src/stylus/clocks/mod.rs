//! Clocks of pose and wrench: their delay, from motion and force.

pub mod clock;
pub mod clock_offset;
pub mod course_clock;
