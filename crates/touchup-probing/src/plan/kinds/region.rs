//! A region of unknown kind: touches in a spiral from the flag outward, for the mesh alone.

use nalgebra::Point3;

use crate::plan::error::ExploreError;
use crate::plan::pattern::{PatternStep, TouchPattern};
use crate::plan::search::{ROUGH, hexagonal};
use crate::plan::search_context::{PatternParams, SearchContext, TouchPlan};
use crate::plan::slide::Slide;
use touchup_features::features::Feature;
use touchup_method::reconstruct::KnownSurface;

#[derive(Clone, Debug)]
pub(in crate::plan) struct RegionPattern {
    /// places in F, the next one last
    places: Vec<Point3<f64>>,
    /// surface at the touched places, in F; `None` at a miss
    surface: Vec<Option<Point3<f64>>>,
    /// distance of neighbours, m
    step: f64,
}

/// Maximum distance of two places of the spiral with a slide between them, over their step: across
/// the surface, and up or down.
const NEXT: f64 = 1.5;
const STEEP: f64 = 0.6;

impl RegionPattern {
    /// Places as dense as the budget allows.
    pub(crate) fn new(params: &PatternParams) -> Self {
        let area = std::f64::consts::PI * params.flag_radius.powi(2);
        // a place of a hexagonal grid has √3/2 of its step squared
        let step = (area / params.budget.max(1) as f64 / 0.75f64.sqrt()).sqrt();
        let mut places = hexagonal(step, params.flag_radius);
        let ring = |p: &Point3<f64>| (p.coords.norm() / step).round();
        let turn = |p: &Point3<f64>| p.y.atan2(p.x);
        places.sort_by(|a, b| {
            ring(b)
                .total_cmp(&ring(a))
                .then(turn(b).total_cmp(&turn(a)))
        });
        Self {
            places,
            surface: Vec::new(),
            step,
        }
    }
}

impl TouchPattern for RegionPattern {
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError> {
        let PatternParams {
            clearance,
            ball_radius,
            depth,
            ..
        } = context.params;
        Ok(self
            .places
            .last()
            .map(|place| context.down(place, clearance + ball_radius + depth.max(ROUGH))))
    }

    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.places.pop();
        self.surface.push(
            touch
                .place
                .map(|place| Point3::new(place.x, place.y, context.below(&place))),
        );
        if let Some(place) = touch.place {
            // the next touch begins clear of the highest place
            context.height = context.height.max(context.below(&place));
        }
    }

    fn feature(&self, _: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        Ok(None)
    }

    fn known_surfaces(&self, _: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError> {
        Ok(Vec::new())
    }

    fn uncertainty(&self, _: &SearchContext) -> Option<f64> {
        None
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let is_next = |pair: &[Option<Point3<f64>>]| {
            let [Some(a), Some(b)] = pair else {
                return false;
            };
            (b - a).xy().norm() <= NEXT * self.step && (b.z - a.z).abs() <= STEEP * self.step
        };
        let surface = self.surface.chunk_by(|a, b| is_next(&[*a, *b]));
        let chains = surface.map(|chain| chain.iter().flatten().copied().collect::<Vec<_>>());
        chains
            .filter(|chain| chain.len() > 1)
            .map(|chain| context.along(&chain))
            .collect()
    }
}
