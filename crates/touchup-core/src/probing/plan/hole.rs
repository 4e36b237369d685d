//! A hole from one flag: found by what is missing, measured by its wall.
//!
//! 1. Where the ball falls in ([`OpeningSearch`]).
//! 2. Sideways from there in three directions: a first circle. Its middle is a better place to touch from.
//! 3. Down in the middle: how deep it is, and how deep the wall may be touched.
//! 4. Down around the hole: the plane of its opening.
//! 5. The wall where a touch has the largest gain, at two depths.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::cylinder_fit::{BELOW_RIM, RoundWall, surface_about};
use super::error::ExploreError;
use super::pattern::{Next, Stage, Touched};
use super::search::{OpeningSearch, ROUGH, SHALLOW};
use super::search_context::{PatternParams, SearchContext, TouchResult};
use super::slide::{RimStation, Slide, circle};
use crate::features::fit::Observation;
use crate::features::{End, Feature};

/// A wall is searched this far, m.
const REACH: f64 = 12e-3;
/// First directions.
const FIRST: usize = 3;
/// More directions that are tried after a miss in the first one.
const MOST_FIRST: usize = 6;
/// Touches of the surface around the opening.
const AROUND: usize = 4;
/// They are this far beyond the wall, over the ball's radius.
const BESIDE: f64 = 1.3;
/// So far beyond the wall the surface is no rim any more, m.
const CHAMFER: f64 = 0.5e-3;
/// The ball stays this far above the floor, m.
pub(super) const OFF_FLOOR: f64 = 0.3e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum HolePhase {
    Opening,
    First,
    Floor,
    Around,
    Wall,
}

#[derive(Clone, Debug)]
pub(super) struct HolePattern {
    phase: HolePhase,
    opening: OpeningSearch,
    wall: RoundWall,
    floor: Option<End>,
    /// the ball's centre on it, m in O
    on_floor: Option<Point3<f64>>,
    /// how deep the wall may be touched, m
    depth: f64,
    first: usize,
    around: usize,
}

impl HolePattern {
    pub fn new(params: &PatternParams) -> Self {
        let depth = params.depth.max(SHALLOW * params.ball_radius);
        Self {
            phase: HolePhase::Opening,
            opening: OpeningSearch::default(),
            wall: RoundWall::default(),
            floor: None,
            on_floor: None,
            depth,
            first: 0,
            around: 0,
        }
    }

    fn take_first(&mut self, context: &SearchContext, touch: &Touched) {
        if self.wall.measuring.observations.is_empty() && touch.result == TouchResult::Unclear {
            self.opening.slid_in(self.wall.middle, context);
            self.phase = HolePhase::Opening;
            return;
        }
        self.wall.measuring.take(touch);
        self.first += 1;
        if self.wall.measuring.observations.len() >= FIRST {
            self.wall.recentre(context);
            let (rim, middle) = (self.wall.radius(context) + CHAMFER, self.wall.middle);
            self.opening.forget(|p| (p - middle).xy().norm() <= rim, context);
            self.phase = HolePhase::Floor;
        }
    }

    fn take_around(&mut self, context: &mut SearchContext, touch: &Touched) {
        self.opening.top.extend(touch.observation);
        self.around += 1;
        if self.around >= AROUND {
            context.level(&mut self.opening.top, false, &mut [&mut self.wall.middle]);
            if let Some(centre) = self.on_floor {
                let deepest = context.height - context.in_f(&centre).z - OFF_FLOOR;
                self.depth = self.depth.min(deepest).max(BELOW_RIM * context.params.ball_radius);
            }
            self.phase = HolePhase::Wall;
        }
    }
}

impl Stage for HolePattern {
    fn next(&mut self, context: &SearchContext) -> Next {
        let ball = context.params.ball_radius;
        match self.phase {
            HolePhase::Opening => {
                let planned = self.opening.next(context);
                planned.map_or_else(|| Next::Failed(OpeningSearch::not_found(&context.params)), Next::Touch)
            }
            HolePhase::First if self.first >= MOST_FIRST => Next::Failed(ExploreError::NoWall {
                kind: "hole",
                walls: self.wall.measuring.observations.len(),
                asked: self.first,
                reach_mm: REACH * 1e3,
            }),
            HolePhase::First => {
                // a second round goes between the first
                let turn = self.first as f64 + 0.5 * (self.first / FIRST) as f64;
                let angle = turn / FIRST as f64 * TAU;
                let direction = Vector3::new(angle.cos(), angle.sin(), 0.0);
                Next::Touch(context.sideways(&self.wall.middle, SHALLOW * ball, &direction, REACH))
            }
            HolePhase::Floor => Next::Touch(context.sideways(&self.wall.middle, SHALLOW * ball, &-Vector3::z(), REACH)),
            HolePhase::Around => {
                let angle = self.around as f64 / AROUND as f64 * TAU;
                let away = self.wall.radius(context) + BESIDE * ball;
                let place = self.wall.middle + Vector3::new(angle.cos(), angle.sin(), 0.0) * away;
                Next::Touch(context.down(&place, context.params.clearance + 2.0 * ball + ROUGH))
            }
            HolePhase::Wall if self.wall.is_known(context) => Next::Done { is_as_asked: true },
            HolePhase::Wall => {
                let planned = self.wall.best(context, [BELOW_RIM * ball, self.depth]);
                planned.map_or(Next::Done { is_as_asked: false }, Next::Touch)
            }
        }
    }

    fn take(&mut self, context: &mut SearchContext, touch: &Touched) {
        match self.phase {
            HolePhase::Opening => {
                if let Some(place) = self.opening.take(context, touch) {
                    self.wall.middle = place;
                    self.phase = HolePhase::First;
                }
            }
            HolePhase::First => self.take_first(context, touch),
            HolePhase::Floor => {
                let below = |o: Observation| End { point: o.point - context.out() * o.offset, sigma: o.sigma };
                self.floor = touch.observation.map(below);
                self.on_floor = touch.place.map(|place| context.pose_of * place);
                self.phase = HolePhase::Around;
            }
            HolePhase::Around => self.take_around(context, touch),
            HolePhase::Wall => {
                self.wall.measuring.take(touch);
                self.wall.recentre(context);
            }
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        if self.opening.top.len() < 3 || self.wall.measuring.observations.len() < FIRST {
            return Err(match self.phase {
                HolePhase::Opening => OpeningSearch::not_found(&context.params),
                _ => ExploreError::NotDone { touches: context.touches },
            });
        }
        let top = surface_about(context, &self.wall.middle, &self.opening.top)?;
        let wall = self.wall.fitted(context, &top)?;
        let touches = numbers([&self.wall.measuring.observations, &self.opening.top]);
        Ok(Some(Feature::round(&wall, &top, self.floor.as_ref(), touches)))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        self.wall.uncertainty(context)
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let (ball, radius) = (context.params.ball_radius, self.wall.radius(context));
        let middle = Point3::new(self.wall.middle.x, self.wall.middle.y, context.height);
        let rim = RimStation {
            at: &circle(middle, radius, -1.0),
            length: TAU * radius,
            is_closed: true,
            back: BESIDE * ball,
            depths: [BELOW_RIM * ball, self.depth],
            room: radius - ball,
        };
        rim.slides(context)
    }
}

/// Numbers of the touches with contact, in ascending order.
pub(super) fn numbers<const N: usize>(observations: [&Vec<Observation>; N]) -> Vec<u32> {
    let mut numbers: Vec<u32> = observations.into_iter().flatten().map(|o| o.group).collect();
    numbers.sort_unstable();
    numbers
}
