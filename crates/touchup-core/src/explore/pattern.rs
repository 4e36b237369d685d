//! What all kinds of features have in common when they are explored: a touch is wished for, and what was felt is taken in.

use std::fmt::Debug;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::error::ExploreError;
use super::slide::Slide;
use super::{boss, edge, hole, plane, region, slot};
use crate::features::fit::Observation;
use crate::features::{Feature, Kind};
use crate::parameters;

parameters! {
    /// What is known and wanted of a flagged feature.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PatternParams in "robot" {
        /// Of the ball, m.
        ball_radius: f64 = 1.5e-3;
        /// The flag is off by no more than this, m; of a plane or an unknown region: so far around the flag is touched.
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
        /// Expected standard deviation of one touch.
        ///
        /// In m.
        touch_sigma: f64 = 0.005, "touch_sigma_mm" [MM, 1e-5, 1];
    }
}

/// A number of a feature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quantity {
    /// place and sizes: every length
    #[default]
    All,
    /// where it is
    Position,
    /// the direction of its axis, of an edge its line, of a plane its normal; rad
    Axis,
    /// of a hole or boss
    Diameter,
    /// of a slot
    Length,
    /// of a slot
    Width,
}

impl Quantity {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "every length",
            Self::Position => "position",
            Self::Axis => "axis",
            Self::Diameter => "diameter",
            Self::Length => "length",
            Self::Width => "width",
        }
    }

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

/// A touch that is wanted, in O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchPlan {
    /// Above the part: from here the way to `from` is straight and free.
    pub entry: Point3<f64>,
    /// Centre of the ball where the search begins.
    pub from: Point3<f64>,
    /// Along which it is searched.
    pub direction: Unit<Vector3<f64>>,
    /// How far, m.
    pub search: f64,
    /// Where the surface will be, as far as touches tell.
    pub expected: Option<Expected>,
}

/// How far from where a search begins the surface will be felt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// of the ball's centre, m
    pub travel: f64,
    /// standard deviation, m
    pub sigma: f64,
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchResult {
    /// The ball was stopped.
    At {
        /// its centre, m in O
        centre: Point3<f64>,
        /// standard deviation along the direction, m
        sigma: f64,
    },
    /// Nothing on the whole way.
    Nothing,
    /// Something whose place nobody knows.
    Unclear,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// what it is; `None` of an unknown region, which is for the mesh to tell
    pub feature: Option<Feature>,
    /// touches that were made, those that felt nothing among them
    pub touches: usize,
    /// whether the number is known as well as was asked
    pub is_as_asked: bool,
    /// standard uncertainty of the number, m or rad
    pub uncertainty: Option<f64>,
}

/// What a stage wants.
pub(super) enum Next {
    Touch(TouchPlan),
    /// all is known as well as was asked, or nothing more can be known
    Done {
        is_as_asked: bool,
    },
    Failed(ExploreError),
}

/// A touch, as a stage is told of it.
pub(super) struct Touched {
    pub wish: TouchPlan,
    pub felt: TouchResult,
    /// centre of the ball in F, where it was stopped
    pub place: Option<Point3<f64>>,
    pub observation: Option<Observation>,
}

/// One kind of feature, being explored.
pub(super) trait Stage: Debug + Send {
    /// The touch that is wanted next.
    fn next(&mut self, course: &SearchContext) -> Next;
    /// What came of it.
    fn take(&mut self, course: &mut SearchContext, touch: &Touched);
    /// The feature, as far as it is known.
    ///
    /// # Errors
    /// [`ExploreError`]; [`ExploreError::NotDone`] before it can be.
    fn feature(&self, course: &SearchContext) -> Result<Option<Feature>, ExploreError>;
    /// Standard uncertainty of the number now, m or rad.
    fn uncertainty(&self, course: &SearchContext) -> Option<f64>;
    /// Ways to slide over it, once there is a feature.
    fn slides(&self, course: &SearchContext) -> Vec<Slide>;
}

/// Where a feature is looked for, and how far that has got.
#[derive(Clone, Debug)]
pub(super) struct SearchContext {
    pub params: PatternParams,
    /// z out of the part, origin at the flag on the surface; maps the frame F of the search to O
    pub pose_of: Isometry3<f64>,
    /// of the surface in F
    pub height: f64,
    pub touches: usize,
}

impl SearchContext {
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
        TouchPlan { entry: from, from, direction: Unit::new_unchecked(-self.out()), search, expected: None }
    }

    /// From a place of F, at a depth below the surface, along a direction of F.
    pub fn sideways(&self, place: &Point3<f64>, depth: f64, way: &Vector3<f64>, search: f64) -> TouchPlan {
        let at = |z: f64| self.pose_of * Point3::new(place.x, place.y, z);
        let direction = Unit::new_normalize(self.pose_of.rotation * way);
        TouchPlan { entry: at(self.clear()), from: at(self.height - depth), direction, search, expected: None }
    }

    /// The place that a ball with its centre there touches below it.
    pub fn below(&self, centre: &Point3<f64>) -> f64 {
        centre.z - self.params.ball_radius
    }
}

