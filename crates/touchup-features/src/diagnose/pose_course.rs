//! Positions of the tracker, one after the other.

use nalgebra::Vector3;

use super::finding::{FoundNumber, InputCause, InputFinding};
use touchup_geometry::numeric::quantile;

/// Distance of positions that are the same, m: interpolation rounds.
const SAME: f64 = 1e-9;
/// Minimum time of a position that is held, ns: between two poses, nothing is.
const HELD_NS: i64 = 50_000_000;
/// Minimum jump after it, in the 95th percentile of all steps: a stylus at rest starts slowly.
const JUMP_STEPS: f64 = 10.0;
/// Maximum number of steps and of held positions that are kept.
const MOST_STEPS: usize = 4096;
const MOST_HELD: usize = 1024;
/// Share of the session with held positions that is sure.
const SURE_SHARE: f64 = 2e-3;

/// A position that was repeated.
#[derive(Clone, Copy, Debug)]
struct HeldPosition {
    since_ns: i64,
    time_ns: i64,
    /// to the next position, m
    jump: f64,
}

/// Positions that are repeated while the stylus moves on: a tracker that lost it.
#[derive(Clone, Debug, Default)]
pub(super) struct PoseCourse {
    first_ns: Option<i64>,
    /// since when it is where, and its newest stamp
    place: Vector3<f64>,
    since_ns: i64,
    newest_ns: i64,
    /// m
    steps: Vec<f64>,
    held: Vec<HeldPosition>,
}

impl PoseCourse {
    /// - `place`: m, in O.
    pub(crate) fn push(&mut self, stamp_ns: i64, place: Vector3<f64>) {
        if self.first_ns.is_none() {
            (self.first_ns, self.place, self.since_ns) = (Some(stamp_ns), place, stamp_ns);
        } else if (place - self.place).norm() > SAME {
            let jump = (place - self.place).norm();
            let time_ns = self.newest_ns.saturating_sub(self.since_ns);
            if time_ns > HELD_NS && self.held.len() < MOST_HELD {
                self.held.push(HeldPosition {
                    since_ns: self.since_ns,
                    time_ns,
                    jump,
                });
            } else if self.steps.len() < MOST_STEPS {
                self.steps.push(jump);
            }
            (self.place, self.since_ns) = (place, stamp_ns);
        }
        self.newest_ns = stamp_ns;
    }

    /// A tracker that repeats its position, and goes on elsewhere.
    pub(crate) fn finding(&self) -> Option<InputFinding> {
        let first_ns = self.first_ns?;
        let mut steps = self.steps.clone();
        steps.sort_unstable_by(f64::total_cmp);
        let least = JUMP_STEPS * steps.last().map(|_| quantile(&steps, 0.95))?;
        let held = self.held.iter().filter(|held| held.jump > least);
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
