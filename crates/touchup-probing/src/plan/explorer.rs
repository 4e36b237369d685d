//! Exploration of a flagged feature, touch by touch.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::decision::{DecidedCharacteristic, DecisionGoal, open_numbers};
use super::error::ExploreError;
use super::kinds::boss;
use super::kinds::edge;
use super::kinds::hole;
use super::kinds::plane;
use super::kinds::region;
use super::kinds::slot;
use super::level::UNTOUCHED;
use super::outline::Outline;
use super::pattern::{PatternStep, TouchPattern};
use super::search::{DEEPEST, ROUGH};
use super::search_context::{PatternParams, SearchContext, TouchPlan, TouchResult};
use super::slide::Slide;
use touchup_features::conformity::{Decision, DecisionParams};
use touchup_features::features::fit::Observation;
use touchup_features::features::{Feature, FeatureKind};
use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::turned_to;
use touchup_method::reconstruct::KnownSurface;

/// Result of an exploration.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplorationResult {
    /// the feature; `None` for an unknown region, which only the mesh describes
    pub feature: Option<Feature>,
    /// number of touches, misses included
    pub touches: usize,
    /// whether the number has the requested uncertainty
    pub is_as_asked: bool,
    /// standard uncertainty of the number, m or rad
    pub uncertainty: Option<f64>,
    /// its part common to all touches: radius, place of the part, kinematics; m or rad
    pub shared: f64,
    /// uncertainty over the requested one, if the touches are done and the common part keeps the
    /// number from the request
    pub limited: Option<f64>,
    /// feature with uncertainties from the scatter of its touches alone
    pub by_touches: Option<Feature>,
    /// each characteristic of a decision goal
    pub characteristics: Vec<DecidedCharacteristic>,
}

/// Explores one flagged feature. It moves nothing: [`Explorer::next_touch`] plans a touch,
/// [`Explorer::take`] takes its result, from an arm or by hand. No touch goes beside the part, as
/// the scan has it.
#[derive(Debug)]
pub struct Explorer {
    context: SearchContext,
    stage: Box<dyn TouchPattern>,
    asked: Option<TouchPlan>,
    ended: Option<Result<bool, ExploreError>>,
    kind: Option<FeatureKind>,
    /// requested uncertainty of the number, m or rad
    wanted: f64,
    /// part common to all touches, m or rad
    shared: f64,
    /// decision goal, and the rule of one look
    goal: Option<(DecisionGoal, DecisionParams)>,
}

/// Uncertainty by touches over the common uncertainty, below which more touches add a twentieth at
/// most.
const LEAST_SHARE: f64 = 1.0 / 3.0;
/// Rounding of two roots.
const ROUNDING: f64 = 1e-9;

