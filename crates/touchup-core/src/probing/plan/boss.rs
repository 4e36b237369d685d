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

/// Places around the flag where the top is looked for, beside the flag itself.
const RING: usize = 6;
/// First directions.
const FIRST: usize = 3;
/// More directions that are tried where a first one felt nothing.
const MOST_FIRST: usize = 6;
/// Touches of the ground around the foot.
const AROUND: usize = 4;
/// The way outward goes on by this factor.
const FARTHER: f64 = 1.4;
/// No boss is larger, m.
const LARGEST: f64 = 30e-3;
/// Lower than the top by this, over the ball's radius, is beside it.
const BESIDE: f64 = 1.2;
/// The ball stays this far above the ground, m.
const OFF_GROUND: f64 = 0.4e-3;
/// So far down the ground is looked for, over the ball's radius.
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
    /// height of the ground in F, m; where nothing was felt, as deep as it was looked for
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

    fn way(&self) -> Vector3<f64> {
        // a second round goes between the first
        let turn = self.direction as f64 + 0.5 * (self.direction / FIRST) as f64;
        let angle = turn / FIRST as f64 * TAU;
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    }

    /// How far below the top the wall is touched: between the edge of the top and the ground, m.
    fn depth(&self, course: &SearchContext) -> Option<f64> {
        let ball = course.params.ball_radius;
        let deepest = course.height - self.ground_z - ball - OFF_GROUND;
        (deepest > 0.2 * ball).then(|| deepest.min(SHALLOW * ball))
    }

    fn too_low(&self, course: &SearchContext) -> ExploreError {
        let height_mm = (course.height - self.ground_z) * 1e3;
        ExploreError::TooLow { kind: "boss", height_mm, ball_mm: course.params.ball_radius * 2e3 }
    }

    fn take_top(&mut self, course: &mut SearchContext, touch: &Touched) {
        self.seen.extend(touch.observation);
        self.around += 1;
        if self.around <= RING {
            return;
        }
        self.around = 0;
        let mut top: Vec<Observation> = self.seen.clone();
        course.level(&mut top, true, &mut []);
        let places: Vec<_> = top.iter().map(|o| course.in_f(&o.point)).collect();
        if top.len() < 3 {
            course.height = places.iter().map(|p| course.below(p)).fold(f64::NEG_INFINITY, f64::max);
        }
        let high: Vec<_> = places.into_iter().filter(|p| (course.below(p) - course.height).abs() < FLAT).collect();
        let sum = high.iter().map(|place| place.coords).sum::<Vector3<f64>>();
        self.wall.middle = Point3::from(sum / high.len().max(1) as f64);
        self.wall.middle.z = 0.0;
        self.seen = top;
        self.phase = BossPhase::Out(course.params.flag_radius + course.params.ball_radius);
    }

    fn take_out(&mut self, course: &SearchContext, touch: &Touched, distance: f64) {
        let ball = course.params.ball_radius;
        let lowest = course.height - GROUND * ball;
        let z = touch.place.map_or(lowest, |place| course.below(&place));
        let is_beside = touch.felt != TouchResult::Unclear && course.height - z > BESIDE * ball;
        if is_beside {
            self.ground_z = self.ground_z.max(z);
            self.phase = BossPhase::In(distance);
        } else {
            self.phase = BossPhase::Out(distance * FARTHER);
        }
    }

    fn take_in(&mut self, course: &SearchContext, touch: &Touched, distance: f64) {
        let before = self.wall.measuring.felt.len();
        self.wall.measuring.take(touch);
        if self.wall.measuring.felt.len() == before && touch.felt == TouchResult::Unclear {
            // something else was in the way
            self.phase = BossPhase::Out(distance * FARTHER);
            return;
        }
        self.direction += 1;
        let reached = touch.place.map_or(distance, |place| (place - self.wall.middle).xy().norm());
        self.phase = match self.wall.measuring.felt.len() < FIRST {
            true => BossPhase::Out(reached + course.params.clearance),
            false => BossPhase::Ground,
        };
        if self.phase == BossPhase::Ground {
            self.wall.recentre(course);
        }
    }
}

