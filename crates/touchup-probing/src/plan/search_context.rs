//! Request of a search, its planned touches, their results, and its frame.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::arm_uncertainty::ArmUncertainty;
use super::outline::Outline;
use touchup_features::features::fit::Observation;
use touchup_features::features::{End, FeatureKind};
use touchup_method::names;
use touchup_method::parameters;

parameters! {
    /// Known and requested data of a flagged feature.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PatternParams in "robot" {
        /// Radius of the ball, m.
        ball_radius: f64 = 1.5e-3;
        /// Maximum error of the flag, m; for a plane or an unknown region, radius of the touched
        /// field.
        flag_radius: f64 = 3e-3;
        /// Distance of the ball from the surface at the start of a search.
        ///
        /// In m.
        clearance: f64 = 3.0, "clearance_mm" [MM, 0.5, 50];
        /// Depth of the centre of the ball in a hole.
        ///
        /// In m.
        depth: f64 = 5.0, "depth_mm" [MM, 0, 100];
        /// Number that the touches serve.
        quantity: FeatureQuantity = FeatureQuantity::All;
        /// Requested standard deviation of this number, m, or rad of an axis.
        sigma: f64 = 4e-6;
        /// Maximum number of touches of one feature.
        budget: usize = 39, "touches" [TOUCHES, 1, 1e4];
        /// Standard deviation of one touch due to the repeatability of arm and probe (`touchup
        /// check`), beside that of its own force curve.
        ///
        /// In m. The maker of a UR5e states ±0.03 mm.
        touch_sigma: f64 = 0.03, "touch_sigma_mm" [MM, 1e-5, 1];
        /// Standard uncertainty of the perpendicularity of the walls of holes, slots and bosses to
        /// the surface around them, in each of two directions, unless their touches measure it.
        ///
        /// In rad. 0.13° is 0.4 mm in 100 mm, the general tolerance K of ISO 2768-2, taken as a
        /// uniform distribution.
        square: f64 = 0.13, "square_sigma_deg" [DEG, 1e-3, 20];
    }
    with {
        /// Uncertainty common to all touches.
        shared: ArmUncertainty,
    }
}

names! {
    /// A number of a feature.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum FeatureQuantity {
        /// place and sizes: every length
        #[default]
        All = "every length",
        /// place of the feature
        Position = "position",
        /// direction of its axis, of an edge its line, of a plane its normal; rad
        Axis = "axis",
        /// diameter of a hole or boss
        Diameter = "diameter",
        /// length of a slot
        Length = "length",
        /// width of a slot
        Width = "width",
    }
}

impl FeatureQuantity {
    /// Whether a feature has it.
    pub fn is_of(self, kind: Option<FeatureKind>) -> bool {
        match self {
            Self::All => true,
            Self::Position | Self::Axis => kind.is_some(),
            Self::Diameter => matches!(kind, Some(FeatureKind::Hole | FeatureKind::Boss)),
            Self::Length | Self::Width => kind == Some(FeatureKind::Slot),
        }
    }
}

/// Maximum difference of touches of one surface, in standard deviations: of two touches by 4 of its
/// own.
const BEYOND: f64 = 5.7;

impl PatternParams {
    /// Part of the wanted number's uncertainty that no touch reduces: the largest of the feature's
    /// numbers; m, or rad of an axis.
    ///
    /// - `out`: of the surface, unit vector.
    pub(super) fn shared_part(
        &self,
        kind: Option<FeatureKind>,
        place: &Point3<f64>,
        out: &Vector3<f64>,
    ) -> f64 {
        let Some(kind) = kind else { return 0.0 };
        let (position, size) = (
            self.shared.position(kind, place, out),
            2.0 * self.shared.radius,
        );
        match self.quantity {
            FeatureQuantity::Axis => self.shared.turn,
            FeatureQuantity::Diameter | FeatureQuantity::Width | FeatureQuantity::Length => size,
            FeatureQuantity::All if !matches!(kind, FeatureKind::Plane | FeatureKind::Edge) => {
                position.max(size)
            }
            FeatureQuantity::Position | FeatureQuantity::All => position,
        }
    }

    /// Least difference of heights beyond the scatter of touches, m.
    ///
    /// - `least`: for an arm without scatter, m.
    pub(super) fn beyond(&self, least: f64) -> f64 {
        least.max(BEYOND * self.touch_sigma)
    }
}

/// A planned touch, in O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchPlan {
    /// Place above the part: the path from here to `from` is straight and free.
    pub entry: Point3<f64>,
    /// Centre of the ball at the start of the search.
    pub from: Point3<f64>,
    /// Direction of the search.
    pub direction: Unit<Vector3<f64>>,
    /// Length of the search, m.
    pub search: f64,
    /// Position of the surface, predicted from earlier touches.
    pub expected: Option<ExpectedTravel>,
}

impl TouchPlan {
    /// Centre of the ball at the end of a search without contact.
    pub fn end(&self) -> Point3<f64> {
        self.from + self.direction.into_inner() * self.search
    }

    /// The same search, begun farther along its direction.
    ///
    /// - `by`: m
    pub(crate) fn begun_ahead(&self, by: f64) -> Self {
        let ahead = self.direction.into_inner() * by;
        let expected = self.expected.map(|expected| ExpectedTravel {
            travel: expected.travel - by,
            ..expected
        });
        Self {
            entry: self.entry + ahead,
            from: self.from + ahead,
            search: self.search - by,
            expected,
            ..*self
        }
    }
}

