//! Detection of a stuck force sensor.
//!
//! No real sensor repeats a reading exactly for long: all have noise. A sensor that hangs, is
//! clipped, has lost an axis or reads nothing repeats itself, and the arm would press on any
//! obstacle. A sensor clipped or dead in one axis repeats itself along that axis alone: of the
//! sensor, the tip or the base, depending on the device that turns the force.

use super::interface::ArmState;

/// Duration of equal readings that is a fault, s: a sensor slower than 17 Hz is too slow to stop
/// by.
const STUCK: f64 = 60e-3;
/// Rounding of a force turned there and back, N.
const ROUNDING: f64 = 1e-9;

/// Frames in which forces are compared.
const AXES: [&str; 3] = ["the base", "the tip", "the flange"];

/// A stuck force reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckForce {
    /// force along each axis, N
    pub force: [f64; 3],
    /// stuck axes
    pub is_stuck: [bool; 3],
    /// frame of these axes
    pub of: &'static str,
    /// duration, ms
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

/// Duration of the present value of each force component.
#[derive(Clone, Debug, Default)]
pub(super) struct Liveness {
    /// in the axes of base, tip and flange: value, N, and stamp of its last change, ns
    seen: Option<[[(f64, i64); 3]; 3]>,
}

impl Liveness {
    /// Takes a state; returns the stuck force, if any.
    pub(crate) fn take(&mut self, state: &ArmState) -> Option<StuckForce> {
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
            // a raw force stuck in all axes is no fault here: not all arms report one
            if of == AXES[2] && is_stuck == [true; 3] {
                continue;
            }
            let ms = (now - since) as f64 * 1e-6;
            let force = force.into();
            // the frame with most stuck axes is the sensor's own
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
