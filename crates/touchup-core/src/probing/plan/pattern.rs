//! What all kinds of features have in common when they are explored: a stage plans a touch and takes in what came of it.

use std::fmt::Debug;

use nalgebra::Point3;

use super::error::ExploreError;
use super::search_context::{SearchContext, TouchPlan, TouchResult};
use super::slide::Slide;
use crate::features::Feature;
use crate::features::fit::Observation;

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
