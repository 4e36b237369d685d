//! A plane: a first triangle, then touches by the largest gain for its place or its normal.

use nalgebra::Point3;

use super::cylinder_fit::surface_about;
use super::hole::numbers;
use crate::plan::error::ExploreError;
use crate::plan::measuring::{CandidateTouch, Measuring, SurfaceRequest};
use crate::plan::pattern::{PatternStep, TouchPattern};
use crate::plan::search::{ROUGH, hexagonal};
use crate::plan::search_context::{PatternParams, SearchContext, TouchPlan, TouchResult, toward};
use crate::plan::slide::Slide;
use touchup_features::features::Feature;
use touchup_features::features::fit::{Fit, FitParams, Freedom, Observation, Plane};
use touchup_method::reconstruct::KnownSurface;

/// Candidate places across the field.
const ACROSS: f64 = 6.0;
/// Minimum number of touches for a credible plane.
const LEAST: usize = 6;
/// Lean above which it is another surface, rad.
const LEAN: f64 = 0.2;

#[derive(Clone, Debug)]
pub(in crate::plan) struct PlanePattern {
    measuring: Measuring,
    /// candidate places, in F
    places: Vec<Point3<f64>>,
    first: usize,
}

/// Touches of the first triangle.
const FIRST: usize = 3;

impl PlanePattern {
    pub(crate) fn new(params: &PatternParams) -> Self {
        let places = hexagonal(2.0 * params.flag_radius / ACROSS, params.flag_radius);
        Self {
            measuring: Measuring::default(),
            places,
            first: 0,
        }
    }

    fn guess(context: &SearchContext) -> Plane {
        Plane {
            pose_of: context.pose_of * nalgebra::Translation3::new(0.0, 0.0, context.height),
        }
    }

    fn wanted(params: &PatternParams) -> SurfaceRequest {
        // equally certain at the rim of the field and in its middle
        SurfaceRequest::of_plane(
            params,
            &[Freedom::TiltX, Freedom::TiltY],
            params.flag_radius,
            LEAN,
            LEAST,
        )
    }

    fn fitted(&self, context: &SearchContext) -> Result<Fit<Plane>, ExploreError> {
        if self.measuring.observations.len() < FIRST {
            return Err(ExploreError::NotDone {
                touches: context.touches,
            });
        }
        self.measuring
            .fitted(&Self::guess(context), &FitParams::default())
    }

    fn possible(&self, context: &SearchContext) -> Vec<CandidateTouch> {
        let PatternParams {
            clearance,
            ball_radius,
            ..
        } = context.params;
        let search = clearance + ball_radius + ROUGH;
        let at = |place: &Point3<f64>| CandidateTouch {
            point: context.pose_of * Point3::new(place.x, place.y, context.height),
            travel: clearance,
            planned: context.down(place, search),
        };
        let possible = |places: Vec<&Point3<f64>>| context.on_part(places.into_iter().map(at));
        // three places fit any plane: only more show a step
        let touched = &self.measuring.observations;
        let is_new = |place: &&Point3<f64>| {
            let far = |contact: &Observation| (context.in_f(&contact.point) - **place).xy().norm();
            touched
                .iter()
                .all(|contact| far(contact) > context.params.flag_radius / ACROSS)
        };
        let new = possible(self.places.iter().filter(is_new).collect());
        if new.is_empty() || touched.len() >= LEAST {
            possible(self.places.iter().collect())
        } else {
            new
        }
    }
}

impl TouchPattern for PlanePattern {
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError> {
        let possible = self.possible(context);
        if self.first < FIRST {
            // a third of a turn apart, near the rim
            let direction = toward(self.first as f64 / FIRST as f64);
            let far = |p: &CandidateTouch| context.in_f(&p.point).coords.dot(&direction);
            let farthest = possible
                .into_iter()
                .max_by(|a, b| far(a).total_cmp(&far(b)));
            return Ok(farthest.map(|farthest| self.measuring.aim(&farthest)));
        }
        Ok(self.measuring.next(
            &Self::guess(context),
            &Self::wanted(&context.params),
            possible,
        ))
    }

    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.first += 1;
        self.measuring.take(touch);
        let Some(place) = touch
            .place
            .filter(|_| matches!(touch.result, TouchResult::At { .. }))
        else {
            return;
        };
        let surface = context.below(&place);
        if self.measuring.observations.len() == 1 {
            context.height = surface;
        } else if (surface - context.height).abs() > context.params.ball_radius {
            // a step away: another surface
            self.measuring.refuse_last(touch);
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        let fitted = self.fitted(context)?;
        let middle = context.pose_of * Point3::origin();
        Ok(Some(Feature::plane(
            &fitted,
            &middle,
            numbers([&self.measuring.observations]),
        )))
    }

    fn known_surfaces(&self, context: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError> {
        let fitted = self.fitted(context)?;
        Ok(context.surfaces_of_plane((&fitted, &self.measuring.observations)))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        self.measuring
            .uncertainty(&Self::guess(context), &Self::wanted(&context.params))
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let fitted = surface_about(context, &Point3::origin(), &self.measuring.observations).ok();
        let level = |pose_of| SearchContext {
            pose_of,
            height: 0.0,
            ..context.clone()
        };
        let slide =
            fitted.map(|fitted| level(fitted.surface.pose_of).raster(context.params.flag_radius));
        slide.into_iter().collect()
    }
}
