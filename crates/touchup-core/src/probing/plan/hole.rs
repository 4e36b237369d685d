//! A hole from one flag: found by what is missing, measured by its wall.
//!
//! 1. Where the ball falls in ([`Looking`]).
//! 2. Sideways from there in three directions: a first circle. Its middle is a better place to touch from.
//! 3. Down in the middle: how deep it is, and how deep the wall may be touched.
//! 4. Down around the hole: the plane of its opening.
//! 5. The wall where a touch tells most of what is asked, at two depths.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::cylinder_fit::{BELOW_RIM, RoundWall, surface_about};
use super::error::ExploreError;
use super::pattern::{Next, Stage, Touched};
use super::search::{Looking, ROUGH, SHALLOW};
use super::search_context::{PatternParams, SearchContext, TouchResult};
use super::slide::{RimStation, Slide, circle};
use crate::features::fit::Observation;
use crate::features::{End, Feature};

/// A wall is looked for this far, m.
const REACH: f64 = 12e-3;
/// First directions.
const FIRST: usize = 3;
/// More directions that are tried where a first one felt nothing.
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
    Looking,
    First,
    Floor,
    Around,
    Wall,
}

#[derive(Clone, Debug)]
pub(super) struct HolePattern {
    phase: HolePhase,
    looking: Looking,
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
            phase: HolePhase::Looking,
            looking: Looking::default(),
            wall: RoundWall::default(),
            floor: None,
            on_floor: None,
            depth,
            first: 0,
            around: 0,
        }
    }

    fn take_first(&mut self, course: &SearchContext, touch: &Touched) {
        if self.wall.measuring.felt.is_empty() && touch.felt == TouchResult::Unclear {
            self.looking.slid_in(self.wall.middle, course);
            self.phase = HolePhase::Looking;
            return;
        }
        self.wall.measuring.take(touch);
        self.first += 1;
        if self.wall.measuring.felt.len() >= FIRST {
            self.wall.recentre(course);
            let (rim, middle) = (self.wall.radius(course) + CHAMFER, self.wall.middle);
            self.looking.forget(|p| (p - middle).xy().norm() <= rim, course);
            self.phase = HolePhase::Floor;
        }
    }

    fn take_around(&mut self, course: &mut SearchContext, touch: &Touched) {
        self.looking.top.extend(touch.observation);
        self.around += 1;
        if self.around >= AROUND {
            course.level(&mut self.looking.top, false, &mut [&mut self.wall.middle]);
            if let Some(centre) = self.on_floor {
                let deepest = course.height - course.in_f(&centre).z - OFF_FLOOR;
                self.depth = self.depth.min(deepest).max(BELOW_RIM * course.params.ball_radius);
            }
            self.phase = HolePhase::Wall;
        }
    }
}

impl Stage for HolePattern {
    fn next(&mut self, course: &SearchContext) -> Next {
        let ball = course.params.ball_radius;
        match self.phase {
            HolePhase::Looking => {
                let wish = self.looking.next(course);
                wish.map_or_else(|| Next::Failed(Looking::not_found(&course.params)), Next::Touch)
            }
            HolePhase::First if self.first >= MOST_FIRST => Next::Failed(ExploreError::NoWall {
                kind: "hole",
                walls: self.wall.measuring.felt.len(),
                asked: self.first,
                reach_mm: REACH * 1e3,
            }),
            HolePhase::First => {
                // a second round goes between the first
                let turn = self.first as f64 + 0.5 * (self.first / FIRST) as f64;
                let angle = turn / FIRST as f64 * TAU;
                let way = Vector3::new(angle.cos(), angle.sin(), 0.0);
                Next::Touch(course.sideways(&self.wall.middle, SHALLOW * ball, &way, REACH))
            }
            HolePhase::Floor => Next::Touch(course.sideways(&self.wall.middle, SHALLOW * ball, &-Vector3::z(), REACH)),
            HolePhase::Around => {
                let angle = self.around as f64 / AROUND as f64 * TAU;
                let away = self.wall.radius(course) + BESIDE * ball;
                let place = self.wall.middle + Vector3::new(angle.cos(), angle.sin(), 0.0) * away;
                Next::Touch(course.down(&place, course.params.clearance + 2.0 * ball + ROUGH))
            }
            HolePhase::Wall if self.wall.is_known(course) => Next::Done { is_as_asked: true },
            HolePhase::Wall => {
                let wish = self.wall.best(course, [BELOW_RIM * ball, self.depth]);
                wish.map_or(Next::Done { is_as_asked: false }, Next::Touch)
            }
        }
    }

    fn take(&mut self, course: &mut SearchContext, touch: &Touched) {
        match self.phase {
            HolePhase::Looking => {
                if let Some(place) = self.looking.take(course, touch) {
                    self.wall.middle = place;
                    self.phase = HolePhase::First;
                }
            }
            HolePhase::First => self.take_first(course, touch),
            HolePhase::Floor => {
                let below = |o: Observation| End { point: o.point - course.out() * o.offset, sigma: o.sigma };
                self.floor = touch.observation.map(below);
                self.on_floor = touch.place.map(|place| course.pose_of * place);
                self.phase = HolePhase::Around;
            }
            HolePhase::Around => self.take_around(course, touch),
            HolePhase::Wall => {
                self.wall.measuring.take(touch);
                self.wall.recentre(course);
            }
        }
    }

    fn feature(&self, course: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        if self.looking.top.len() < 3 || self.wall.measuring.felt.len() < FIRST {
            return Err(match self.phase {
                HolePhase::Looking => Looking::not_found(&course.params),
                _ => ExploreError::NotDone { touches: course.touches },
            });
        }
        let top = surface_about(course, &self.wall.middle, &self.looking.top)?;
        let wall = self.wall.fitted(course, &top)?;
        let touches = numbers([&self.wall.measuring.felt, &self.looking.top]);
        Ok(Some(Feature::round(&wall, &top, self.floor.as_ref(), touches)))
    }

    fn uncertainty(&self, course: &SearchContext) -> Option<f64> {
        self.wall.uncertainty(course)
    }

    fn slides(&self, course: &SearchContext) -> Vec<Slide> {
        let (ball, radius) = (course.params.ball_radius, self.wall.radius(course));
        let middle = Point3::new(self.wall.middle.x, self.wall.middle.y, course.height);
        let rim = RimStation {
            at: &circle(middle, radius, -1.0),
            length: TAU * radius,
            is_closed: true,
            back: BESIDE * ball,
            depths: [BELOW_RIM * ball, self.depth],
            room: radius - ball,
        };
        rim.slides(course)
    }
}

/// Numbers of the touches that something was felt by, in ascending order.
pub(super) fn numbers<const N: usize>(felt: [&Vec<Observation>; N]) -> Vec<u32> {
    let mut numbers: Vec<u32> = felt.into_iter().flatten().map(|o| o.group).collect();
    numbers.sort_unstable();
    numbers
}
