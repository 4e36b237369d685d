//! What all kinds of features have in common when they are explored: a stage plans a touch and
//! takes its result.

use std::fmt::Debug;

use nalgebra::Point3;

use super::error::ExploreError;
use super::search_context::{SearchContext, TouchPlan, TouchResult};
use super::slide::Slide;
use crate::features::Feature;
use crate::features::fit::Observation;

/// A touch and its result, as a stage takes it.
pub(super) struct Touched {
    pub planned: TouchPlan,
    pub result: TouchResult,
    /// whether it was not made, for the scan has no part there: then as if nothing was met
    pub is_left_out: bool,
    /// centre of the ball in F, where it was stopped
    pub place: Option<Point3<f64>>,
    pub observation: Option<Observation>,
}

/// One kind of feature, being explored.
pub(super) trait Stage: Debug + Send {
    /// The next planned touch; `None` when no touch can improve it.
    ///
    /// # Errors
    /// [`ExploreError`] when there is no such feature.
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError>;
    /// Takes the result of the touch.
    fn take(&mut self, context: &mut SearchContext, touch: &Touched);
    /// The feature, as far as it is known.
    ///
    /// # Errors
    /// [`ExploreError`]; [`ExploreError::NotDone`] before it can be.
    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError>;
    /// Standard uncertainty of the number now, m or rad.
    fn uncertainty(&self, context: &SearchContext) -> Option<f64>;
    /// Whether it has the requested uncertainty.
    fn is_known(&self, context: &SearchContext) -> bool {
        self.uncertainty(context)
            .is_some_and(|sigma| sigma <= context.params.sigma)
    }
    /// Whether its touches fix its shape, so that its numbers can be believed.
    fn is_fixed(&self, context: &SearchContext) -> bool {
        self.uncertainty(context).is_some()
    }
    /// Paths to slide over it, once there is a feature.
    fn slides(&self, context: &SearchContext) -> Vec<Slide>;
}
