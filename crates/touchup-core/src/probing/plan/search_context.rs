//! The request of a search, the touches that it plans, their results, and the frame of the search.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::arm_uncertainty::ArmUncertainty;
use super::outline::Outline;
use crate::features::fit::Observation;
use crate::features::{End, Kind};
use crate::{names, parameters};

parameters! {
    /// What is known and wanted of a flagged feature.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PatternParams in "robot" {
        /// Of the ball, m.
        ball_radius: f64 = 1.5e-3;
        /// The flag is off by no more than this, m; of a plane or an unknown region: so far around
        /// the flag is touched.
        flag_radius: f64 = 3e-3;
        /// Distance of the ball from the surface where a search begins.
        ///
        /// In m.
        clearance: f64 = 3.0, "clearance_mm" [MM, 0.5, 50];
        /// How deep the centre of the ball is let into a hole.
        ///
        /// In m.
        depth: f64 = 5.0, "depth_mm" [MM, 0, 100];
        /// The number that touches are chosen for.
        quantity: Quantity = Quantity::All;
        /// Wanted standard deviation of it, m, or rad of an axis.
        sigma: f64 = 4e-6;
        /// Touches of a feature at most.
        budget: usize = 39, "touches" [TOUCHES, 1, 1e4];
        /// Standard deviation of one touch beside that of its own curve: the repeatability of arm
        /// and probe (`touchup check`).
        ///
        /// In m. The maker of a UR5e states ±0.03 mm.
        touch_sigma: f64 = 0.03, "touch_sigma_mm" [MM, 1e-5, 1];
        /// Standard uncertainty with which the walls of holes, slots and bosses are perpendicular
        /// to the surface around them, in each of two directions, unless their touches say
        /// otherwise.
        ///
        /// In rad. 0.13° is 0.4 mm in 100 mm, the general tolerance K of ISO 2768-2, taken as a
        /// uniform distribution.
        square: f64 = 0.13, "square_sigma_deg" [DEG, 1e-3, 20];
    }
    with {
        /// What all touches have in common.
        shared: ArmUncertainty,
    }
}

names! {
    /// A number of a feature.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Quantity {
        /// place and sizes: every length
        #[default]
        All = "every length",
        /// where it is
        Position = "position",
        /// the direction of its axis, of an edge its line, of a plane its normal; rad
        Axis = "axis",
        /// of a hole or boss
        Diameter = "diameter",
        /// of a slot
        Length = "length",
        /// of a slot
        Width = "width",
    }
}

impl Quantity {
    /// Whether a feature has it.
    pub fn is_of(self, kind: Option<Kind>) -> bool {
        match self {
            Self::All => true,
            Self::Position | Self::Axis => kind.is_some(),
            Self::Diameter => matches!(kind, Some(Kind::Hole | Kind::Boss)),
            Self::Length | Self::Width => kind == Some(Kind::Slot),
        }
    }
}

/// Touches of one surface differ by no more than so many standard deviations: the difference of two
/// by 4 of its own.
const BEYOND: f64 = 5.7;

impl PatternParams {
    /// The part of the wanted number of a feature that no touch reduces: the largest of its
    /// numbers; m, or rad of an axis.
    ///
    /// - `out`: of the surface, unit vector.
    pub(super) fn shared_part(
        &self,
        kind: Option<Kind>,
        place: &Point3<f64>,
        out: &Vector3<f64>,
    ) -> f64 {
        let Some(kind) = kind else { return 0.0 };
        let (position, size) = (
            self.shared.position(kind, place, out),
            2.0 * self.shared.radius,
        );
        match self.quantity {
            Quantity::Axis => self.shared.turn,
            Quantity::Diameter | Quantity::Width | Quantity::Length => size,
            Quantity::All if !matches!(kind, Kind::Plane | Kind::Edge) => position.max(size),
            Quantity::Position | Quantity::All => position,
        }
    }

    /// A difference of heights that is no scatter of touches, m.
    ///
    /// - `least`: what it is for an arm without scatter, m.
    pub(super) fn beyond(&self, least: f64) -> f64 {
        least.max(BEYOND * self.touch_sigma)
    }
}

/// A planned touch, in O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchPlan {
    /// Above the part: from here the path to `from` is straight and free.
    pub entry: Point3<f64>,
    /// Centre of the ball where the search begins.
    pub from: Point3<f64>,
    /// Along which it is searched.
    pub direction: Unit<Vector3<f64>>,
    /// How far, m.
    pub search: f64,
    /// Where the surface will be, as predicted from the touches so far.
    pub expected: Option<Expected>,
}

impl TouchPlan {
    /// Centre of the ball where a search without contact ends.
    pub fn end(&self) -> Point3<f64> {
        self.from + self.direction.into_inner() * self.search
    }
}

/// How far from where a search begins the surface is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// of the ball's centre, m
    pub travel: f64,
    /// standard deviation, m
    pub sigma: f64,
}

/// The result of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchResult {
    /// The ball was stopped.
    At {
        /// its centre, m in O
        centre: Point3<f64>,
        /// standard deviation along the direction, m
        sigma: f64,
    },
    /// No contact along the whole search.
    Nothing,
    /// A contact at an unknown place.
    Unclear,
}

/// What is asked of the numbers of a feature where a decision is the goal: the standard deviation
/// of each that is open, m; `None`: nothing is asked of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct OpenNumbers {
    /// of the place, along each axis
    pub place: Option<f64>,
    /// of the diameter or width
    pub size: Option<f64>,
    pub length: Option<f64>,
}

