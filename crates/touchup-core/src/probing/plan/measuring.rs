//! What was felt of one surface, and which touch of it tells most.

use nalgebra::Point3;

use super::design::{Asked, Candidate, Knowledge};
use super::pattern::Touched;
use super::search_context::{Expected, TouchPlan, TouchResult};
use crate::features::fit::{FitParams, Observation, Surface, fit};

/// A touch that could be made: where the surface would be felt, and how.
pub(super) struct Possible {
    /// on the surface, m in O
    pub point: Point3<f64>,
    /// with the ball's centre so far from where the search begins, m
    pub travel: f64,
    pub wish: TouchPlan,
}

/// Touches of one surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Measuring {
    pub felt: Vec<Observation>,
    /// places where nothing, or nothing clear, was felt
    dead: Vec<Point3<f64>>,
    aimed: Option<Point3<f64>>,
}

/// Share of the touches that may lie elsewhere than on the surface.
const MOST_REFUSED: f64 = 0.2;
/// Places nearer than this to one where nothing was felt are not tried, m.
const DEAD: f64 = 0.2e-3;

impl Measuring {
    /// Takes a touch that was aimed at this surface.
    pub fn take(&mut self, touch: &Touched) {
        let aimed = self.aimed.take();
        match (touch.felt, aimed) {
            (TouchResult::At { .. }, _) => self.felt.extend(touch.observation),
            (_, Some(aimed)) => self.dead.push(aimed),
            (_, None) => {}
        }
    }

    /// It was felt where it should not be: that is another surface.
    pub fn refuse_last(&mut self, touch: &Touched) {
        if self.felt.last() == touch.observation.as_ref() && self.felt.pop().is_some() {
            self.dead.push(touch.wish.from);
        }
    }

    /// What the touches tell of a surface of which so much was known before.
    pub fn known<M: Surface>(&self, surface: &M, before: Knowledge, touch_sigma: f64) -> Knowledge {
        self.felt.iter().fold(before, |known, o| {
            // the ball's centre lies on the same normal as the place that it touches
            known.with(surface, &Candidate { point: o.point, sigma: o.sigma.max(touch_sigma) })
        })
    }

    /// The largest standard uncertainty of the numbers asked for over what is wanted of each, as far as the touches support it: of
    /// those that lie on one surface, and stretched where they differ from it beyond what they say of themselves.
    ///
    /// `None` where the touches do not fix a number, or where more than [`MOST_REFUSED`] of them lie elsewhere.
    pub fn told<M: Surface>(
        &self,
        guess: &M,
        params: &FitParams,
        before: Knowledge,
        asked: &Asked,
        touch_sigma: f64,
    ) -> Option<f64> {
        let fit = fit(guess, &self.felt, params).ok()?;
        let kept: Vec<_> = self.felt.iter().zip(&fit.used).filter(|(_, used)| **used).map(|(o, _)| *o).collect();
        let refused = (self.felt.len() - kept.len()) as f64;
        if !asked.is_fixed_by(&fit) || refused > MOST_REFUSED * self.felt.len() as f64 {
            return None;
        }
        let known = Self { felt: kept, ..Self::default() }.known(guess, before, touch_sigma);
        Some(known.worst(asked) * (fit.chi_squared / fit.degrees.max(1) as f64).sqrt().max(1.0))
    }

    /// The touch that tells most of what is asked, and how much that is.
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
        chosen.wish.expected = Some(Expected { travel: chosen.travel, sigma });
        Some((chosen, gain))
    }

    /// The touch that is wished for is one of this surface.
    pub fn aim(&mut self, possible: &Possible) -> TouchPlan {
        self.aimed = Some(possible.point);
        possible.wish
    }
}
