//! Where a ball falls in, near a flag that says little more than "about here".
//!
//! Down from above at the flag, then around it, next to where the ball sank deepest: a ball on a
//! rim sinks, so the path leads towards the opening.

use nalgebra::Point3;

use super::error::ExploreError;
use super::pattern::Touched;
use super::search_context::{PatternParams, SearchContext, TouchPlan, TouchResult};
use crate::features::fit::Observation;

/// Distance of the places of the search, over the ball's radius: the ball falls into a hole of 2.2
/// radii at least.
const STEP: f64 = 1.0;
/// So deep below the surface a ball is in, over its radius: the whole ball and a chamfer.
pub(super) const SHALLOW: f64 = 1.6;
/// A ball that is this much lower than the surface sinks into something, m.
const SUNK: f64 = 50e-6;
/// Touches within this of the highest are of one surface, m.
const FLAT: f64 = 30e-6;
/// What the scan says of the height may be off by this, m.
pub(super) const ROUGH: f64 = 1.5e-3;

/// Touches from above reach this far below the surface at most, over the ball's radius.
pub(super) const DEEPEST: f64 = 5.0;

/// The wall of an opening is searched this far, m.
pub(super) const REACH: f64 = 12e-3;
/// They are this far beyond the wall, over the ball's radius.
pub(super) const BESIDE: f64 = 1.3;
/// So far beyond the wall the surface is no rim any more, m.
pub(super) const CHAMFER: f64 = 0.5e-3;
/// The ball stays this far above the floor, m.
const OFF_FLOOR: f64 = 0.3e-3;
/// The wall of an opening is touched this deep at the least, over the ball's radius: below a rim
/// that is broken by no more, and as near to the opening as it may be, as the numbers refer to that
/// place.
pub(super) const BELOW_RIM: f64 = 0.7;
/// A wall that may be touched no deeper than this, over the ball's radius, is too low.
const TOO_LOW: f64 = 0.2;
/// Else it is touched no higher than this share of how deep it may be.
const HIGH: f64 = 0.6;

impl SearchContext {
    /// How far below the surface a wall may be touched, with the floor of its opening at a place of
    /// the ball's centre, m.
    pub fn above_floor(&self, depth: f64, centre: &Point3<f64>) -> f64 {
        depth
            .min(self.height - centre.z - OFF_FLOOR)
            .max(BELOW_RIM * self.params.ball_radius)
    }

    /// How far below the surface a wall may be touched that stands on the ground, m; at the highest
    /// and the deepest.
    ///
    /// - `off`: the ball stays this far above the ground, m.
    ///
    /// # Errors
    /// [`ExploreError::TooLow`].
    pub fn above_ground(
        &self,
        kind: &'static str,
        ground_z: f64,
        off: f64,
    ) -> Result<[f64; 2], ExploreError> {
        let ball = self.params.ball_radius;
        let deepest = self.height - ground_z - ball - off;
        if deepest > TOO_LOW * ball {
            let deep = deepest.min(SHALLOW * ball);
            return Ok([(BELOW_RIM * ball).min(HIGH * deep), deep]);
        }
        Err(ExploreError::TooLow {
            kind,
            height_mm: (self.height - ground_z) * 1e3,
            ball_mm: ball * 2e3,
        })
    }
}

/// Searches for an opening.
#[derive(Clone, Debug, Default)]
pub(super) struct OpeningSearch {
    /// places that were tried from above in F, and how deep the ball came
    tried: Vec<(Point3<f64>, f64)>,
    /// of the surface
    pub top: Vec<Observation>,
}

impl OpeningSearch {
    fn not_found(params: &PatternParams) -> ExploreError {
        ExploreError::NotFound {
            radius_mm: params.flag_radius * 1e3,
            ball_mm: params.ball_radius * 2e3,
        }
    }

    /// Radius of the search around the flag, m: no farther than all touches lead, each a step from
    /// the last.
    fn farthest(params: &PatternParams) -> f64 {
        let step = STEP * params.ball_radius;
        (params.flag_radius + step).min(step * params.budget as f64)
    }

