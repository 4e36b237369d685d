//! The contacts of one surface, and the next touch of it with the largest gain.

use nalgebra::Point3;

use super::design::{Asked, Candidate, Knowledge};
use super::pattern::Touched;
use super::search_context::{Expected, TouchPlan, TouchResult};
use crate::features::fit::{FitParams, Observation, Surface, fit};

/// A candidate touch: where the surface would be touched, and how.
pub(super) struct Possible {
    /// on the surface, m in O
    pub point: Point3<f64>,
    /// with the ball's centre so far from where the search begins, m
    pub travel: f64,
    pub planned: TouchPlan,
}

/// Touches of one surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Measuring {
    pub observations: Vec<Observation>,
    /// places without contact, or without a clear one
    dead: Vec<Point3<f64>>,
    aimed: Option<Point3<f64>>,
}

/// Share of the touches that may lie elsewhere than on the surface.
const MOST_REFUSED: f64 = 0.2;
/// Places nearer than this to one without contact are not tried, m.
const DEAD: f64 = 0.2e-3;

impl Measuring {
    /// Takes a touch that was aimed at this surface.
    pub fn take(&mut self, touch: &Touched) {
        let aimed = self.aimed.take();
        match (touch.result, aimed) {
            (TouchResult::At { .. }, _) => self.observations.extend(touch.observation),
            (_, Some(aimed)) => self.dead.push(aimed),
            (_, None) => {}
        }
    }

    /// A contact where none should be belongs to another surface.
    pub fn refuse_last(&mut self, touch: &Touched) {
        if self.observations.last() == touch.observation.as_ref() && self.observations.pop().is_some() {
            self.dead.push(touch.planned.from);
        }
    }

    /// The covariance of a surface after the touches, from the one before them.
    pub fn known<M: Surface>(&self, surface: &M, before: Knowledge, touch_sigma: f64) -> Knowledge {
        self.observations.iter().fold(before, |known, o| {
            // the ball's centre lies on the same normal as the place that it touches
            known.with(surface, &Candidate { point: o.point, sigma: o.sigma.max(touch_sigma) })
        })
    }

    /// The largest standard uncertainty of the requested numbers over the requested one of each, as far as the touches support it: of
    /// those that lie on one surface, and stretched where they differ from it beyond what they say of themselves.
    ///
    /// `None` where the touches do not fix a number, or where more than [`MOST_REFUSED`] of them lie elsewhere.
    pub fn uncertainty_ratio<M: Surface>(
        &self,
        guess: &M,
        params: &FitParams,
        before: Knowledge,
        asked: &Asked,
        touch_sigma: f64,
    ) -> Option<f64> {
        let fit = fit(guess, &self.observations, params).ok()?;
        let kept: Vec<_> =
            self.observations.iter().zip(&fit.used).filter(|(_, used)| **used).map(|(o, _)| *o).collect();
        let refused = (self.observations.len() - kept.len()) as f64;
        if !asked.is_fixed_by(&fit) || refused > MOST_REFUSED * self.observations.len() as f64 {
            return None;
        }
        let known = Self { observations: kept, ..Self::default() }.known(guess, before, touch_sigma);
        Some(known.worst(asked) * (fit.chi_squared / fit.degrees.max(1) as f64).sqrt().max(1.0))
    }

    /// The touch with the largest gain for the requested numbers, and its gain.
    pub fn best<M: Surface>(
        &self,
        surface: &M,
        known: &Knowledge,
        possible: Vec<Possible>,
        asked: &Asked,
        touch_sigma: f64,
    ) -> Option<(Possible, f64)> {
        let is_alive = |p: &Possible| self.dead.iter().all(|dead| (dead - p.point).norm() > DEAD);
        let mut possible: Vec<Possible> = possible.into_iter().filter(is_alive).collect();
        let candidates: Vec<_> = possible.iter().map(|p| Candidate { point: p.point, sigma: touch_sigma }).collect();
        let best = known.best(surface, &candidates, asked)?;
        let gain = known.gain(surface, &candidates[best], asked);
        let mut chosen = possible.swap_remove(best);
        let sigma = known.sigma_at(surface, &chosen.point);
        chosen.planned.expected = Some(Expected { travel: chosen.travel, sigma });
        Some((chosen, gain))
    }

    /// The planned touch is one of this surface.
    pub fn aim(&mut self, possible: &Possible) -> TouchPlan {
        self.aimed = Some(possible.point);
        possible.planned
    }
}
