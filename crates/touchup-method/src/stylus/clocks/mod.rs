//! Clocks of pose and wrench: their delay, from motion and force.

pub(super) mod clock;
pub(super) mod clock_offset;
pub(super) mod course_clock;
