//! Clocks of pose and wrench: their delay, from motion and force.

pub(super) mod clock;
mod clock_course;
pub(super) mod clock_offset;
mod course_blocks;
mod delay_part;
mod onsets;