    /// The next place of the search: the one not tried yet that is nearest to where the ball sank
    /// deepest, and to the flag.
    ///
    /// # Errors
    /// [`ExploreError::NotFound`] when all have been tried.
    pub fn next(&mut self, context: &mut SearchContext) -> Result<TouchPlan, ExploreError> {
        let PatternParams {
            ball_radius,
            clearance,
            ..
        } = context.params;
        let step = STEP * ball_radius;
        let sunk = context.params.beyond(SUNK);
        let deepest = self
            .tried
            .iter()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, depth)| *depth > sunk);
        let centre = deepest.map_or(Point3::origin(), |(place, _)| *place);
        let near =
            |place: &Point3<f64>| (place - centre).xy().norm() + 1e-3 * place.coords.xy().norm();
        let places = hexagonal(step, Self::farthest(&context.params));
        loop {
            let is_new = |place: &&Point3<f64>| {
                self.tried
                    .iter()
                    .all(|(tried, _)| (tried - **place).xy().norm() > step / 2.0)
            };
            let best = places
                .iter()
                .filter(is_new)
                .min_by(|a, b| near(a).total_cmp(&near(b)));
            let best = best.ok_or_else(|| Self::not_found(&context.params))?;
            if context.is_over_part(best) {
                return Ok(context.down(best, clearance + SHALLOW * ball_radius + ROUGH));
            }
            // over the edge of the part a ball sinks as over an opening
            context.leave_out(best);
            self.tried.push((*best, 0.0));
        }
    }

    /// Takes a touch; the place where the ball fell in, if it did.
    pub fn take(&mut self, context: &mut SearchContext, touch: &Touched) -> Option<Point3<f64>> {
        let wanted = context.in_f(&touch.planned.from);
        let wanted = Point3::new(wanted.x, wanted.y, 0.0);
        match (touch.result, touch.place, touch.observation) {
            (TouchResult::Nothing, ..) if !touch.is_left_out => return Some(wanted),
            (_, Some(place), Some(observation)) => {
                let surface = context.below(&place);
                // the highest is the surface; what is lower is a rim, or lower ground
                if self.tried.is_empty() || surface > context.height + context.params.beyond(SUNK) {
                    let lower = surface - context.height;
                    self.tried.iter_mut().for_each(|(_, depth)| *depth += lower);
                    context.height = surface;
                    self.top.clear();
                }
                let depth = context.height - surface;
                if depth < context.params.beyond(FLAT) {
                    self.top.push(observation);
                }
                self.tried.push((Point3::new(place.x, place.y, 0.0), depth));
            }
            _ => self.tried.push((wanted, 0.0)),
        }
        None
    }

    /// The ball slid in over a rim, and cannot be let down there again: the search goes on beside
    /// it.
    pub fn slid_in(&mut self, place: Point3<f64>, context: &SearchContext) {
        self.tried.push((place, 2.0 * context.params.ball_radius));
    }

    /// Why there is no feature yet.
    pub fn not_done(context: &SearchContext, is_open: bool) -> ExploreError {
        match is_open {
            true => Self::not_found(&context.params),
            false => ExploreError::NotDone {
                touches: context.touches,
            },
        }
    }

    /// Of the touches from above only those count where the ball lay on the surface, and not on the
    /// rim.
    pub fn forget(&mut self, is_on_rim: impl Fn(&Point3<f64>) -> bool, context: &SearchContext) {
        self.top.retain(|o| !is_on_rim(&context.in_f(&o.point)));
    }
}

/// Places of the plane z = 0 within a radius, in rows of a hexagonal grid about the origin, m.
pub(super) fn hexagonal(step: f64, radius: f64) -> Vec<Point3<f64>> {
    let rings = (radius / step).ceil() as i32 + 1;
    let place = |row: i32, column: i32| {
        let x = step * (f64::from(column) + 0.5 * f64::from(row));
        Point3::new(x, step * 0.75f64.sqrt() * f64::from(row), 0.0)
    };
    let places = (-rings..=rings)
        .flat_map(|row| (-2 * rings..=2 * rings).map(move |column| place(row, column)));
    places
        .filter(|place| place.coords.norm() <= radius)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hexagonal grid has 2π/√3 (R/s)² places within R: with 39 touches within 39 steps that is
    /// 5518, and 1.6 million within 1 m.
    #[test]
    fn a_flag_that_may_be_a_metre_off_makes_no_millions_of_places() {
        let params = PatternParams {
            flag_radius: 1.0,
            ..PatternParams::default()
        };
        let places = hexagonal(STEP * params.ball_radius, OpeningSearch::farthest(&params)).len();
        assert!((5000..6000).contains(&places), "{places}");
    }
}
