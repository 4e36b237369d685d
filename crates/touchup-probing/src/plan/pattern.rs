//! Interface common to all kinds of features under exploration: a stage plans a touch and takes its
//! result.

use std::fmt::Debug;

use nalgebra::Point3;

use super::error::ExploreError;
use super::search_context::{SearchContext, TouchPlan, TouchResult};
use super::slide::Slide;
use touchup_features::features::Feature;
use touchup_features::features::fit::Observation;
use touchup_method::reconstruct::KnownSurface;

/// A touch and its result, as a stage takes them.
pub(super) struct PatternStep {
    pub planned: TouchPlan,
    pub result: TouchResult,
    /// whether the touch was left out, as the scan has no part there: then it counts as a miss
    pub is_left_out: bool,
    /// centre of the ball in F at its stop
    pub place: Option<Point3<f64>>,
    pub observation: Option<Observation>,
}

/// Exploration of one kind of feature.
pub(super) trait TouchPattern: Debug + Send {
    /// Next planned touch; `None` if no touch can improve the feature.
    ///
    /// # Errors
    /// [`ExploreError`] if there is no such feature.
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError>;
    /// Takes the result of the touch.
    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep);
    /// The feature by the touches made.
    ///
    /// # Errors
    /// [`ExploreError`]; [`ExploreError::NotDone`] before that is possible.
    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError>;
    /// The surfaces that the touches made fit.
    ///
    /// # Errors
    /// As [`Self::feature`].
    fn known_surfaces(&self, context: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError>;
    /// Present standard uncertainty of the number, m or rad.
    fn uncertainty(&self, context: &SearchContext) -> Option<f64>;
    /// Whether the number has the requested uncertainty.
    fn is_known(&self, context: &SearchContext) -> bool {
        self.uncertainty(context)
            .is_some_and(|sigma| sigma <= context.params.sigma)
    }
    /// Whether the touches fix the shape, so that its numbers are credible.
    fn is_fixed(&self, context: &SearchContext) -> bool {
        self.uncertainty(context).is_some()
    }
    /// Paths of slides over the feature, if there is one.
    fn slides(&self, context: &SearchContext) -> Vec<Slide>;
}
