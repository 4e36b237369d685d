//! The limits of an arm, which no request can exceed.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use touchup_method::parameters;
use touchup_method::parameters::SettingError;

use super::bodies::{ArmBodies, Link};
use super::geometry::ArmGeometry;
use super::interface::ArmState;
use super::joints::Joints;
use super::serial_chain::IkFailure;

parameters! {
    /// Bounds of every motion, from the configuration alone. A request may ask for less
    /// ([`Self::narrowed`]), never for more.
    ///
    /// By default there is no box: only the installer of the arm knows its workspace.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Limits in "robot" {
        /// Lowest corner of the box that the centre of the ball must not leave, in the base of the
        /// arm; the default box is a single point, so the arm cannot move.
        ///
        /// m in B.
        lowest: Point3<f64> = [0.0; 3], "workspace_low_mm" [MM, -5000, 5000];
        /// Highest corner of the box that the centre of the ball must not leave, in the base of the
        /// arm; no less than workspace_low_mm.
        ///
        /// m in B.
        highest: Point3<f64> = [0.0; 3], "workspace_high_mm" [MM, -5000, 5000];
        /// Lowest corner of the box that the arm except its base must not leave, bounded by table and
        /// walls for example, in the base of the arm; left out: no such bound.
        ///
        /// m in B.
        arm_lowest: Option<Point3<f64>> = None, "arm_low_mm" [MM, -5000, 5000] like "[-2000, -2000, 0]";
        /// Highest corner of the box that the arm except its base must not leave, in the base of
        /// the arm; left out: no such bound.
        ///
        /// m in B.
        arm_highest: Option<Point3<f64>> = None, "arm_high_mm" [MM, -5000, 5000] like "[2000, 2000, 2000]";
        /// Force at the tip that stops every motion; well below the limit of the arm's own safety
        /// system.
        ///
        /// In N; the limit of a UR's safety system is at least 50 N.
        force: f64 = 15.0, "largest_force_n" [N, 0.1, 100];
        /// Largest speed of the tip.
        ///
        /// In m/s.
        speed: f64 = 100.0, "largest_mm_per_s" [MM_PER_S, 0.1, 250];
        /// Largest speed of a joint; joints turn fast near singular poses.
        ///
        /// In rad/s.
        joint_speed: f64 = 90.0, "largest_joint_deg_per_s" [DEG_PER_S, 1, 360];
        /// Acceleration of the tip in every motion.
        ///
        /// Of the tip, m/s².
        acceleration: f64 = 500.0, "acceleration_mm_per_s2" [MM_PER_S2, 10, 5000];
        /// Deceleration of the tip in a stop at a fault or at an unexpected contact. With
        /// tip.stiffness_n_per_mm it limits the speed of every motion, so that the force at such a
        /// contact stays below largest_force_n.
        ///
        /// Of the tip, m/s².
        braking: f64 = 5000.0, "fault_stop_mm_per_s2" [MM_PER_S2, 10, 10000];
        /// Largest force at rest at which the sensor may be zeroed; a larger one means contact.
        ///
        /// In N.
        tare: f64 = 5.0, "largest_tare_n" [N, 0.1, 100];
        /// Largest travel of one search.
        ///
        /// In m.
        search: f64 = 15.0, "search_mm" [MM, 0.5, 100];
        /// Longest time for one feature.
        ///
        /// In s.
        time: f64 = 600.0, "time_s" [S, 1, 86400];
        /// Smallest distance of the arm from singular poses: smallest singular value of its
        /// Jacobian, lengths over its reach.
        ///
        /// The least [`ArmGeometry::dexterity`] of any pose.
        dexterity: f64 = 0.02, "least_dexterity" [ONE, 0, 1];
    }
    check Limits::is_box;
}

