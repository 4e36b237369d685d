//! What an arm must never leave, whatever it is asked for.

use nalgebra::{Isometry3, Point3, Vector3};

use super::arm::ArmState;
use super::kinematics::{Joints, UrGeometry};

/// Bounds of every motion, from the configuration alone. A request may ask for less ([`Self::narrowed`]), never for more.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Smallest corner of the box that the tip stays in, m in B.
    pub lowest: Point3<f64>,
    /// Largest corner of it, m in B.
    pub highest: Point3<f64>,
    /// Force of the part on the tip, N.
    pub force: f64,
    /// Of the tip, m/s.
    pub speed: f64,
    /// Of the tip, m/s².
    pub acceleration: f64,
    /// Travel of one search, m.
    pub search: f64,
    /// Time of one order, s.
    pub time: f64,
    /// The least [`UrGeometry::dexterity`] of any pose.
    pub dexterity: f64,
}

impl Default for Limits {
    /// No box: where the arm may be is known by who mounted it.
    fn default() -> Self {
        Self {
            lowest: Point3::origin(),
            highest: Point3::origin(),
            // well below the 50 N at which the safety system of a UR may be set at the least
            force: 15.0,
            speed: 0.1,
            acceleration: 0.5,
            search: 15e-3,
            time: 600.0,
            dexterity: 0.02,
        }
    }
}

/// Which bound would be left, and by how much.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
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
    /// Too near to where the arm cannot move some way.
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
    /// More than the configuration allows.
    #[error("{what} of {asked} {unit} is beyond the configured {limit} {unit}: a request can only ask for less")]
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
    /// Too little to feel anything.
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

/// What a request asks for; `None`: as configured.
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
    /// These limits with what a request asks for.
    ///
    /// # Errors
    /// [`LimitError::Wider`], [`LimitError::NoLimit`].
    pub fn narrowed(&self, by: &Narrower) -> Result<Self, LimitError> {
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
    pub fn check_place(&self, place: &Vector3<f64>) -> Result<(), LimitError> {
        let is_in = (0..3).all(|i| place[i] >= self.lowest[i] && place[i] <= self.highest[i]);
        if is_in { Ok(()) } else { Err(LimitError::Workspace { place_mm: millimetres(place) }) }
    }

    /// Whether the arm may have its tip at a pose in B; returns joints for it, the nearest to those that it has.
    ///
    /// - `pose_ft`: the tip in the flange.
    ///
    /// # Errors
    /// [`LimitError::Workspace`], [`LimitError::Reach`], [`LimitError::Singular`].
    pub fn check_pose(
        &self,
        geometry: &UrGeometry,
        pose_ft: &Isometry3<f64>,
        pose_bt: &Isometry3<f64>,
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let place = pose_bt.translation.vector;
        self.check_place(&place)?;
        let place_mm = millimetres(&place);
        let solutions = geometry.inverse(&(pose_bt * pose_ft.inverse()), near);
        let way = |joints: &Joints| joints.iter().zip(near).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let nearest = solutions.into_iter().min_by(|a, b| way(a).total_cmp(&way(b)));
        let joints = nearest.ok_or(LimitError::Reach { place_mm })?;
        let dexterity = geometry.dexterity(&joints);
        if dexterity < self.dexterity {
            return Err(LimitError::Singular { place_mm, dexterity, least: self.dexterity });
        }
        Ok(joints)
    }

    /// Whether an arm is within them now.
    ///
    /// # Errors
    /// [`LimitError::Workspace`], [`LimitError::Force`].
    pub fn check_state(&self, state: &ArmState) -> Result<(), LimitError> {
        self.check_place(&state.pose_bt.translation.vector)?;
        let force_n = state.wrench_b.force.norm();
        // what is no number is over every limit
        if force_n <= self.force { Ok(()) } else { Err(LimitError::Force { force_n, limit_n: self.force }) }
    }
}

fn narrower(
    what: &'static str,
    asked: Option<f64>,
    limit: f64,
    unit: &'static str,
    per_si: f64,
) -> Result<f64, LimitError> {
    match asked {
        None => Ok(limit),
        Some(asked) if asked.is_nan() || asked <= 0.0 => Err(LimitError::NoLimit { what, asked: asked * per_si, unit }),
        Some(asked) if asked > limit => {
            Err(LimitError::Wider { what, asked: asked * per_si, limit: limit * per_si, unit })
        }
        Some(asked) => Ok(asked),
    }
}

fn millimetres(place: &Vector3<f64>) -> [f64; 3] {
    (place * 1e3).into()
}