/// State of the search for a feature.
#[derive(Clone, Debug)]
pub(super) struct SearchContext {
    pub params: PatternParams,
    /// z out of the part, origin at the flag on the surface; maps the frame F of the search to O
    pub pose_of: Isometry3<f64>,
    /// of its z from the normal of the surface, standard deviation in each of two directions, rad
    pub lean: f64,
    /// of the surface in F
    pub height: f64,
    pub touches: usize,
    /// what touches are chosen for in place of the wanted number, once a decision is the goal and
    /// the shape is known
    pub open: Option<OpenNumbers>,
    /// of the scan, seen along the normal at the flag
    pub outline: Arc<Outline>,
    /// places of the surface, in O, that were not touched, for the scan has no part there
    pub left_out: Vec<Point3<f64>>,
}

/// A touch from above goes down the normal within this (cosine).
const DOWN: f64 = 0.99;

impl SearchContext {
    pub fn is_down(&self, planned: &TouchPlan) -> bool {
        planned.direction.dot(&self.out()) < -DOWN
    }

    /// Whether a touch would go down beside the part.
    pub fn is_beside(&self, planned: &TouchPlan) -> bool {
        self.is_down(planned) && !self.outline.is_part(&planned.from, 0.0)
    }

    /// Notes that a place of F is not touched.
    pub fn leave_out(&mut self, place: &Point3<f64>) {
        self.left_out
            .push(self.pose_of * Point3::new(place.x, place.y, self.height));
    }

    /// Whether all of the ball is over the part at a place of F.
    pub fn is_over_part(&self, place: &Point3<f64>) -> bool {
        self.outline
            .is_part(&(self.pose_of * place), self.params.ball_radius)
    }

    /// One of several places of F that are touched from above; where it is beside the part, the
    /// place of others that is over it and farthest from all that are touched.
    pub fn over_part(
        &mut self,
        at: usize,
        wanted: &[Point3<f64>],
        others: &[Point3<f64>],
    ) -> Point3<f64> {
        let mut taken: Vec<_> = wanted
            .iter()
            .filter(|place| self.is_over_part(place))
            .copied()
            .collect();
        for (index, place) in wanted.iter().enumerate().take(at + 1) {
            let near = |p: &Point3<f64>| {
                taken
                    .iter()
                    .map(|t| (t - p).norm())
                    .fold(f64::INFINITY, f64::min)
            };
            let other = others
                .iter()
                .filter(|p| self.is_over_part(p) && near(p) > self.params.ball_radius);
            let farthest = other.max_by(|a, b| near(a).total_cmp(&near(b))).copied();
            match farthest.filter(|_| !self.is_over_part(place)) {
                Some(farthest) if index == at => {
                    self.leave_out(place);
                    return farthest;
                }
                other => taken.extend(other),
            }
        }
        wanted[at]
    }

    /// One of [`AROUND`] places of F around a middle, or elsewhere around it where that one is
    /// beside the part.
    ///
    /// - `first`: so many of their steps from x to the first; `away`: from the middle, m.
    pub fn around(
        &mut self,
        at: usize,
        first: f64,
        middle: &Point3<f64>,
        away: f64,
    ) -> Point3<f64> {
        let place =
            |at: usize, count: usize| middle + toward((at as f64 + first) / count as f64) * away;
        let [wanted, others] = [AROUND, DIRECTIONS]
            .map(|count| (0..count).map(|at| place(at, count)).collect::<Vec<_>>());
        self.over_part(at, &wanted, &others)
    }

    pub fn out(&self) -> Vector3<f64> {
        self.pose_of.rotation * Vector3::z()
    }

    pub fn in_f(&self, point: &Point3<f64>) -> Point3<f64> {
        self.pose_of.inverse_transform_point(point)
    }

    /// Centre of a ball that is clear of the surface.
    pub fn clear(&self) -> f64 {
        self.height + self.params.ball_radius + self.params.clearance
    }

    /// Down at a place of F.
    pub fn down(&self, place: &Point3<f64>, search: f64) -> TouchPlan {
        let from = self.pose_of * Point3::new(place.x, place.y, self.clear());
        TouchPlan {
            entry: from,
            from,
            direction: Unit::new_unchecked(-self.out()),
            search,
            expected: None,
        }
    }

    /// From a place of F, at a depth below the surface, along a direction of F.
    pub fn sideways(
        &self,
        place: &Point3<f64>,
        depth: f64,
        direction: &Vector3<f64>,
        search: f64,
    ) -> TouchPlan {
        let at = |z: f64| self.pose_of * Point3::new(place.x, place.y, z);
        let direction = Unit::new_normalize(self.pose_of.rotation * direction);
        TouchPlan {
            entry: at(self.clear()),
            from: at(self.height - depth),
            direction,
            search,
            expected: None,
        }
    }

    /// Down at the flag, then at the places of a ring around it.
    pub fn ring(&self, at: usize, radius: f64, search: f64) -> TouchPlan {
        let far = if at == 0 { 0.0 } else { radius };
        self.down(&Point3::from(toward(at as f64 / RING as f64) * far), search)
    }

    /// The place that a ball with its centre there touches below it.
    pub fn below(&self, centre: &Point3<f64>) -> f64 {
        centre.z - self.params.ball_radius
    }

    /// The same of a contact from above, in O.
    pub fn end(&self, contact: &Observation) -> End {
        End {
            point: contact.point - self.out() * contact.offset,
            sigma: contact.sigma,
        }
    }
}

/// Touches of the surface around an opening, or of the ground around a foot …
pub(super) const AROUND: usize = 4;
/// … and the directions that are looked at where they would go beside the part.
const DIRECTIONS: usize = 24;

/// Places around the flag, beside the flag itself.
pub(super) const RING: usize = 6;

/// The direction across the surface after a share of a turn, unit vector in F.
pub(super) fn toward(turned: f64) -> Vector3<f64> {
    let angle = turned * TAU;
    Vector3::new(angle.cos(), angle.sin(), 0.0)
}