/// Exceeded bound, and its excess.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// Outside the workspace.
    #[error("({:.1} {:.1} {:.1}) mm is outside the workspace of the arm", place_mm[0], place_mm[1], place_mm[2])]
    Workspace {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
    },
    /// A pose without joint angles.
    #[error("the arm does not reach ({:.1} {:.1} {:.1}) mm with this orientation", place_mm[0], place_mm[1], place_mm[2])]
    Reach {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
    },
    /// A pose with joint angles only beyond the range of a joint.
    #[error(
        "the arm reaches ({:.1} {:.1} {:.1}) mm with this orientation only with its joint {joint} outside of {low_deg:.0}° to {high_deg:.0}°: \
         turn the part, or begin with the arm in another configuration",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    JointRange {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
        /// name of the joint
        joint: Arc<str>,
        /// lower end of its range, °
        low_deg: f64,
        /// upper end of its range, °
        high_deg: f64,
    },
    /// Another arm than the planned one.
    #[error(
        "the arm has {joints} joints, the one of robot.model has {expected}: name the arm that is there"
    )]
    OtherArm {
        /// joints of the arm
        joints: usize,
        /// joints of its model
        expected: usize,
    },
    /// Too near a singularity.
    #[error("at ({:.1} {:.1} {:.1}) mm the arm is nearly stuck: dexterity {dexterity:.3}, {least:.3} is the least",
            place_mm[0], place_mm[1], place_mm[2])]
    Singular {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
        /// dexterity there
        dexterity: f64,
        /// its limit
        least: f64,
    },
    /// A straight path that the joints cannot follow.
    #[error(
        "near ({:.1} {:.1} {:.1}) mm a joint would have to turn by {turn_deg:.0}° at once: no straight way leads there with this orientation",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    Jump {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
        /// turn of the joint, °
        turn_deg: f64,
    },
    /// A collision of the arm with itself.
    #[error("with the tip at ({:.1} {:.1} {:.1}) mm its {link} is {gap_mm:.1} mm from its {other}, {least_mm:.0} mm are the least",
            place_mm[0], place_mm[1], place_mm[2])]
    OwnLinks {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
        /// one link
        link: Link,
        /// the other link
        other: Link,
        /// gap between them, mm
        gap_mm: f64,
        /// the limit, mm
        least_mm: f64,
    },
    /// A link would leave the box of the arm.
    #[error("with the tip at ({:.1} {:.1} {:.1}) mm its {link} leaves robot.arm_low_mm to arm_high_mm by {by_mm:.0} mm",
            place_mm[0], place_mm[1], place_mm[2])]
    ArmBox {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
        /// the link
        link: Link,
        /// distance beyond the box, mm
        by_mm: f64,
    },
    /// A link would be in the part.
    #[error("with the tip at ({:.1} {:.1} {:.1}) mm its {link} is nearer than {least_mm:.0} mm to the part by the mesh",
            place_mm[0], place_mm[1], place_mm[2])]
    Part {
        /// position of the tip in B, mm
        place_mm: [f64; 3],
        /// the link
        link: Link,
        /// the limit, mm
        least_mm: f64,
    },
    /// A tip that moves too fast.
    #[error("the tip moves with {mm_per_s:.0} mm/s, over the limit of {limit_mm_per_s:.0} mm/s")]
    Speed {
        /// speed of the tip, mm/s
        mm_per_s: f64,
        /// limit, mm/s
        limit_mm_per_s: f64,
    },
    /// A joint that turns too fast.
    #[error(
        "joint {joint} turns with {deg_per_s:.0}°/s, over the limit of {limit_deg_per_s:.0}°/s"
    )]
    JointSpeed {
        /// number of the joint, from 1 at the base
        joint: usize,
        /// turn rate, °/s
        deg_per_s: f64,
        /// limit, °/s
        limit_deg_per_s: f64,
    },
    /// A request beyond the configuration.
    #[error(
        "{what} of {asked} {unit} is beyond the configured {limit} {unit}: a request can only ask for less"
    )]
    Wider {
        /// name of the bound
        what: &'static str,
        /// requested value, in the unit
        asked: f64,
        /// configured value, in the unit
        limit: f64,
        /// unit of both
        unit: &'static str,
    },
    /// A requested bound that is no number above zero.
    #[error("{what} of {asked} {unit} is no limit: give a number above zero")]
    NoLimit {
        /// name of the bound
        what: &'static str,
        /// requested value, in the unit
        asked: f64,
        /// unit of the value
        unit: &'static str,
    },
    /// Too little force for a contact.
    #[error("a force of {asked_n} N feels no surface: a touch takes more than {least_n} N")]
    TooSoft {
        /// requested force, N
        asked_n: f64,
        /// force that it must exceed, N
        least_n: f64,
    },
    /// Too much force at the tip.
    #[error("{force_n:.1} N at the tip, over the limit of {limit_n:.1} N")]
    Force {
        /// force, N
        force_n: f64,
        /// limit, N
        limit_n: f64,
    },
}

/// The limits of a request; `None`: as configured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RequestLimits {
    /// largest force, N
    pub force: Option<f64>,
    /// largest speed, m/s
    pub speed: Option<f64>,
    /// longest search, m
    pub search: Option<f64>,
    /// longest time, s
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
    pub fn narrowed(&self, by: &RequestLimits) -> Result<Self, LimitError> {
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

    /// Checks a position of the tip in B.
    ///
    /// # Errors
    /// [`LimitError::Workspace`]; also for a position that is no number.
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

    /// Checks a pose of the tip in B; returns its joints, nearest to `near`.
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
                IkFailure::Pose => LimitError::Reach { place_mm },
                IkFailure::Range {
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

    /// Checks that the links keep clear of each other, and in the box of the arm.
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
        // the base stands on the table that limits the others
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

    /// Deceleration of a stop at a fault, m/s²: no softer than any motion's.
    pub(crate) fn fault_stop(&self) -> f64 {
        self.braking.max(self.acceleration)
    }

    /// Checks that an arm is within its limits now.
    ///
    /// # Errors
    /// [`LimitError::Workspace`], [`LimitError::Force`].
    pub(crate) fn check_state(&self, state: &ArmState) -> Result<(), LimitError> {
        self.check_place(&state.pose_bt.translation.vector)?;
        let force_n = state.wrench_b.force.norm();
        // NaN is over every limit
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

/// Minimum gap between links, m: the radius of a probe, and the volume beyond the capsules.
const LINK_GAP: f64 = 10e-3;

pub(crate) fn millimetres(place: &Vector3<f64>) -> [f64; 3] {
    (place * 1e3).into()
}