impl Explorer {
    /// - `kind`: of the feature; `None`: unknown. Pockets are explored as slots.
    /// - `flag`: approximate place on the surface, m in O; `normal`: approximate normal there.
    /// - `scan`: the known part, in O.
    ///
    /// # Errors
    /// [`ExploreError::NoPattern`], [`ExploreError::NoSuchNumber`].
    pub fn new(
        kind: Option<FeatureKind>,
        flag: &Point3<f64>,
        normal: &Unit<Vector3<f64>>,
        params: PatternParams,
        scan: &TriMesh,
    ) -> Result<Self, ExploreError> {
        if !params.quantity.is_of(kind) {
            let kind = kind.map_or("unknown region", FeatureKind::name);
            return Err(ExploreError::NoSuchNumber {
                kind,
                number: params.quantity.name(),
            });
        }
        let stage: Box<dyn TouchPattern> = match kind {
            Some(FeatureKind::Hole) => Box::new(hole::HolePattern::new(&params)),
            Some(FeatureKind::Slot | FeatureKind::Pocket) => {
                Box::new(slot::SlotPattern::new(&params))
            }
            Some(FeatureKind::Boss) => Box::new(boss::BossPattern::new()),
            Some(FeatureKind::Edge) => Box::new(edge::EdgePattern::new()),
            Some(FeatureKind::Plane) => Box::new(plane::PlanePattern::new(&params)),
            Some(
                kind @ (FeatureKind::Corner
                | FeatureKind::Cylinder
                | FeatureKind::Notch
                | FeatureKind::Sphere),
            ) => {
                return Err(ExploreError::NoPattern { kind: kind.name() });
            }
            None => Box::new(region::RegionPattern::new(&params)),
        };
        let pose_of = Isometry3::from_parts(flag.coords.into(), turned_to(normal));
        let (shared, wanted) = (params.shared_part(kind, flag, normal), params.sigma);
        // request no more of the touches than makes a difference
        let sigma = (wanted.powi(2) - shared.powi(2))
            .max(0.0)
            .sqrt()
            .max(LEAST_SHARE * shared);
        let params = PatternParams { sigma, ..params };
        let deep = params.depth.max(DEEPEST * params.ball_radius) + ROUGH;
        let outline = Arc::new(Outline::new(scan, flag, normal, deep));
        let (lean, left_out) = (UNTOUCHED, Vec::new());
        let open = None;
        let context = SearchContext {
            params,
            pose_of,
            lean,
            height: 0.0,
            touches: 0,
            open,
            outline,
            left_out,
        };
        Ok(Self {
            context,
            stage,
            asked: None,
            ended: None,
            kind,
            wanted,
            shared,
            goal: None,
        })
    }

    /// Touches until each characteristic of the feature is decided, instead of until a number has
    /// an uncertainty.
    pub fn until_decided(mut self, goal: DecisionGoal) -> Self {
        let of_one_look = goal.of_one_look(self.context.params.budget);
        self.context.params.quantity = super::search_context::FeatureQuantity::All;
        self.goal = Some((goal, of_one_look));
        self
    }

    /// State of each characteristic of the decision goal after the touches.
    pub fn characteristics(&self) -> Vec<DecidedCharacteristic> {
        let Some((goal, params)) = &self.goal else {
            return Vec::new();
        };
        // the shape is fixed if each of its numbers is
        let of_all = SearchContext {
            open: None,
            ..self.context.clone()
        };
        let is_fixed = self.stage.is_fixed(&of_all);
        let by_touches = if is_fixed {
            self.stage.feature(&of_all).ok().flatten()
        } else {
            None
        };
        let feature = by_touches
            .clone()
            .map(|feature| self.context.params.shared.widened(feature));
        goal.standing(params, feature.as_ref().zip(by_touches.as_ref()))
    }

    /// Whether nothing remains to touch for.
    fn is_done(&mut self) -> bool {
        let Some((_, params)) = self.goal.as_ref() else {
            return self.stage.is_known(&self.context);
        };
        let standing = self.characteristics();
        let is_measured = standing.iter().any(|one| one.measured.is_some());
        self.context.open = is_measured.then(|| open_numbers(&standing, params));
        !standing.iter().any(DecidedCharacteristic::is_open)
    }

    /// Number of touches made.
    pub fn touches(&self) -> usize {
        self.context.touches
    }

    /// Places of the surface, m in O, left out because the scan has no part there.
    pub(crate) fn left_out(&self) -> &[Point3<f64>] {
        &self.context.left_out
    }

    /// Present standard uncertainty of the wanted number, m or rad; `None` while there is none.
    pub(crate) fn uncertainty(&self) -> Option<f64> {
        // also if a decision requests less
        let of_all = SearchContext {
            open: None,
            ..self.context.clone()
        };
        self.stage
            .uncertainty(&of_all)
            .map(|sigma| sigma.hypot(self.shared))
    }

