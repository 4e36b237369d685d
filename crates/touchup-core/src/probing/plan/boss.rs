//! A boss from one flag: its top, where the ground begins beside it in three directions, then its wall from outside.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::cylinder_fit::{BELOW_RIM, RoundWall, surface_about};
use super::error::ExploreError;
use super::hole::numbers;
use super::pattern::{Next, Stage, Touched};
use super::search::{ROUGH, SHALLOW};
use super::search_context::{SearchContext, TouchResult};
use super::slide::{RimStation, Slide, circle};
use crate::features::fit::Observation;
use crate::features::{End, Feature};

/// Places around the flag where the top is searched, beside the flag itself.
const RING: usize = 6;
/// First directions.
const FIRST: usize = 3;
/// More directions that are tried after a miss in the first one.
const MOST_FIRST: usize = 6;
/// Touches of the ground around the foot.
const AROUND: usize = 4;
/// The distance of the search outward grows by this factor.
const FARTHER: f64 = 1.4;
/// No boss is larger, m.
const LARGEST: f64 = 30e-3;
/// Lower than the top by this, over the ball's radius, is beside it.
const BESIDE: f64 = 1.2;
/// The ball stays this far above the ground, m.
const OFF_GROUND: f64 = 0.4e-3;
/// Depth of the search for the ground, over the ball's radius.
const GROUND: f64 = 5.0;
/// The wall is touched no higher than this share of how deep it may be.
const HIGH: f64 = 0.6;
/// The top is slid over so far towards its middle.
const HALF: f64 = 0.5;
/// Heights within this are of one surface, m.
const FLAT: f64 = 0.3e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum BossPhase {
    Top,
    /// out of the top, to a distance from the middle that is tried, m
    Out(f64),
    /// inward from there
    In(f64),
    Ground,
    Wall,
}

#[derive(Clone, Debug)]
pub(super) struct BossPattern {
    phase: BossPhase,
    /// from above
    seen: Vec<Observation>,
    wall: RoundWall,
    ground: Vec<Observation>,
    /// height of the ground in F, m; at a miss, the depth of the search
    ground_z: f64,
    direction: usize,
    around: usize,
}

impl BossPattern {
    pub fn new() -> Self {
        Self {
            phase: BossPhase::Top,
            seen: Vec::new(),
            wall: RoundWall { is_boss: true, ..RoundWall::default() },
            ground: Vec::new(),
            ground_z: f64::NEG_INFINITY,
            direction: 0,
            around: 0,
        }
    }

    fn outward(&self) -> Vector3<f64> {
        // a second round goes between the first
        let turn = self.direction as f64 + 0.5 * (self.direction / FIRST) as f64;
        let angle = turn / FIRST as f64 * TAU;
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    }

    /// How far below the top the wall is touched: between the edge of the top and the ground, m.
    fn depth(&self, context: &SearchContext) -> Option<f64> {
        let ball = context.params.ball_radius;
        let deepest = context.height - self.ground_z - ball - OFF_GROUND;
        (deepest > 0.2 * ball).then(|| deepest.min(SHALLOW * ball))
    }

    fn too_low(&self, context: &SearchContext) -> ExploreError {
        let height_mm = (context.height - self.ground_z) * 1e3;
        ExploreError::TooLow { kind: "boss", height_mm, ball_mm: context.params.ball_radius * 2e3 }
    }

    fn take_top(&mut self, context: &mut SearchContext, touch: &Touched) {
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
            context.height = places.iter().map(|p| context.below(p)).fold(f64::NEG_INFINITY, f64::max);
        }
        let high: Vec<_> = places.into_iter().filter(|p| (context.below(p) - context.height).abs() < FLAT).collect();
        let sum = high.iter().map(|place| place.coords).sum::<Vector3<f64>>();
        self.wall.middle = Point3::from(sum / high.len().max(1) as f64);
        self.wall.middle.z = 0.0;
        self.seen = top;
        self.phase = BossPhase::Out(context.params.flag_radius + context.params.ball_radius);
    }

    fn take_out(&mut self, context: &SearchContext, touch: &Touched, distance: f64) {
        let ball = context.params.ball_radius;
        let lowest = context.height - GROUND * ball;
        let z = touch.place.map_or(lowest, |place| context.below(&place));
        let is_beside = touch.result != TouchResult::Unclear && context.height - z > BESIDE * ball;
        if is_beside {
            self.ground_z = self.ground_z.max(z);
            self.phase = BossPhase::In(distance);
        } else {
            self.phase = BossPhase::Out(distance * FARTHER);
        }
    }

    fn take_in(&mut self, context: &SearchContext, touch: &Touched, distance: f64) {
        let before = self.wall.measuring.observations.len();
        self.wall.measuring.take(touch);
        if self.wall.measuring.observations.len() == before && touch.result == TouchResult::Unclear {
            // another surface was hit
            self.phase = BossPhase::Out(distance * FARTHER);
            return;
        }
        self.direction += 1;
        let reached = touch.place.map_or(distance, |place| (place - self.wall.middle).xy().norm());
        self.phase = match self.wall.measuring.observations.len() < FIRST {
            true => BossPhase::Out(reached + context.params.clearance),
            false => BossPhase::Ground,
        };
        if self.phase == BossPhase::Ground {
            self.wall.recentre(context);
        }
    }
}

