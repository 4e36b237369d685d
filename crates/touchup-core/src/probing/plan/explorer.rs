//! A flagged feature, explored touch by touch.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::error::ExploreError;
use super::pattern::{Next, Stage, Touched};
use super::search_context::{PatternParams, SearchContext, TouchPlan, TouchResult};
use super::slide::Slide;
use super::{boss, edge, hole, plane, region, slot};
use crate::features::fit::Observation;
use crate::features::{Feature, Kind};

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
