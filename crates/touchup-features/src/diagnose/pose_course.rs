//! Positions of the tracker, one after the other.

use nalgebra::Vector3;

use super::finding::{FoundNumber, InputCause, InputFinding};
use touchup_geometry::numeric::quantile;

/// Distance of positions that are the same, m: interpolation rounds.
const SAME: f64 = 1e-9;
/// Minimum time of a position that is held, ns: between two poses, nothing is.
const HELD_NS: i64 = 50_000_000;
/// Minimum speed of the jump after it, in the 95th percentile of all speeds: a stylus at rest starts
/// slowly, and moves on while messages are lost.
const JUMP_SPEEDS: f64 = 10.0;
/// Maximum number of speeds and of held positions that are kept.
const MOST_SPEEDS: usize = 4096;
const MOST_HELD: usize = 1024;
/// Share of the session with held positions that is sure.
const SURE_SHARE: f64 = 2e-3;

/// A position that was repeated.
#[derive(Clone, Copy, Debug)]
struct HeldPosition {
    since_ns: i64,
    time_ns: i64,
    /// to the next position, m, and in what time, ns
    jump: f64,
    jump_ns: i64,
}

/// Positions that are repeated while the stylus moves on: a tracker that lost it.
#[derive(Clone, Debug, Default)]
pub(super) struct PoseCourse {
    first_ns: Option<i64>,
    /// since when it is where, and its newest stamp
    place: Vector3<f64>,
    since_ns: i64,
    newest_ns: i64,
    /// m/ns
    speeds: Vec<f64>,
    held: Vec<HeldPosition>,
}

impl PoseCourse {
    /// - `place`: m, in O.
    pub(crate) fn push(&mut self, stamp_ns: i64, place: Vector3<f64>) {
        if self.first_ns.is_none() {
            (self.first_ns, self.place, self.since_ns) = (Some(stamp_ns), place, stamp_ns);
        } else if (place - self.place).norm() > SAME {
            let jump = (place - self.place).norm();
            let jump_ns = stamp_ns.saturating_sub(self.newest_ns).max(1);
            let time_ns = self.newest_ns.saturating_sub(self.since_ns);
            if time_ns > HELD_NS && self.held.len() < MOST_HELD {
                self.held.push(HeldPosition {
                    since_ns: self.since_ns,
                    time_ns,
                    jump,
                    jump_ns,
                });
            } else if self.speeds.len() < MOST_SPEEDS {
                self.speeds.push(jump / jump_ns as f64);
            }
            (self.place, self.since_ns) = (place, stamp_ns);
        }
        self.newest_ns = stamp_ns;
    }

    /// A tracker that repeats its position, and goes on elsewhere.
    pub(crate) fn finding(&self) -> Option<InputFinding> {
        let first_ns = self.first_ns?;
        let mut speeds = self.speeds.clone();
        speeds.sort_unstable_by(f64::total_cmp);
        let least = JUMP_SPEEDS * speeds.last().map(|_| quantile(&speeds, 0.95))?;
        let is_jump = |held: &&HeldPosition| held.jump > least * held.jump_ns as f64;
        let held = self.held.iter().filter(is_jump);
        let held: Vec<&HeldPosition> = held.collect();
        let s = |ns: i64| ns as f64 * 1e-9;
        let longest = held.iter().max_by_key(|held| held.time_ns)?;
        let whole = held.iter().map(|held| s(held.time_ns)).sum::<f64>();
        let measured = format!(
            "the pose stands still {} times for {whole:.2} s in all, and goes on elsewhere: from {:.2} s on for {:.2} s, and {:.1} mm further",
            held.len(),
            s(longest.since_ns.saturating_sub(first_ns)),
            s(longest.time_ns),
            longest.jump * 1e3
        );
        let is_sure = whole > SURE_SHARE * s(self.newest_ns.saturating_sub(first_ns));
        let remedy = "the tracker repeats its last pose when it loses sight: keep the stylus in sight, and have the driver send nothing then";
        let numbers = vec![
            FoundNumber::new("longest_held_s", s(longest.time_ns), 0.0),
            FoundNumber::new("held_s", whole, 0.0),
        ];
        Some(InputFinding::new(InputCause::PoseHeld, is_sure, measured, remedy).with(numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    /// per ms: 50 mm/s
    const STEP: f64 = 50e-6;

    /// One position per ms along x, at 50 mm/s but from 500 to 600 ms; `after`: stamp, ns, and place,
    /// m, that go on.
    fn held_at(after: (i64, f64)) -> Option<InputFinding> {
        let mut course = PoseCourse::default();
        for at in 0..600 {
            course.push(at * MS, Vector3::x() * (STEP * at.min(500) as f64));
        }
        for at in 0..400 {
            let place = after.1 + STEP * at as f64;
            course.push(after.0 + at * MS, Vector3::x() * place);
        }
        course.finding()
    }

    #[test]
    fn a_position_that_is_held_while_the_stylus_moves_on_is_found() {
        let found = held_at((600 * MS, STEP * 600.0)).unwrap();
        assert_eq!(found.cause, InputCause::PoseHeld);
        assert!(found.is_sure);
        let longest = found.numbers[0].value;
        assert!((longest - 0.099).abs() < 1e-9, "{longest}");
    }

    #[test]
    fn messages_that_are_lost_after_a_rest_are_no_held_position() {
        assert!(held_at((700 * MS, STEP * 600.0)).is_none());
    }

    #[test]
    fn a_rest_is_no_held_position() {
        assert!(held_at((600 * MS, STEP * 501.0)).is_none());
    }
}
