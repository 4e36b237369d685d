//! A boss from one flag: its top, the start of the ground beside it in three directions, then its
//! wall from outside.

use nalgebra::Vector3;

use super::cylinder_fit::{FIRST, MOST_FIRST, RoundWall, surface_about};
use super::hole::numbers;
use crate::plan::error::ExploreError;
use crate::plan::pattern::{PatternStep, TouchPattern};
use crate::plan::search::{DEEPEST, ROUGH};
use crate::plan::search_context::{AROUND, RING, SearchContext, TouchPlan, TouchResult};
use crate::plan::slide::Slide;
use touchup_features::features::Feature;
use touchup_features::features::fit::{Cylinder, Fit, Observation, Plane};
use touchup_geometry::numeric::mean;
use touchup_method::reconstruct::KnownSurface;

/// Growth of the distance in the search outward.
const FARTHER: f64 = 1.4;
/// Maximum distance of this search, m: no boss is larger.
const LARGEST: f64 = 30e-3;
/// Depth below the top that is beside the boss, over the ball's radius.
const BESIDE: f64 = 1.2;
/// Distance of the ball above the ground, m.
const OFF_GROUND: f64 = 0.4e-3;
/// Reach of slides over the top towards its middle, over its radius.
const HALF: f64 = 0.5;
/// Maximum difference of heights on one surface, m.
const FLAT: f64 = 0.3e-3;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum BossPhase {
    #[default]
    Top,
    /// down beside the top, at this distance from the middle, m
    Out(f64),
    /// inward from this distance, m
    In(f64),
    Ground,
    Wall,
}

#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct BossPattern {
    phase: BossPhase,
    /// contacts from above
    seen: Vec<Observation>,
    wall: RoundWall,
    ground: Vec<Observation>,
    /// height of the ground in F, m; at a miss, the depth of the search
    ground_z: f64,
    direction: usize,
    around: usize,
}

impl BossPattern {
    pub(crate) fn new() -> Self {
        let wall = RoundWall {
            is_boss: true,
            ..RoundWall::default()
        };
        Self {
            wall,
            ground_z: f64::NEG_INFINITY,
            ..Self::default()
        }
    }

    /// Depth of touches of the wall below the top, between the edge of the top and the ground, m:
    /// highest and deepest.
    fn depths(&self, context: &SearchContext) -> Result<[f64; 2], ExploreError> {
        context.above_ground("boss", self.ground_z, OFF_GROUND)
    }

    /// The ground around the boss, and its wall.
    fn fitted(&self, context: &SearchContext) -> Result<(Fit<Plane>, Fit<Cylinder>), ExploreError> {
        if self.ground.len() < 3 || self.wall.measuring.observations.len() < FIRST {
            return Err(ExploreError::NotDone {
                touches: context.touches,
            });
        }
        let foot = surface_about(context, &self.wall.middle, &self.ground)?;
        let wall = self.wall.fitted(context, &foot)?;
        Ok((foot, wall))
    }

    fn take_top(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.seen.extend(touch.observation);
        self.around += 1;
        if self.around <= RING {
            return;
        }
        self.around = 0;
        let mut top: Vec<Observation> = self.seen.clone();
        context.level(&mut top, true, &mut []);
        let places: Vec<_> = top.iter().map(|o| context.in_f(&o.point)).collect();
        if top.len() < 3 {
            context.height = places
                .iter()
                .map(|p| context.below(p))
                .fold(f64::NEG_INFINITY, f64::max);
        }
        let high = places
            .iter()
            .filter(|p| (context.below(p) - context.height).abs() < FLAT);
        self.wall.middle = mean(high.map(|place| Vector3::new(place.x, place.y, 0.0))).into();
        self.seen = top;
        self.phase = BossPhase::Out(context.params.flag_radius + context.params.ball_radius);
    }

    fn take_out(&mut self, context: &SearchContext, touch: &PatternStep, distance: f64) {
        let ball = context.params.ball_radius;
        let lowest = context.height - DEEPEST * ball;
        let z = touch.place.map_or(lowest, |place| context.below(&place));
        if touch.result != TouchResult::Unclear && context.height - z > BESIDE * ball {
            self.ground_z = self.ground_z.max(z);
            self.phase = BossPhase::In(distance);
        } else {
            self.phase = BossPhase::Out(distance * FARTHER);
        }
    }