/// Explores one flagged feature. Nothing is moved here: [`Explorer::wish`] says which touch is wanted, [`Explorer::take`] is told what
/// was felt, by an arm or by a hand.
#[derive(Debug)]
pub struct Explorer {
    course: SearchContext,
    stage: Box<dyn Stage>,
    asked: Option<TouchPlan>,
    ended: Option<Result<bool, ExploreError>>,
}

impl Explorer {
    /// - `kind`: what it is; `None`: nobody knows. Pockets are explored as slots.
    /// - `flag`: about where, on the surface, m in O; `normal`: about how the surface looks out there.
    ///
    /// # Errors
    /// [`ExploreError::NoPattern`], [`ExploreError::NoSuchNumber`].
    pub fn new(
        kind: Option<Kind>,
        flag: &Point3<f64>,
        normal: &Unit<Vector3<f64>>,
        params: PatternParams,
    ) -> Result<Self, ExploreError> {
        if !params.quantity.is_of(kind) {
            return Err(ExploreError::NoSuchNumber {
                kind: kind.map_or("unknown region", Kind::name),
                number: params.quantity.name(),
            });
        }
        let stage: Box<dyn Stage> = match kind {
            Some(Kind::Hole) => Box::new(hole::HolePattern::new(&params)),
            Some(Kind::Slot | Kind::Pocket) => Box::new(slot::SlotPattern::new(&params)),
            Some(Kind::Boss) => Box::new(boss::BossPattern::new()),
            Some(Kind::Edge) => Box::new(edge::EdgePattern::new()),
            Some(Kind::Plane) => Box::new(plane::PlanePattern::new(&params)),
            Some(Kind::Corner) => return Err(ExploreError::NoPattern { kind: Kind::Corner.name() }),
            None => Box::new(region::RegionPattern::new(&params)),
        };
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), normal)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let pose_of = Isometry3::from_parts(flag.coords.into(), turn);
        Ok(Self { course: SearchContext { params, pose_of, height: 0.0, touches: 0 }, stage, asked: None, ended: None })
    }

    /// Touches so far.
    pub fn touches(&self) -> usize {
        self.course.touches
    }

    /// Standard uncertainty of the wanted number now, m or rad; `None` while there is none.
    pub fn uncertainty(&self) -> Option<f64> {
        self.stage.uncertainty(&self.course)
    }

    /// The touch that is wanted next; `None` when it is done, or cannot be ([`Self::found`] says which).
    pub fn wish(&mut self) -> Option<TouchPlan> {
        self.asked = None;
        if self.ended.is_some() || self.course.touches >= self.course.params.budget {
            return None;
        }
        match self.stage.next(&self.course) {
            Next::Touch(wish) => self.asked = Some(wish),
            Next::Done { is_as_asked } => self.ended = Some(Ok(is_as_asked)),
            Next::Failed(error) => self.ended = Some(Err(error)),
        }
        self.asked
    }

    /// Ways on which the ball slides over all of what was found; none where nothing was, or where a ball has no room to.
    pub fn slides(&self) -> Vec<Slide> {
        match self.found() {
            Ok(_) => self.stage.slides(&self.course),
            Err(_) => Vec::new(),
        }
    }

    /// What came of the touch that was wanted.
    pub fn take(&mut self, felt: &TouchResult) {
        let Some(wish) = self.asked.take() else { return };
        self.course.touches += 1;
        let (place, observation) = match *felt {
            TouchResult::At { centre, sigma } => {
                let offset = self.course.params.ball_radius;
                let observation = Observation { point: centre, offset, sigma, group: self.course.touches as u32 };
                (Some(self.course.in_f(&centre)), Some(observation))
            }
            TouchResult::Nothing | TouchResult::Unclear => (None, None),
        };
        self.stage.take(&mut self.course, &Touched { wish, felt: *felt, place, observation });
    }

    /// What was found, once [`Self::wish`] wants nothing more.
    ///
    /// # Errors
    /// [`ExploreError`].
    pub fn found(&self) -> Result<Found, ExploreError> {
        let is_as_asked = match &self.ended {
            Some(Err(error)) => return Err(error.clone()),
            Some(Ok(is_as_asked)) => *is_as_asked,
            None => false,
        };
        Ok(Found {
            feature: self.stage.feature(&self.course)?,
            touches: self.course.touches,
            is_as_asked,
            uncertainty: self.uncertainty(),
        })
    }
}
