//! The limits of an arm, which no request can exceed.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::parameters;
use crate::parameters::SettingError;

use super::bodies::{ArmBodies, Link};
use super::geometry::ArmGeometry;
use super::interface::ArmState;
use super::joints::Joints;
use super::serial_chain::Unreached;

parameters! {
    /// Bounds of every motion, from the configuration alone. A request may ask for less
    /// ([`Self::narrowed`]), never for more.
    ///
    /// By default there is no box: only the installer of the arm knows its workspace.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Limits in "robot" {
        /// Smallest corner of the box that the centre of the ball stays in, in the base of the arm;
        /// with the default the arm can be nowhere.
        ///
        /// m in B.
        lowest: Point3<f64> = [0.0; 3], "workspace_low_mm" [MM, -5000, 5000];
        /// Largest corner of it, no less than workspace_low_mm.
        ///
        /// m in B.
        highest: Point3<f64> = [0.0; 3], "workspace_high_mm" [MM, -5000, 5000];
        /// Smallest corner of the box that all of the arm but its base stays in, in the base of the
        /// arm: the table, walls; left out: nothing is known of them.
        ///
        /// m in B.
        arm_lowest: Option<Point3<f64>> = None, "arm_low_mm" [MM, -5000, 5000] like "[-2000, -2000, 0]";
        /// Largest corner of it.
        ///
        /// m in B.
        arm_highest: Option<Point3<f64>> = None, "arm_high_mm" [MM, -5000, 5000] like "[2000, 2000, 2000]";
        /// Force at the tip at which everything stops; well below that of the arm's own safety
        /// system.
        ///
        /// In N: that of a UR may be set to 50 N at the least.
        force: f64 = 15.0, "largest_force_n" [N, 0.1, 100];
        /// No motion of the tip is faster.
        ///
        /// In m/s.
        speed: f64 = 100.0, "largest_mm_per_s" [MM_PER_S, 0.1, 250];
        /// No joint turns faster: it does near a pose where the arm is nearly stuck.
        ///
        /// In rad/s.
        joint_speed: f64 = 90.0, "largest_joint_deg_per_s" [DEG_PER_S, 1, 360];
        /// Acceleration of all motions.
        ///
        /// Of the tip, m/s².
        acceleration: f64 = 500.0, "acceleration_mm_per_s2" [MM_PER_S2, 10, 5000];
        /// Deceleration of a stop at a fault or at an unexpected contact. The largest speed of
        /// every motion follows from it and from tip.stiffness_n_per_mm, so that the force at such
        /// a contact stays below largest_force_n.
        ///
        /// Of the tip, m/s².
        braking: f64 = 5000.0, "fault_stop_mm_per_s2" [MM_PER_S2, 10, 10000];
        /// Force at rest, before zeroing, above which the sensor is not zeroed: the tip would touch
        /// something.
        ///
        /// In N.
        tare: f64 = 5.0, "largest_tare_n" [N, 0.1, 100];
        /// Travel of one search at most.
        ///
        /// In m.
        search: f64 = 15.0, "search_mm" [MM, 0.5, 100];
        /// Time of one feature at most.
        ///
        /// In s.
        time: f64 = 600.0, "time_s" [S, 1, 86400];
        /// How far the arm stays from singular poses: smallest singular value of its Jacobian,
        /// lengths over its reach.
        ///
        /// The least [`ArmGeometry::dexterity`] of any pose.
        dexterity: f64 = 0.02, "least_dexterity" [ONE, 0, 1];
    }
    check Limits::is_box;
}