    fn take_in(&mut self, context: &SearchContext, touch: &PatternStep, distance: f64) {
        let before = self.wall.measuring.observations.len();
        self.wall.measuring.take(touch);
        if self.wall.measuring.observations.len() == before && touch.result == TouchResult::Unclear
        {
            // contact with another surface
            self.phase = BossPhase::Out(distance * FARTHER);
            return;
        }
        self.direction += 1;
        let reached = touch
            .place
            .map_or(distance, |place| (place - self.wall.middle).xy().norm());
        if self.wall.measuring.observations.len() < FIRST {
            self.phase = BossPhase::Out(reached + context.params.clearance);
        } else {
            self.wall.recentre(context);
            self.phase = BossPhase::Ground;
        }
    }
}

impl TouchPattern for BossPattern {
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError> {
        let (ball, clearance) = (context.params.ball_radius, context.params.clearance);
        let (middle, outward) = (self.wall.middle, RoundWall::first_direction(self.direction));
        Ok(Some(match self.phase {
            BossPhase::Top => context.ring(
                self.around,
                context.params.flag_radius,
                clearance + DEEPEST * ball + ROUGH,
            ),
            BossPhase::Out(distance) if distance > LARGEST || self.direction >= MOST_FIRST => {
                return Err(self.wall.missing(self.direction + 1, LARGEST));
            }
            BossPhase::Out(distance) => {
                context.down(&(middle + outward * distance), clearance + DEEPEST * ball)
            }
            BossPhase::In(distance) => context.sideways(
                &(middle + outward * distance),
                self.depths(context)?[1],
                &-outward,
                distance,
            ),
            BossPhase::Ground => {
                let away = self.wall.radius(context) + 2.0 * BESIDE * ball;
                let place = context.around(self.around, 0.5, &middle, away);
                context.down(&place, clearance + DEEPEST * ball)
            }
            BossPhase::Wall => return Ok(self.wall.next(context, self.depths(context)?)),
        }))
    }

    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        match self.phase {
            BossPhase::Top => self.take_top(context, touch),
            BossPhase::Out(distance) => self.take_out(context, touch, distance),
            BossPhase::In(distance) => self.take_in(context, touch, distance),
            BossPhase::Ground => {
                let is_ground = touch.place.is_some_and(|p| {
                    (context.below(&p) - self.ground_z).abs() < context.params.ball_radius
                });
                self.ground.extend(touch.observation.filter(|_| is_ground));
                self.around += 1;
                if self.around >= AROUND {
                    self.phase = BossPhase::Wall;
                }
            }
            BossPhase::Wall => self.wall.take(context, touch),
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        let (foot, wall) = self.fitted(context)?;
        let height = |o: &Observation| context.in_f(&o.point).z;
        let highest = self
            .seen
            .iter()
            .max_by(|a, b| height(a).total_cmp(&height(b)));
        let top = highest.map(|contact| context.end(contact));
        let touches = numbers([&self.wall.measuring.observations, &self.ground]);
        Ok(Some(Feature::round(&wall, &foot, top.as_ref(), touches)))
    }

    fn known_surfaces(&self, context: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError> {
        let (foot, wall) = self.fitted(context)?;
        let is_top = |o: &&Observation| {
            (context.below(&context.in_f(&o.point)) - context.height).abs() < FLAT
        };
        let on_top: Vec<_> = self.seen.iter().filter(is_top).copied().collect();
        let top = surface_about(context, &self.wall.middle, &on_top);
        let top = top.ok().filter(|_| on_top.len() >= 3);
        Ok(context.surfaces_of_boss(
            (&wall, &self.wall.measuring.observations),
            (&foot, &self.ground),
            top.as_ref().map(|top| (top, &*on_top)),
        ))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        self.wall.uncertainty(context)
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let Ok(depths) = self.depths(context) else {
            return Vec::new();
        };
        let back = context
            .params
            .ball_radius
            .min(HALF * self.wall.radius(context));
        self.wall
            .slides(context, back, depths, context.params.clearance)
    }
}
