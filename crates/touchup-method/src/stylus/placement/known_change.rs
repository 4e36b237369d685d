//! What changed its place while a recording lasted, and when: taken off each pose.
//!
//! A part that moves by M from a time on takes all later touches with it: in the axes of the part as
//! it lay at first, pose_OT = M⁻¹ · pose_recorded. A tip that bends by s in T leaves the ball
//! elsewhere than recorded: pose_OT = pose_recorded · s.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::parameters;
use crate::parameters::SettingError;
use crate::words;

words! {
    /// What changes its place.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum ChangedThing {
        /// The part, or the frame of the recorded poses.
        #[default]
        Part = "part_moved",
        /// The ball on the stylus.
        Tip = "tip_bent",
    }
}

impl ChangedThing {
    /// A recorded pose with a motion of this thing taken off.
    ///
    /// - `motion`: of the part, in O; of the tip, in T.
    pub fn undone(self, motion: &Isometry3<f64>, pose_ot: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Part => motion.inv_mul(pose_ot),
            Self::Tip => pose_ot * motion,
        }
    }

    /// The recorded pose of a pose without the motion: reverses [`Self::undone`].
    pub fn redone(self, motion: &Isometry3<f64>, pose_ot: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Part => motion * pose_ot,
            Self::Tip => pose_ot * motion.inverse(),
        }
    }
}

/// The motion of a shift, m, and then a turn about a place: a rotation vector, rad.
///
/// p ↦ a + R · (p + s − a). The shift has the axes in which the part lay at first: there a plane that
/// was touched shows one direction of it, however the part turns.
pub fn motion_about(
    about: &Point3<f64>,
    shift: &Vector3<f64>,
    turn: &Vector3<f64>,
) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(*turn);
    let moved = about + turn * (shift - about.coords);
    Isometry3::from_parts(Translation3::from(moved.coords), turn)
}

/// Times of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeCourse {
    /// All at once at a stamp, ns.
    At(i64),
    /// Evenly from one stamp to another, ns.
    Between(i64, i64),
}

impl ChangeCourse {
    /// Share of the change that has happened at a stamp, ns: 0 to 1.
    pub fn share(self, stamp_ns: i64) -> f64 {
        match self {
            Self::At(at) => f64::from(stamp_ns >= at),
            Self::Between(from, to) => {
                let since = stamp_ns.saturating_sub(from) as f64;
                (since / to.saturating_sub(from).max(1) as f64).clamp(0.0, 1.0)
            }
        }
    }
}

/// Coverage factor of the expanded uncertainty of a normal.
const COVERAGE_FACTOR: f64 = 2.0;

parameters! {
    /// A change of place while a recording lasts: `changes`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct KnownChange in "changes" {
        /// What changed its place: the part or the frame of the recorded poses, or the ball on the
        /// stylus.
        cause: ChangedThing = ChangedThing::Part, "cause";
        /// Time of the change, or of its beginning, as the stamps of the poses have it.
        ///
        /// ns since the epoch of these.
        from: Option<i64> = None, "from_s" [S, 0, 9e9] like "1795212850.5";
        /// End of a slow change, which goes on evenly until then; left out: all at once.
        ///
        /// ns since the epoch of the stamps.
        to: Option<i64> = None, "to_s" [S, 0, 9e9] like "1795212910.5";
        /// Shift: of a part before it turns, in the axes of the scan; of a tip in the axes of the
        /// stylus.
        ///
        /// m, in O or T.
        shift: Vector3<f64> = [0.0; 3], "shift_mm" [MM, -1000, 1000];
        /// Turn of a part about about_mm, as a rotation vector in the axes of the scan.
        ///
        /// rad, in O.
        turn: Vector3<f64> = [0.0; 3], "turn_deg" [DEG, -180, 180];
        /// Centre of the turn, in the frame of the scan.
        ///
        /// m, in O.
        about: Point3<f64> = [0.0; 3], "about_mm" [MM, -1e6, 1e6];
        /// Standard uncertainty of the shift along each axis; the touches after the change contain it.
        ///
        /// m, in O or T.
        shift_sigma: Vector3<f64> = [0.0; 3], "shift_sigma_mm" [MM, 0, 1000];
        /// Standard uncertainty of the turn about each axis; the touches after the change contain it.
        ///
        /// rad, in O.
        turn_sigma: Vector3<f64> = [0.0; 3], "turn_sigma_deg" [DEG, 0, 180];
    }
    check KnownChange::is_consistent;
}