    /// Next planned touch; `None` after success or failure ([`Self::found`] says which).
    pub fn next_touch(&mut self) -> Option<TouchPlan> {
        self.asked = None;
        if self.ended.is_some() || self.context.touches >= self.context.params.budget {
            return None;
        }
        // further touches would make outliers of contacts that agree
        if let Err(error @ ExploreError::TwoSurfaces { .. }) = self.stage.feature(&self.context) {
            self.ended = Some(Err(error));
        }
        while self.asked.is_none() && self.ended.is_none() {
            let is_known = self.is_done();
            match if is_known {
                Ok(None)
            } else {
                self.stage.next(&mut self.context)
            } {
                Ok(Some(planned)) if self.context.is_beside(&planned) => self.leave_out(planned),
                Ok(Some(planned)) => self.asked = Some(planned),
                Ok(None) => self.ended = Some(Ok(is_known)),
                Err(error) => self.ended = Some(Err(error)),
            }
        }
        self.asked
    }

    /// Leaves out a touch: by the scan it would miss.
    fn leave_out(&mut self, planned: TouchPlan) {
        self.context.leave_out(&self.context.in_f(&planned.from));
        let (result, is_left_out) = (TouchResult::Nothing, true);
        self.stage.take(
            &mut self.context,
            &PatternStep {
                planned,
                result,
                is_left_out,
                place: None,
                observation: None,
            },
        );
    }

    /// Paths of slides over the whole feature; none without a feature, or without room for the
    /// ball.
    pub(crate) fn slides(&self) -> Vec<Slide> {
        if self.found().is_ok() {
            self.stage.slides(&self.context)
        } else {
            Vec::new()
        }
    }

    /// Takes the result of the planned touch.
    pub fn take(&mut self, result: &TouchResult) {
        let Some(planned) = self.asked.take() else {
            return;
        };
        self.context.touches += 1;
        let (offset, group) = (self.context.params.ball_radius, self.context.touches as u32);
        let observation = match *result {
            TouchResult::At { centre, sigma } => {
                let sigma = sigma.hypot(self.context.params.touch_sigma);
                Some(Observation {
                    point: centre,
                    offset,
                    sigma,
                    group,
                })
            }
            TouchResult::Nothing | TouchResult::Unclear => None,
        };
        let place = observation.map(|contact| self.context.in_f(&contact.point));
        let is_left_out = false;
        self.stage.take(
            &mut self.context,
            &PatternStep {
                planned,
                result: *result,
                is_left_out,
                place,
                observation,
            },
        );
    }

    /// The surfaces that the touches fit; none without a feature.
    pub fn known_surfaces(&self) -> Vec<KnownSurface> {
        self.stage.known_surfaces(&self.context).unwrap_or_default()
    }

    /// Result, once [`Self::next_touch`] plans nothing more.
    ///
    /// # Errors
    /// [`ExploreError`].
    pub fn found(&self) -> Result<ExplorationResult, ExploreError> {
        let is_as_asked = match &self.ended {
            Some(Err(error)) => return Err(error.clone()),
            Some(Ok(is_as_asked)) => *is_as_asked,
            // the last allowed touch was enough
            None => {
                self.context.touches >= self.context.params.budget
                    && self.stage.is_known(&self.context)
            }
        };
        let characteristics = self.characteristics();
        let is_decided = characteristics
            .iter()
            .all(|one| one.assessment.decision != Decision::Undecided);
        let is_as_asked = if self.goal.is_some() {
            is_decided
        } else {
            is_as_asked
        };
        let over = self.uncertainty().map(|sigma| sigma / self.wanted);
        let limited =
            over.filter(|over| self.goal.is_none() && is_as_asked && *over > 1.0 + ROUNDING);
        let by_touches = self.stage.feature(&self.context)?;
        let place = by_touches.as_ref().map(|feature| feature.centre.value);
        let (params, out) = (&self.context.params, self.context.out());
        Ok(ExplorationResult {
            feature: by_touches
                .clone()
                .map(|feature| params.shared.widened(feature)),
            touches: self.context.touches,
            is_as_asked: is_as_asked && limited.is_none(),
            limited,
            uncertainty: self.uncertainty(),
            shared: place.map_or(self.shared, |place| {
                params.shared_part(self.kind, &place, &out)
            }),
            by_touches,
            characteristics,
        })
    }
}