/// Which bound would be left, and by how much.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// Outside the box.
    #[error("({:.1} {:.1} {:.1}) mm is outside the workspace of the arm", place_mm[0], place_mm[1], place_mm[2])]
    Workspace {
        /// of the tip in B, mm
        place_mm: [f64; 3],
    },
    /// No joint angles lead there.
    #[error("the arm does not reach ({:.1} {:.1} {:.1}) mm with this orientation", place_mm[0], place_mm[1], place_mm[2])]
    Reach {
        /// of the tip in B, mm
        place_mm: [f64; 3],
    },
    /// Only joint angles beyond the range of a joint lead there.
    #[error(
        "the arm reaches ({:.1} {:.1} {:.1}) mm with this orientation only with its joint {joint} outside of {low_deg:.0}° to {high_deg:.0}°: \
         turn the part, or begin with the arm in another configuration",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    JointRange {
        /// of the tip in B, mm
        place_mm: [f64; 3],
        /// by name
        joint: Arc<str>,
        /// °
        low_deg: f64,
        /// °
        high_deg: f64,
    },
    /// Another arm than the one that is planned with.
    #[error(
        "the arm has {joints} joints, the one of robot.model has {expected}: name the arm that is there"
    )]
    OtherArm {
        /// of the arm
        joints: usize,
        /// of its model
        expected: usize,
    },
    /// Too near to a singularity.
    #[error("at ({:.1} {:.1} {:.1}) mm the arm is nearly stuck: dexterity {dexterity:.3}, {least:.3} is the least",
            place_mm[0], place_mm[1], place_mm[2])]
    Singular {
        /// of the tip in B, mm
        place_mm: [f64; 3],
        /// there
        dexterity: f64,
        /// the limit
        least: f64,
    },
    /// A straight way that its joints cannot follow.
    #[error(
        "near ({:.1} {:.1} {:.1}) mm a joint would have to turn by {turn_deg:.0}° at once: no straight way leads there with this orientation",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    Jump {
        /// of the tip in B, mm
        place_mm: [f64; 3],
        /// °
        turn_deg: f64,
    },
    /// The arm would meet itself.
    #[error("with the tip at ({:.1} {:.1} {:.1}) mm its {link} is {gap_mm:.1} mm from its {other}, {least_mm:.0} mm are the least",
            place_mm[0], place_mm[1], place_mm[2])]
    OwnLinks {
        /// of the tip in B, mm
        place_mm: [f64; 3],
        /// one of the two
        link: Link,
        /// the other
        other: Link,
        /// between them, mm
        gap_mm: f64,
        /// the limit, mm
        least_mm: f64,
    },
    /// A link would leave the box of the arm.
    #[error("with the tip at ({:.1} {:.1} {:.1}) mm its {link} leaves robot.arm_low_mm to arm_high_mm by {by_mm:.0} mm",
            place_mm[0], place_mm[1], place_mm[2])]
    ArmBox {
        /// of the tip in B, mm
        place_mm: [f64; 3],
        /// which
        link: Link,
        /// mm
        by_mm: f64,
    },
    /// A link would be in the part.
    #[error("with the tip at ({:.1} {:.1} {:.1}) mm its {link} is nearer than {least_mm:.0} mm to the part by the mesh",
            place_mm[0], place_mm[1], place_mm[2])]
    Part {
        /// of the tip in B, mm
        place_mm: [f64; 3],
        /// which
        link: Link,
        /// the limit, mm
        least_mm: f64,
    },
    /// It moves too fast.
    #[error("the tip moves with {mm_per_s:.0} mm/s, over the limit of {limit_mm_per_s:.0} mm/s")]
    Speed {
        /// mm/s
        mm_per_s: f64,
        /// mm/s
        limit_mm_per_s: f64,
    },
    /// A joint turns too fast.
    #[error(
        "joint {joint} turns with {deg_per_s:.0}°/s, over the limit of {limit_deg_per_s:.0}°/s"
    )]
    JointSpeed {
        /// from 1 on, at the base
        joint: usize,
        /// °/s
        deg_per_s: f64,
        /// °/s
        limit_deg_per_s: f64,
    },
    /// More than the configuration allows.
    #[error(
        "{what} of {asked} {unit} is beyond the configured {limit} {unit}: a request can only ask for less"
    )]
    Wider {
        /// which one
        what: &'static str,
        /// in the unit
        asked: f64,
        /// in the unit
        limit: f64,
        /// of both
        unit: &'static str,
    },
    /// No number, or none that can be.
    #[error("{what} of {asked} {unit} is no limit: give a number above zero")]
    NoLimit {
        /// which one
        what: &'static str,
        /// in the unit
        asked: f64,
        /// of it
        unit: &'static str,
    },
    /// Too little for a contact.
    #[error("a force of {asked_n} N feels no surface: a touch takes more than {least_n} N")]
    TooSoft {
        /// N
        asked_n: f64,
        /// N
        least_n: f64,
    },
    /// Too hard.
    #[error("{force_n:.1} N at the tip, over the limit of {limit_n:.1} N")]
    Force {
        /// N
        force_n: f64,
        /// N
        limit_n: f64,
    },
}

/// The limits of a request; `None`: as configured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Narrower {
    /// N
    pub force: Option<f64>,
    /// m/s
    pub speed: Option<f64>,
    /// m
    pub search: Option<f64>,
    /// s
    pub time: Option<f64>,
}

impl Limits {
    fn is_box(&self) -> Result<(), SettingError> {
        self.lowest
            .iter()
            .zip(self.highest.iter())
            .try_for_each(|(low, high)| {
                let allowed = "robot.workspace_low_mm to 5000 mm";
                SettingError::check("robot.workspace_high_mm", high * 1e3, high >= low, allowed)
            })?;
        let (Some(lowest), Some(highest)) = (self.arm_lowest, self.arm_highest) else {
            return Ok(());
        };
        lowest
            .iter()
            .zip(highest.iter())
            .try_for_each(|(low, high)| {
                SettingError::check(
                    "robot.arm_high_mm",
                    high * 1e3,
                    high > low,
                    "above robot.arm_low_mm",
                )
            })
    }