/// Expected distance of the surface from the start of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedTravel {
    /// travel of the ball's centre, m
    pub travel: f64,
    /// standard deviation of the travel, m
    pub sigma: f64,
}

/// The result of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchResult {
    /// A contact at a known place.
    At {
        /// centre of the ball, m in O
        centre: Point3<f64>,
        /// standard deviation along the direction, m
        sigma: f64,
    },
    /// No contact along the whole search.
    Nothing,
    /// A contact at an unknown place.
    Unclear,
}

/// Requested standard deviations of a feature's open numbers for a decision, m; `None`: no request.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct OpenNumbers {
    /// place, along each axis
    pub place: Option<f64>,
    /// diameter or width
    pub size: Option<f64>,
    pub length: Option<f64>,
}

/// State of the search for a feature.
#[derive(Clone, Debug)]
pub(super) struct SearchContext {
    pub params: PatternParams,
    /// maps the frame F of the search to O: z out of the part, origin at the flag on the surface
    pub pose_of: Isometry3<f64>,
    /// lean of its z from the surface's normal, standard deviation in each of two directions, rad
    pub lean: f64,
    /// height of the surface in F
    pub height: f64,
    pub touches: usize,
    /// purpose of touches in place of the wanted number, once a decision is the goal and the shape
    /// is known
    pub open: Option<OpenNumbers>,
    /// outline of the scan, seen along the normal at the flag
    pub outline: Arc<Outline>,
    /// places of the surface, in O, without touches, for the scan has no part there
    pub left_out: Vec<Point3<f64>>,
}

/// Cosine of the maximum angle between a touch from above and the normal.
const DOWN: f64 = 0.99;

impl SearchContext {
    pub(crate) fn is_down(&self, planned: &TouchPlan) -> bool {
        planned.direction.dot(&self.out()) < -DOWN
    }

    /// Whether a touch would go down beside the part.
    pub(crate) fn is_beside(&self, planned: &TouchPlan) -> bool {
        self.is_down(planned) && !self.outline.is_part(&planned.from, 0.0)
    }

    /// Records a place of F without a touch.
    pub(crate) fn leave_out(&mut self, place: &Point3<f64>) {
        self.left_out
            .push(self.pose_of * Point3::new(place.x, place.y, self.height));
    }

    /// Whether the whole ball is over the part at a place of F.
    pub(crate) fn is_over_part(&self, place: &Point3<f64>) -> bool {
        self.outline
            .is_part(&(self.pose_of * place), self.params.ball_radius)
    }

    /// One of several places of F for touches from above; for a place beside the part, the one of
    /// `others` over the part and farthest from all touched places.
    pub(crate) fn over_part(
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

    /// One of [`AROUND`] places of F around a middle, or another around it if that is beside the
    /// part.
    ///
    /// - `first`: number of their steps from x to the first; `away`: from the middle, m.
    pub(crate) fn around(
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

    pub(crate) fn out(&self) -> Vector3<f64> {
        self.pose_of.rotation * Vector3::z()
    }

    pub(crate) fn in_f(&self, point: &Point3<f64>) -> Point3<f64> {
        self.pose_of.inverse_transform_point(point)
    }

    /// Height of the centre of a ball clear of the surface.
    pub(crate) fn clear(&self) -> f64 {
        self.height + self.params.ball_radius + self.params.clearance
    }

    /// Touch down at a place of F.
    pub(crate) fn down(&self, place: &Point3<f64>, search: f64) -> TouchPlan {
        let from = self.pose_of * Point3::new(place.x, place.y, self.clear());
        TouchPlan {
            entry: from,
            from,
            direction: Unit::new_unchecked(-self.out()),
            search,
            expected: None,
        }
    }

    /// Touch from a place of F, at a depth below the surface, along a direction of F.
    pub(crate) fn sideways(
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

    /// Touch down at the flag, then at the places of a ring around it.
    pub(crate) fn ring(&self, at: usize, radius: f64, search: f64) -> TouchPlan {
        let far = if at == 0 { 0.0 } else { radius };
        self.down(&Point3::from(toward(at as f64 / RING as f64) * far), search)
    }

    /// Height of the place that a ball touches below its centre.
    pub(crate) fn below(&self, centre: &Point3<f64>) -> f64 {
        centre.z - self.params.ball_radius
    }

    /// Place of a contact from above, in O.
    pub(crate) fn end(&self, contact: &Observation) -> End {
        End {
            point: contact.point - self.out() * contact.offset,
            sigma: contact.sigma,
        }
    }
}

/// Touches of the surface around an opening, or of the ground around a foot.
pub(super) const AROUND: usize = 4;
/// Directions that replace touches beside the part.
const DIRECTIONS: usize = 24;

/// Places around the flag, in addition to the flag itself.
pub(super) const RING: usize = 6;

/// Direction across the surface after a share of a turn, unit vector in F.
pub(super) fn toward(turned: f64) -> Vector3<f64> {
    let angle = turned * TAU;
    Vector3::new(angle.cos(), angle.sin(), 0.0)
}