impl Stage for BossPattern {
    fn next(&mut self, course: &SearchContext) -> Next {
        let (ball, clearance) = (course.params.ball_radius, course.params.clearance);
        match self.phase {
            BossPhase::Top => {
                let angle = self.around as f64 / RING as f64 * TAU;
                let far = if self.around == 0 { 0.0 } else { course.params.flag_radius };
                let place = Point3::new(far * angle.cos(), far * angle.sin(), 0.0);
                Next::Touch(course.down(&place, clearance + GROUND * ball + ROUGH))
            }
            BossPhase::Out(distance) if distance > LARGEST || self.direction >= MOST_FIRST => {
                Next::Failed(ExploreError::NoWall {
                    kind: "boss",
                    walls: self.wall.measuring.felt.len(),
                    asked: self.direction + 1,
                    reach_mm: LARGEST * 1e3,
                })
            }
            BossPhase::Out(distance) => {
                let place = self.wall.middle + self.way() * distance;
                Next::Touch(course.down(&place, clearance + GROUND * ball))
            }
            BossPhase::In(distance) => match self.depth(course) {
                None => Next::Failed(self.too_low(course)),
                Some(depth) => {
                    let place = self.wall.middle + self.way() * distance;
                    Next::Touch(course.sideways(&place, depth, &-self.way(), distance))
                }
            },
            BossPhase::Ground => {
                let angle = (self.around as f64 + 0.5) / AROUND as f64 * TAU;
                let away = self.wall.radius(course) + 2.0 * BESIDE * ball;
                let place = self.wall.middle + Vector3::new(angle.cos(), angle.sin(), 0.0) * away;
                Next::Touch(course.down(&place, clearance + GROUND * ball))
            }
            BossPhase::Wall if self.wall.is_known(course) => Next::Done { is_as_asked: true },
            BossPhase::Wall => {
                let Some(deep) = self.depth(course) else { return Next::Failed(self.too_low(course)) };
                let wish = self.wall.best(course, [(BELOW_RIM * ball).min(HIGH * deep), deep]);
                wish.map_or(Next::Done { is_as_asked: false }, Next::Touch)
            }
        }
    }

    fn take(&mut self, course: &mut SearchContext, touch: &Touched) {
        match self.phase {
            BossPhase::Top => self.take_top(course, touch),
            BossPhase::Out(distance) => self.take_out(course, touch, distance),
            BossPhase::In(distance) => self.take_in(course, touch, distance),
            BossPhase::Ground => {
                let is_ground =
                    touch.place.is_some_and(|p| (course.below(&p) - self.ground_z).abs() < course.params.ball_radius);
                self.ground.extend(touch.observation.filter(|_| is_ground));
                self.around += 1;
                if self.around >= AROUND {
                    self.phase = BossPhase::Wall;
                }
            }
            BossPhase::Wall => {
                self.wall.measuring.take(touch);
                self.wall.recentre(course);
            }
        }
    }

    fn feature(&self, course: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        if self.ground.len() < 3 || self.wall.measuring.felt.len() < FIRST {
            return Err(ExploreError::NotDone { touches: course.touches });
        }
        let foot = surface_about(course, &self.wall.middle, &self.ground)?;
        let wall = self.wall.fitted(course, &foot)?;
        let height = |o: &Observation| course.in_f(&o.point).z;
        let highest = self.seen.iter().max_by(|a, b| height(a).total_cmp(&height(b)));
        let top = highest.map(|o| End { point: o.point - course.out() * o.offset, sigma: o.sigma });
        let touches = numbers([&self.wall.measuring.felt, &self.ground]);
        Ok(Some(Feature::round(&wall, &foot, top.as_ref(), touches)))
    }

    fn uncertainty(&self, course: &SearchContext) -> Option<f64> {
        self.wall.uncertainty(course)
    }

    fn slides(&self, course: &SearchContext) -> Vec<Slide> {
        let (ball, radius) = (course.params.ball_radius, self.wall.radius(course));
        let Some(deep) = self.depth(course) else { return Vec::new() };
        let middle = Point3::new(self.wall.middle.x, self.wall.middle.y, course.height);
        let rim = RimStation {
            at: &circle(middle, radius, 1.0),
            length: TAU * radius,
            is_closed: true,
            back: ball.min(HALF * radius),
            depths: [(BELOW_RIM * ball).min(HIGH * deep), deep],
            room: course.params.clearance,
        };
        rim.slides(course)
    }
}