    /// These limits, tightened by a request.
    ///
    /// # Errors
    /// [`LimitError::Wider`], [`LimitError::NoLimit`].
    pub fn narrowed(&self, by: &Narrower) -> Result<Self, LimitError> {
        let narrower = |what, asked: Option<f64>, limit: f64, unit, per_si: f64| match asked {
            Some(asked) if asked.is_nan() || asked <= 0.0 => Err(LimitError::NoLimit {
                what,
                asked: asked * per_si,
                unit,
            }),
            Some(asked) if asked > limit => Err(LimitError::Wider {
                what,
                asked: asked * per_si,
                limit: limit * per_si,
                unit,
            }),
            asked => Ok(asked.unwrap_or(limit)),
        };
        Ok(Self {
            force: narrower("a force", by.force, self.force, "N", 1.0)?,
            speed: narrower("a speed", by.speed, self.speed, "mm/s", 1e3)?,
            search: narrower("a search", by.search, self.search, "mm", 1e3)?,
            time: narrower("a time", by.time, self.time, "s", 1.0)?,
            ..self.clone()
        })
    }

    /// Whether the tip may be at a place of B.
    ///
    /// # Errors
    /// [`LimitError::Workspace`]; also for a place that is no number.
    pub(crate) fn check_place(&self, place: &Vector3<f64>) -> Result<(), LimitError> {
        let is_in = (0..3).all(|i| place[i] >= self.lowest[i] && place[i] <= self.highest[i]);
        if is_in {
            Ok(())
        } else {
            Err(LimitError::Workspace {
                place_mm: millimetres(place),
            })
        }
    }

    /// Whether the arm may have its tip at a pose in B; returns joints for it, the nearest to those
    /// that it has.
    ///
    /// - `pose_ft`: the tip in the flange.
    ///
    /// # Errors
    /// [`LimitError::Workspace`], [`LimitError::Reach`], [`LimitError::JointRange`],
    /// [`LimitError::OtherArm`], [`LimitError::Singular`], [`LimitError::OwnLinks`],
    /// [`LimitError::ArmBox`].
    pub fn check_pose(
        &self,
        geometry: &ArmGeometry,
        pose_ft: &Isometry3<f64>,
        pose_bt: &Isometry3<f64>,
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let place = pose_bt.translation.vector;
        self.check_place(&place)?;
        if near.len() != geometry.joint_count() {
            return Err(LimitError::OtherArm {
                joints: near.len(),
                expected: geometry.joint_count(),
            });
        }
        let place_mm = millimetres(&place);
        let joints = geometry
            .nearest(&(pose_bt * pose_ft.inverse()), near)
            .map_err(|unreached| match unreached {
                Unreached::Pose => LimitError::Reach { place_mm },
                Unreached::Range {
                    joint,
                    range: [low, high],
                } => LimitError::JointRange {
                    place_mm,
                    joint,
                    low_deg: low.to_degrees(),
                    high_deg: high.to_degrees(),
                },
            })?;
        let dexterity = geometry.dexterity(&joints);
        if dexterity < self.dexterity {
            return Err(LimitError::Singular {
                place_mm,
                dexterity,
                least: self.dexterity,
            });
        }
        self.check_links(&ArmBodies::new(geometry, &joints, pose_ft), place_mm)?;
        Ok(joints)
    }

    /// Whether its links keep clear of each other, and in the box of the arm.
    fn check_links(&self, bodies: &ArmBodies<'_>, place_mm: [f64; 3]) -> Result<(), LimitError> {
        let (link, other, gap) = bodies.nearest_pair();
        if gap < LINK_GAP {
            return Err(LimitError::OwnLinks {
                place_mm,
                link,
                other,
                gap_mm: gap * 1e3,
                least_mm: LINK_GAP * 1e3,
            });
        }
        // the base is bolted to what limits the others
        for (link, capsule) in bodies.links().filter(|(link, _)| **link != Link::Base) {
            let beyond = |end: &Point3<f64>| {
                let low = self
                    .arm_lowest
                    .map(|low| (low - end).max() + capsule.radius);
                let high = self
                    .arm_highest
                    .map(|high| (end - high).max() + capsule.radius);
                low.into_iter()
                    .chain(high)
                    .fold(f64::NEG_INFINITY, f64::max)
            };
            let by = capsule
                .ends
                .iter()
                .map(beyond)
                .fold(f64::NEG_INFINITY, f64::max);
            if by > 0.0 {
                return Err(LimitError::ArmBox {
                    place_mm,
                    link: link.clone(),
                    by_mm: by * 1e3,
                });
            }
        }
        Ok(())
    }

    /// The deceleration of a stop at a fault, m/s²: no stop is softer than that of any motion.
    pub(crate) fn fault_stop(&self) -> f64 {
        self.braking.max(self.acceleration)
    }

    /// Whether an arm is within them now.
    ///
    /// # Errors
    /// [`LimitError::Workspace`], [`LimitError::Force`].
    pub(crate) fn check_state(&self, state: &ArmState) -> Result<(), LimitError> {
        self.check_place(&state.pose_bt.translation.vector)?;
        let force_n = state.wrench_b.force.norm();
        // what is no number is over every limit
        if force_n <= self.force {
            Ok(())
        } else {
            Err(LimitError::Force {
                force_n,
                limit_n: self.force,
            })
        }
    }
}

/// Links keep so far from each other, m: the radius of a probe, and what capsules leave out.
const LINK_GAP: f64 = 10e-3;

pub(crate) fn millimetres(place: &Vector3<f64>) -> [f64; 3] {
    (place * 1e3).into()
}
