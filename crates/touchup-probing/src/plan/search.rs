//! Search for an opening near a flag that says little more than "about here".
//!
//! Down from above at the flag, then around it, next to the deepest position of the ball: a ball on
//! a rim sinks, so the path leads towards the opening.

use nalgebra::Point3;

use super::error::ExploreError;
use super::pattern::PatternStep;
use super::search_context::{PatternParams, SearchContext, TouchPlan, TouchResult};
use touchup_features::features::fit::Observation;

/// Spacing of the search, over the ball's radius: the ball falls into a hole of 2.2 radii at least.
const STEP: f64 = 1.0;
/// Depth of a ball in an opening, over its radius: the whole ball and a chamfer.
pub(super) const SHALLOW: f64 = 1.6;
/// Depth below the surface from which on a ball sinks into something, m.
const SUNK: f64 = 50e-6;
/// Maximum depth of touches on one surface below the highest, m.
const FLAT: f64 = 30e-6;
/// Maximum error of the scan's height, m.
pub(super) const ROUGH: f64 = 1.5e-3;

/// Maximum reach of touches from above below the surface, over the ball's radius.
pub(super) const DEEPEST: f64 = 5.0;

/// Length of a search for the wall of an opening, m.
pub(super) const REACH: f64 = 12e-3;
/// Distance of touches of the surface beyond the wall, over the ball's radius.
pub(super) const BESIDE: f64 = 1.3;
/// Distance beyond the wall from which on the surface is no rim any more, m.
pub(super) const CHAMFER: f64 = 0.5e-3;
/// Distance of the ball above the floor, m.
const OFF_FLOOR: f64 = 0.3e-3;
/// Minimum depth of touches on the wall of an opening, over the ball's radius: below a rim broken
/// by no more, and as near as possible to the opening, to which the numbers refer.
pub(super) const BELOW_RIM: f64 = 0.7;
/// Maximum depth of touches, over the ball's radius, for which a wall is too low.
const TOO_LOW: f64 = 0.2;
/// Maximum depth of the highest touch of a wall, over its deepest touch.
const HIGH: f64 = 0.6;

impl SearchContext {
    /// Depth of the deepest touch of a wall below the surface, for a centre of the ball on the
    /// floor of its opening, m.
    pub(crate) fn above_floor(&self, depth: f64, centre: &Point3<f64>) -> f64 {
        depth
            .min(self.height - centre.z - OFF_FLOOR)
            .max(BELOW_RIM * self.params.ball_radius)
    }

    /// Depths of touches of a wall on the ground below the surface, m: highest and deepest.
    ///
    /// - `off`: distance of the ball above the ground, m.
    ///
    /// # Errors
    /// [`ExploreError::TooLow`].
    pub(crate) fn above_ground(
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

/// Search for an opening.
#[derive(Clone, Debug, Default)]
pub(super) struct OpeningSearch {
    /// places tried from above in F, and depth of the ball there
    tried: Vec<(Point3<f64>, f64)>,
    /// contacts of the surface
    pub top: Vec<Observation>,
}

impl OpeningSearch {
    fn not_found(params: &PatternParams) -> ExploreError {
        ExploreError::NotFound {
            radius_mm: params.flag_radius * 1e3,
            ball_mm: params.ball_radius * 2e3,
        }
    }

    /// Radius of the search around the flag, m: within the travel of all touches, each a step from
    /// the last.
    fn farthest(params: &PatternParams) -> f64 {
        let step = STEP * params.ball_radius;
        (params.flag_radius + step).min(step * params.budget as f64)
    }

    /// Next place of the search: the untried place nearest to the deepest position of the ball, and
    /// to the flag.
    ///
    /// # Errors
    /// [`ExploreError::NotFound`] after all places.
    pub(crate) fn next(&mut self, context: &mut SearchContext) -> Result<TouchPlan, ExploreError> {
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

    /// Takes a touch; returns its place if the ball fell in.
    pub(crate) fn take(
        &mut self,
        context: &mut SearchContext,
        touch: &PatternStep,
    ) -> Option<Point3<f64>> {
        let wanted = context.in_f(&touch.planned.from);
        let wanted = Point3::new(wanted.x, wanted.y, 0.0);
        match (touch.result, touch.place, touch.observation) {
            (TouchResult::Nothing, ..) if !touch.is_left_out => return Some(wanted),
            (_, Some(place), Some(observation)) => {
                let surface = context.below(&place);
                // the highest is the surface; lower places are a rim, or lower ground
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

    /// Marks a place at which the ball slid in over a rim and cannot go down again: the search goes
    /// on beside it.
    pub(crate) fn slid_in(&mut self, place: Point3<f64>, context: &SearchContext) {
        self.tried.push((place, 2.0 * context.params.ball_radius));
    }

    /// Why there is no feature yet.
    pub(crate) fn not_done(context: &SearchContext, is_open: bool) -> ExploreError {
        match is_open {
            true => Self::not_found(&context.params),
            false => ExploreError::NotDone {
                touches: context.touches,
            },
        }
    }

    /// Keeps of the touches from above only those on the surface, not on the rim.
    pub(crate) fn forget(
        &mut self,
        is_on_rim: impl Fn(&Point3<f64>) -> bool,
        context: &SearchContext,
    ) {
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

    /// A hexagonal grid has 2π/√3 (R/s)² places within R: 5518 for 39 touches within 39 steps, and
    /// 1.6 million within 1 m.
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
