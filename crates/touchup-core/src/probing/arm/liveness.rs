//! Whether a force sensor senses.
//!
//! No reading of a real sensor is exactly the one before it for long: noise is in all of them. One
//! that hangs, is clipped, has lost an axis or reads nothing repeats itself, and the arm would press
//! on whatever it meets. If it is clipped or dead in one axis that axis alone repeats itself: of
//! the sensor, of the tip or of the base, whoever turns the force.

use super::interface::ArmState;

/// Readings that are equal for so long are no readings, s: a sensor that is slower than 17 Hz is
/// too slow to stop by.
const STUCK: f64 = 60e-3;
/// Rounding of a force that turns there and back, N.
const ROUNDING: f64 = 1e-9;

/// The axes that forces are seen in.
const AXES: [&str; 3] = ["the base", "the tip", "the flange"];

/// A force that repeats itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckForce {
    /// along each axis, N
    pub force: [f64; 3],
    /// the axes along which it repeats itself
    pub is_stuck: [bool; 3],
    /// whose axes these are
    pub of: &'static str,
    /// for so long, ms
    pub ms: f64,
}

impl std::fmt::Display for StuckForce {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { force, of, ms, .. } = self;
        let [x, y, z] = force;
        if *force == [0.0; 3] {
            return write!(f, "reads nothing but 0 N for {ms:.0} ms");
        }
        if self.is_stuck == [true; 3] {
            return write!(f, "is frozen at ({x:.2} {y:.2} {z:.2}) N for {ms:.0} ms");
        }
        let stuck = ["x", "y", "z"].into_iter().zip(force).zip(self.is_stuck);
        let stuck = stuck.filter(|(_, is_stuck)| *is_stuck);
        let named = stuck.map(|((axis, force), _)| format!("{axis} at {force:.2} N"));
        let named = named.collect::<Vec<_>>().join(" and ");
        write!(
            f,
            "is clipped or dead: along {named} in the axes of {of} it has not changed for {ms:.0} ms, while the others did"
        )
    }
}

/// How long each component of the force has been what it is.
#[derive(Clone, Debug, Default)]
pub(super) struct Liveness {
    /// in the axes of base, tip and flange: the value, N, and since when, ns
    seen: Option<[[(f64, i64); 3]; 3]>,
}

impl Liveness {
    /// Takes a state; the force that repeats itself.
    pub fn take(&mut self, state: &ArmState) -> Option<StuckForce> {
        let (force_b, now) = (state.wrench_b.force, state.stamp_ns);
        let force_t = state.pose_bt.rotation.inverse() * force_b;
        let forces = [force_b, force_t, state.raw_wrench_f.force];
        let seen = self
            .seen
            .get_or_insert(forces.map(|force| <[f64; 3]>::from(force).map(|n| (n, now))));
        let mut stuck: Option<StuckForce> = None;
        for ((seen, force), of) in seen.iter_mut().zip(forces).zip(AXES) {
            for ((held, since), now_n) in seen.iter_mut().zip(force.iter()) {
                if (now_n - *held).abs() > ROUNDING {
                    (*held, *since) = (*now_n, now);
                }
            }
            let is_stuck = seen.map(|(_, since)| (now - since) as f64 * 1e-9 >= STUCK);
            let since = seen.iter().zip(is_stuck).filter(|(_, is_stuck)| *is_stuck);
            let Some(since) = since.map(|((_, since), _)| *since).max() else {
                continue;
            };
            // whether the whole force hangs the one that the arm stops by says: not all arms tell a raw one
            if of == AXES[2] && is_stuck == [true; 3] {
                continue;
            }
            let ms = (now - since) as f64 * 1e-6;
            let force = force.into();
            // the axes that most of them are in are its own
            let count = |is_stuck: [bool; 3]| is_stuck.iter().filter(|is_stuck| **is_stuck).count();
            if stuck.is_some_and(|before| count(before.is_stuck) >= count(is_stuck)) {
                continue;
            }
            stuck = Some(StuckForce {
                force,
                is_stuck,
                of,
                ms,
            });
        }
        stuck
    }
}