impl KnownChange {
    /// Refuses an end before the beginning, and a tip that turns.
    fn is_consistent(&self) -> Result<(), SettingError> {
        let seconds = |stamp_ns: i64| stamp_ns as f64 * 1e-9;
        if let (Some(from), Some(to)) = (self.from, self.to) {
            let allowed = "changes.from_s or later";
            SettingError::check("changes.to_s", seconds(to), to >= from, allowed)?;
        }
        let turns = self.turn.iter().chain(&self.turn_sigma);
        let is_tip = self.cause == ChangedThing::Tip;
        turns.copied().try_for_each(|turn| {
            let allowed = "0 for a tip: it has a shift alone";
            SettingError::check(
                "changes.turn_deg",
                turn.to_degrees(),
                !is_tip || turn == 0.0,
                allowed,
            )
        })
    }

    /// Times of the change; from the beginning on if it has no time.
    pub fn course(&self) -> ChangeCourse {
        let from = self.from.unwrap_or(i64::MIN);
        self.to
            .map_or(ChangeCourse::At(from), |to| ChangeCourse::Between(from, to))
    }

    /// Its motion up to a stamp, ns.
    pub(super) fn motion(&self, stamp_ns: i64) -> Isometry3<f64> {
        let share = self.course().share(stamp_ns);
        motion_about(&self.about, &(self.shift * share), &(self.turn * share))
    }

    /// Standard uncertainty of a touched place along its normal, m, from that of this change.
    ///
    /// A direction across the normal does not move the surface. A normal that is itself uncertain
    /// counts as far as it is beyond its expanded uncertainty: else a direction that no touch shows
    /// would make each flat surface across it uncertain.
    ///
    /// - `stamp_ns`, `point`: of the touch, m, in O. `normal`, `tilt`: unit vector, and its standard
    ///   uncertainty, rad.
    /// - `axis`: z of T, in O: across it a bent tip is as uncertain as in its worse direction.
    pub fn sigma_along(
        &self,
        stamp_ns: i64,
        point: &Point3<f64>,
        (normal, tilt): (&Vector3<f64>, f64),
        axis: &Vector3<f64>,
    ) -> f64 {
        let noise = (COVERAGE_FACTOR * tilt).powi(2);
        let share = |along: &Vector3<f64>| {
            let squared = along.dot(normal).powi(2) - noise * along.norm_squared();
            squared.max(0.0)
        };
        let variance: f64 = match self.cause {
            ChangedThing::Part => {
                let lever = point - self.about;
                let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
                let of_axes = axes.iter().enumerate().map(|(at, axis)| {
                    self.shift_sigma[at].powi(2) * share(axis)
                        + self.turn_sigma[at].powi(2) * share(&axis.cross(&lever))
                });
                of_axes.sum()
            }
            ChangedThing::Tip => {
                let across = self.shift_sigma.x.max(self.shift_sigma.y);
                let beside = (1.0 - normal.dot(axis).powi(2) - noise).max(0.0);
                share(axis) * self.shift_sigma.z.powi(2) + beside * across.powi(2)
            }
        };
        self.course().share(stamp_ns) * variance.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::vector;

    use super::*;

    const MM: f64 = 1e-3;

    fn pose() -> Isometry3<f64> {
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 0.5);
        Isometry3::from_parts(Translation3::new(0.02, -0.01, 0.03), turn)
    }

    fn off(one: &Isometry3<f64>, other: &Isometry3<f64>) -> f64 {
        let apart = (one.translation.vector - other.translation.vector).norm();
        apart + one.rotation.angle_to(&other.rotation)
    }

    /// By hand: shifted by (1, 2, 3) mm, the point 5 mm along x from (10, 0, 0) mm is (6, 2, 3) mm from
    /// there, and (−2, 6, 3) mm after a quarter turn about z.
    #[test]
    fn a_motion_shifts_and_then_turns_about_its_place() {
        let about = Point3::new(10.0 * MM, 0.0, 0.0);
        let turn = vector![0.0, 0.0, FRAC_PI_2];
        let moved = motion_about(&about, &vector![1.0 * MM, 2.0 * MM, 3.0 * MM], &turn)
            * Point3::new(15.0 * MM, 0.0, 0.0);
        assert!((moved - Point3::new(8.0 * MM, 6.0 * MM, 3.0 * MM)).norm() < 1e-15);
    }