impl Stage for BossPattern {
    fn next(&mut self, context: &SearchContext) -> Next {
        let (ball, clearance) = (context.params.ball_radius, context.params.clearance);
        match self.phase {
            BossPhase::Top => {
                let angle = self.around as f64 / RING as f64 * TAU;
                let far = if self.around == 0 { 0.0 } else { context.params.flag_radius };
                let place = Point3::new(far * angle.cos(), far * angle.sin(), 0.0);
                Next::Touch(context.down(&place, clearance + GROUND * ball + ROUGH))
            }
            BossPhase::Out(distance) if distance > LARGEST || self.direction >= MOST_FIRST => {
                Next::Failed(ExploreError::NoWall {
                    kind: "boss",
                    walls: self.wall.measuring.observations.len(),
                    asked: self.direction + 1,
                    reach_mm: LARGEST * 1e3,
                })
            }
            BossPhase::Out(distance) => {
                let place = self.wall.middle + self.outward() * distance;
                Next::Touch(context.down(&place, clearance + GROUND * ball))
            }
            BossPhase::In(distance) => match self.depth(context) {
                None => Next::Failed(self.too_low(context)),
                Some(depth) => {
                    let place = self.wall.middle + self.outward() * distance;
                    Next::Touch(context.sideways(&place, depth, &-self.outward(), distance))
                }
            },
            BossPhase::Ground => {
                let angle = (self.around as f64 + 0.5) / AROUND as f64 * TAU;
                let away = self.wall.radius(context) + 2.0 * BESIDE * ball;
                let place = self.wall.middle + Vector3::new(angle.cos(), angle.sin(), 0.0) * away;
                Next::Touch(context.down(&place, clearance + GROUND * ball))
            }
            BossPhase::Wall if self.wall.is_known(context) => Next::Done { is_as_asked: true },
            BossPhase::Wall => {
                let Some(deep) = self.depth(context) else { return Next::Failed(self.too_low(context)) };
                let planned = self.wall.best(context, [(BELOW_RIM * ball).min(HIGH * deep), deep]);
                planned.map_or(Next::Done { is_as_asked: false }, Next::Touch)
            }
        }
    }

    fn take(&mut self, context: &mut SearchContext, touch: &Touched) {
        match self.phase {
            BossPhase::Top => self.take_top(context, touch),
            BossPhase::Out(distance) => self.take_out(context, touch, distance),
            BossPhase::In(distance) => self.take_in(context, touch, distance),
            BossPhase::Ground => {
                let is_ground =
                    touch.place.is_some_and(|p| (context.below(&p) - self.ground_z).abs() < context.params.ball_radius);
                self.ground.extend(touch.observation.filter(|_| is_ground));
                self.around += 1;
                if self.around >= AROUND {
                    self.phase = BossPhase::Wall;
                }
            }
            BossPhase::Wall => {
                self.wall.measuring.take(touch);
                self.wall.recentre(context);
            }
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        if self.ground.len() < 3 || self.wall.measuring.observations.len() < FIRST {
            return Err(ExploreError::NotDone { touches: context.touches });
        }
        let foot = surface_about(context, &self.wall.middle, &self.ground)?;
        let wall = self.wall.fitted(context, &foot)?;
        let height = |o: &Observation| context.in_f(&o.point).z;
        let highest = self.seen.iter().max_by(|a, b| height(a).total_cmp(&height(b)));
        let top = highest.map(|o| End { point: o.point - context.out() * o.offset, sigma: o.sigma });
        let touches = numbers([&self.wall.measuring.observations, &self.ground]);
        Ok(Some(Feature::round(&wall, &foot, top.as_ref(), touches)))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        self.wall.uncertainty(context)
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let (ball, radius) = (context.params.ball_radius, self.wall.radius(context));
        let Some(deep) = self.depth(context) else { return Vec::new() };
        let middle = Point3::new(self.wall.middle.x, self.wall.middle.y, context.height);
        let rim = RimStation {
            at: &circle(middle, radius, 1.0),
            length: TAU * radius,
            is_closed: true,
            back: ball.min(HALF * radius),
            depths: [(BELOW_RIM * ball).min(HIGH * deep), deep],
            room: context.params.clearance,
        };
        rim.slides(context)
    }
}