    #[test]
    fn what_changed_is_taken_off_to_rounding() {
        let part = KnownChange {
            from: Some(1_000),
            to: Some(3_000),
            shift: vector![0.4, -0.7, 0.2] * MM,
            turn: vector![0.01, 0.02, -0.03],
            about: Point3::new(0.01, 0.02, -0.01),
            ..KnownChange::default()
        };
        let tip = KnownChange {
            cause: ChangedThing::Tip,
            turn: Vector3::zeros(),
            ..part
        };
        for (stamp_ns, share) in [
            (0, 0.0),
            (1_000, 0.0),
            (1_500, 0.25),
            (3_000, 1.0),
            (9_000, 1.0),
        ] {
            // the part takes the touch with it, by a share of its shift and turn
            let moved =
                motion_about(&part.about, &(part.shift * share), &(part.turn * share)) * pose();
            let undone = part.cause.undone(&part.motion(stamp_ns), &moved);
            assert!(off(&undone, &pose()) < 1e-15, "{stamp_ns}");
            // the ball goes on in the axes of the stylus, and its recorded place stays behind
            let mut bent = pose();
            bent.translation.vector -= bent.rotation * tip.shift * share;
            let undone = tip.cause.undone(&tip.motion(stamp_ns), &bent);
            assert!(off(&undone, &pose()) < 1e-15, "{stamp_ns}");
            for change in [part, tip] {
                let motion = change.motion(stamp_ns);
                let there = change.cause.redone(&motion, &pose());
                assert!(off(&change.cause.undone(&motion, &there), &pose()) < 1e-15);
            }
        }
    }

    /// By hand: 3 and 4 µm along the axes are 5 µm along (3, 4, 0) / 5 · … squared and summed; a turn
    /// of 1 mrad at 10 mm makes 10 µm.
    #[test]
    fn the_uncertainty_of_a_change_is_that_of_touches_after_it() {
        let part = KnownChange {
            from: Some(1_000),
            shift_sigma: vector![3e-6, 4e-6, 0.0],
            turn_sigma: vector![0.0, 1e-3, 0.0],
            ..KnownChange::default()
        };
        let axis = Vector3::z();
        let sigma = |change: &KnownChange, stamp_ns, point: [f64; 3], normal| {
            change.sigma_along(stamp_ns, &point.into(), (&normal, 0.0), &axis)
        };
        let is = |sigma: f64, expected: f64| assert!((sigma - expected).abs() < 1e-18, "{sigma}");
        is(sigma(&part, 999, [0.0; 3], Vector3::x()), 0.0);
        is(sigma(&part, 1_000, [0.0; 3], Vector3::x()), 3e-6);
        is(sigma(&part, 1_000, [0.0; 3], Vector3::y()), 4e-6);
        is(sigma(&part, 1_000, [0.01, 0.0, 0.0], Vector3::z()), 1e-5);
        let tip = KnownChange {
            cause: ChangedThing::Tip,
            shift_sigma: vector![3e-6, 4e-6, 1e-6],
            turn_sigma: Vector3::zeros(),
            ..part
        };
        is(sigma(&tip, 1_000, [0.0; 3], Vector3::z()), 1e-6);
        is(sigma(&tip, 1_000, [0.0; 3], Vector3::x()), 4e-6);
        // nothing is known along x, and a normal at 0.03 ± 0.02 does not show it
        let unknown = KnownChange {
            shift_sigma: vector![1e-2, 0.0, 4e-6],
            ..KnownChange::default()
        };
        let leaning = vector![0.03, 0.0, (1.0 - 0.03f64.powi(2)).sqrt()];
        let found = unknown.sigma_along(1, &Point3::origin(), (&leaning, 0.02), &axis);
        is(found, 4e-6 * (leaning.z.powi(2) - 0.04f64.powi(2)).sqrt());
    }

    #[test]
    fn a_tip_has_no_turn_and_an_end_comes_after_its_beginning() {
        let change = KnownChange {
            from: Some(2_000_000_000),
            to: Some(2_000_000_000),
            turn: vector![0.0, 0.1, 0.0],
            ..KnownChange::default()
        };
        assert_eq!(change.check(), Ok(()));
        let tip = KnownChange {
            cause: ChangedThing::Tip,
            ..change
        };
        let error = tip.check().unwrap_err().to_string();
        assert!(error.starts_with("changes.turn_deg is 5.7"), "{error}");
        let early = KnownChange {
            to: Some(1_000_000_000),
            ..change
        };
        let error = early.check().unwrap_err().to_string();
        assert_eq!(
            error,
            "changes.to_s is 1; it must be changes.from_s or later"
        );
    }
}
