//! A slot from one flag: where the ball falls in, which way it runs, where it ends, then its walls and ends.
//!
//! 1. Where the ball falls in ([`Looking`]).
//! 2. Sideways from there in eight directions: a first slot, whose ends may be open.
//! 3. Down beside it: the plane of its opening. A long way sideways stays at its depth only from here on.
//! 4. Along it to both ends, then down to its floor.
//! 5. Each end on its middle and to both sides of it, then walls and ends where a touch tells most of what is asked.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use super::cylinder_fit::{BELOW_RIM, SQUARE, surface_about};
use super::design::{Asked, Knowledge};
use super::error::ExploreError;
use super::hole::{OFF_FLOOR, numbers};
use super::measuring::{Measuring, Possible};
use super::pattern::{Next, Stage, Touched};
use super::search::{Looking, ROUGH, SHALLOW};
use super::search_context::{PatternParams, Quantity, SearchContext, TouchPlan, TouchResult};
use super::slide::{RimStation, Slide, oblong};
use super::slot_fit::Oblong;
use crate::features::fit::{Ends, FitParams, Freedom, Stadium, Surface, fit};
use crate::features::{End, Feature};

/// A wall is looked for this far, m.
const REACH: f64 = 12e-3;
/// First directions: five numbers are unknown.
const FIRST: usize = 8;
/// Walls that have to be felt in them.
const LEAST_FIRST: usize = 5;
/// An end is searched for so many times at most.
const SEARCHES: usize = 6;
/// Touches of the surface around the opening.
const AROUND: usize = 4;
/// They are this far beyond the wall, over the ball's radius.
const BESIDE: f64 = 1.3;
/// Places along a wall, and around an end, that are candidates.
const ALONG: usize = 9;
const ROUND: usize = 9;
/// So many touches of the walls before they are believed.
const LEAST_WALL: usize = 10;
/// So much farther than expected a wall is looked for, m.
const BEYOND: f64 = 3e-3;
/// An end is believed when it was touched on its middle and on both sides of it: angles from the slot's direction, rad. One touch
/// alone may have met anything; three that lie on one half circle as wide as the slot have met its end.
const PARTS: [[f64; 2]; 3] = [[-PI / 3.0, -PI / 8.0], [-PI / 8.0, PI / 8.0], [PI / 8.0, PI / 3.0]];
/// Walls may be this much nearer than where the ball went freely, m.
const SLACK: f64 = 0.2e-3;
/// A ball that sank by less than this lay on the surface, m …
const FLAT: f64 = 0.1e-3;
/// … or on a rim with its centre beyond it by less than this, over its radius.
const ON_RIM: f64 = 0.5;
/// So far beyond the wall the surface is no rim any more, m.
const CHAMFER: f64 = 0.5e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum SlotPhase {
    Looking,
    First,
    Around,
    /// along the slot, in a direction of its x, from so far beyond where the ball fell in, m
    End(f64, f64),
    Floor,
    Wall,
}

#[derive(Clone, Debug)]
pub(super) struct SlotPattern {
    phase: SlotPhase,
    looking: Looking,
    /// where the ball fell in, in F
    middle: Point3<f64>,
    measuring: Measuring,
    /// as far as it is known, in F and in O
    oblong: Option<Oblong>,
    walls: Option<Stadium>,
    floor: Option<End>,
    depth: f64,
    tried: usize,
    /// places of the ball's centre at the end of searches that felt nothing: where it fell in, and along the slot; m in O
    free: Vec<Point3<f64>>,
    /// where the ball lay when it did not fall in, m in O
    on_top: Vec<Point3<f64>>,
}

impl SlotPattern {
    pub fn new(params: &PatternParams) -> Self {
        Self {
            phase: SlotPhase::Looking,
            looking: Looking::default(),
            middle: Point3::origin(),
            measuring: Measuring::default(),
            oblong: None,
            walls: None,
            floor: None,
            depth: params.depth.max(SHALLOW * params.ball_radius),
            tried: 0,
            free: Vec::new(),
            on_top: Vec::new(),
        }
    }

    /// The walls through what was felt, at the height of the surface, so that their own frame tells depths.
    fn renew(&mut self, course: &SearchContext) {
        let flat: Vec<_> = self.measuring.felt.iter().map(|o| course.in_f(&o.point).xy()).collect();
        let free: Vec<_> = self.free.iter().map(|place| course.in_f(place).xy()).collect();
        let oblong = match &self.oblong {
            Some(known) if self.phase == SlotPhase::Wall => Some(known.fitted(&flat)),
            // the first guess of its length may be far off
            known => Oblong::through(&flat, &free, &self.middle.xy())
                .map(|oblong| known.map_or(oblong, |known| oblong.along_as(&known))),
        };
        self.oblong = oblong;
        self.walls = oblong.map(|oblong| {
            let centre = course.pose_of * Point3::new(oblong.middle.x, oblong.middle.y, course.height);
            let along = course.pose_of.rotation * Vector3::new(oblong.along().x, oblong.along().y, 0.0);
            let width = 2.0 * (oblong.radius + course.params.ball_radius);
            Stadium::new(centre, &course.out(), &along, [width, width + 2.0 * oblong.half], Ends::Round, true)
        });
    }

    fn asked(params: &PatternParams, walls: &Stadium) -> Asked {
        let sigma = params.sigma;
        let asked = Asked::default();
        let place = |asked: Asked| asked.and(&[(Freedom::X, 1.0)], sigma).and(&[(Freedom::Y, 1.0)], sigma);
        match params.quantity {
            Quantity::Position => place(asked),
            Quantity::Axis => asked.and(&[(Freedom::TiltX, 1.0)], sigma).and(&[(Freedom::TiltY, 1.0)], sigma),
            Quantity::Length => asked.and(&[(Freedom::Second, 1.0)], sigma),
            Quantity::Width => asked.and(&[(Freedom::Size, 1.0)], sigma),
            Quantity::All | Quantity::Diameter => {
                // its direction as well as its ends are known
                let asked = place(asked).and(&[(Freedom::Turn, 1.0)], 2.0 * sigma / walls.length);
                asked.and(&[(Freedom::Second, 1.0)], sigma).and(&[(Freedom::Size, 1.0)], sigma)
            }
        }
    }

    fn before(walls: &Stadium) -> Knowledge {
        Knowledge::before::<Stadium>(walls.length, SQUARE)
    }

    /// The part of an end that was not touched yet: the sign of the end along the slot, and its angles. Touches that the fit holds
    /// for none of these walls do not count.
    fn open_part(&self, walls: &Stadium) -> Option<(f64, [f64; 2])> {
        let half = (walls.length - walls.width).max(0.0) / 2.0;
        let fitted = fit(walls, &self.measuring.felt, &params()).ok();
        let is_kept = |at: usize| fitted.as_ref().is_some_and(|fitted| fitted.used[at]);
        let kept = (0..self.measuring.felt.len()).filter(|at| is_kept(*at));
        let kept: Vec<_> =
            kept.map(|at| walls.pose_of.inverse_transform_point(&self.measuring.felt[at].point)).collect();
        let is_touched = |sign: f64, [low, high]: [f64; 2]| {
            let angle = |q: &Point3<f64>| q.y.atan2(sign * q.x - half);
            kept.iter().any(|q| sign * q.x > half && (low..=high).contains(&angle(q)))
        };
        // the middle of an end first: it says where its sides are
        let parts = [1, 0, 2].map(|part| PARTS[part]);
        let all = [1.0, -1.0].into_iter().flat_map(|sign| parts.map(|part| (sign, part)));
        all.into_iter().find(|(sign, part)| !is_touched(*sign, *part))
    }

    /// Whether the ball could have been where it was: where it fell in and where it went freely is inside, where it lay on top is not.
    fn is_consistent(&self, course: &SearchContext, walls: &Stadium) -> bool {
        let ball = course.params.ball_radius;
        let has_room = |centre: &Point3<f64>| walls.distance(centre) > ball - SLACK;
        let sunk = |centre: &Point3<f64>| course.height - course.below(&course.in_f(centre));
        let is_over = |centre: &Point3<f64>| sunk(centre) < FLAT && walls.distance(centre) > ON_RIM * ball;
        self.free.iter().all(has_room) && !self.on_top.iter().any(is_over)
    }

    /// Touches of walls and ends, each from the middle line of the slot; of one part of an end alone where that is open.
    fn possible(&self, course: &SearchContext, walls: &Stadium, part: Option<(f64, [f64; 2])>) -> Vec<Possible> {
        let (half, radius) = ((walls.length - walls.width).max(0.0) / 2.0, walls.width / 2.0);
        let travel = radius - course.params.ball_radius;
        let spread = |at: usize, count: usize| at as f64 / (count - 1) as f64 * 2.0 - 1.0;
        let straight = (0..ALONG).flat_map(|at| [-1.0, 1.0].map(|side| (spread(at, ALONG) * half, side * PI / 2.0)));
        let round = (0..ROUND).flat_map(|at| {
            let angle = spread(at, ROUND) * PI / 3.0;
            [(half, angle), (-half, PI - angle)]
        });
        let is_wanted = |&(x, angle): &(f64, f64)| {
            part.is_none_or(|(sign, [low, high])| {
                let from_end = if sign > 0.0 { angle } else { PI - angle };
                sign * x >= half && from_end > low && from_end < high
            })
        };
        let places: Vec<(f64, f64)> = straight.chain(round).filter(is_wanted).collect();
        let depths = [BELOW_RIM * course.params.ball_radius, self.depth];
        let wish = |(x, angle): (f64, f64), depth: f64| {
            let way = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let in_f = |v: Vector3<f64>| course.pose_of.inverse_transform_vector(&(walls.pose_of.rotation * v));
            let from = course.in_f(&(walls.pose_of * Point3::new(x, 0.0, 0.0)));
            let point = walls.pose_of * (Point3::new(x, 0.0, -depth) + way * radius);
            Possible { point, travel, wish: course.sideways(&from, depth, &in_f(way), travel + BEYOND) }
        };
        places.into_iter().flat_map(|place| depths.map(|depth| wish(place, depth))).collect()
    }

    fn not_done(&self, course: &SearchContext) -> ExploreError {
        match self.phase {
            SlotPhase::Looking => Looking::not_found(&course.params),
            _ => ExploreError::NotDone { touches: course.touches },
        }
    }

    fn take_first(&mut self, course: &SearchContext, touch: &Touched) {
        if self.measuring.felt.is_empty() && touch.felt == TouchResult::Unclear {
            self.looking.slid_in(self.middle, course);
            self.phase = SlotPhase::Looking;
            return;
        }
        self.take_wall(touch);
        self.tried += 1;
        if self.tried < FIRST {
            return;
        }
        self.tried = 0;
        self.renew(course);
        self.on_top = self.looking.top.iter().map(|o| o.point).collect();
        if let Some(walls) = &self.walls {
            let into_material = |p: &Point3<f64>| -walls.distance(&(course.pose_of * p));
            self.looking.forget(|p| into_material(p) < CHAMFER, course);
        }
        self.phase = SlotPhase::Around;
    }

    /// Takes what was felt of walls that are looked for.
    fn take_wall(&mut self, touch: &Touched) {
        self.measuring.take(touch);
        if touch.felt == TouchResult::Nothing {
            self.free.push(end_of(&touch.wish));
        }
    }

    fn take_around(&mut self, course: &mut SearchContext, touch: &Touched) {
        self.looking.top.extend(touch.observation);
        self.tried += 1;
        if self.tried >= AROUND {
            self.tried = 0;
            course.level(&mut self.looking.top, false, &mut [&mut self.middle]);
            self.renew(course);
            self.phase = SlotPhase::End(1.0, 0.0);
        }
    }

    /// Where an end is looked for from, on the middle line of the slot.
    fn end_from(&self, course: &SearchContext, walls: &Stadium, sign: f64, beyond: f64) -> Point3<f64> {
        let at = walls.pose_of.inverse_transform_point(&(course.pose_of * self.middle)).x;
        course.in_f(&(walls.pose_of * Point3::new(at + sign * beyond, 0.0, 0.0)))
    }

    fn take_end(&mut self, course: &SearchContext, touch: &Touched, sign: f64, beyond: f64) {
        self.take_wall(touch);
        self.tried += 1;
        let ball = course.params.ball_radius;
        self.phase = match (touch.felt, sign > 0.0) {
            (TouchResult::Nothing, _) => SlotPhase::End(sign, beyond + REACH),
            // again, from a little before
            (TouchResult::Unclear, _) => SlotPhase::End(sign, beyond - ball),
            (TouchResult::At { .. }, true) => SlotPhase::End(-1.0, 0.0),
            (TouchResult::At { .. }, false) => SlotPhase::Floor,
        };
        if matches!(touch.felt, TouchResult::At { .. }) {
            self.tried = 0;
            self.renew(course);
        }
    }

    fn take_floor(&mut self, course: &SearchContext, touch: &Touched) {
        self.floor = touch.observation.map(|o| End { point: o.point - course.out() * o.offset, sigma: o.sigma });
        if let Some(centre) = touch.place {
            let deepest = course.height - centre.z - OFF_FLOOR;
            self.depth = self.depth.min(deepest).max(BELOW_RIM * course.params.ball_radius);
        }
        self.phase = SlotPhase::Wall;
    }

    /// The touch that is wanted while walls and ends are measured.
    fn next_wall(&mut self, course: &SearchContext, walls: &Stadium) -> Next {
        let asked = Self::asked(&course.params, walls);
        if self.uncertainty(course).is_some_and(|sigma| sigma <= course.params.sigma) {
            return Next::Done { is_as_asked: true };
        }
        let asked = asked.and_the_rest::<Stadium>(course.params.sigma, walls.width / 2.0);
        let known = self.measuring.known(walls, Self::before(walls), course.params.touch_sigma);
        let possible = self.possible(course, walls, self.open_part(walls));
        match self.measuring.best(walls, &known, possible, &asked, course.params.touch_sigma) {
            Some((best, _)) => Next::Touch(self.measuring.aim(&best)),
            None => Next::Done { is_as_asked: false },
        }
    }
}

/// Where a search ends that feels nothing: the ball's centre, m in O.
fn end_of(wish: &TouchPlan) -> Point3<f64> {
    wish.from + wish.direction.into_inner() * wish.search
}

fn params() -> FitParams {
    FitParams { axis_sigma: Some(SQUARE), ..FitParams::default() }
}

impl Stage for SlotPattern {
    fn next(&mut self, course: &SearchContext) -> Next {
        let ball = course.params.ball_radius;
        let shallow = SHALLOW * ball;
        if self.phase == SlotPhase::Looking {
            let wish = self.looking.next(course);
            return wish.map_or_else(|| Next::Failed(Looking::not_found(&course.params)), Next::Touch);
        }
        if self.phase == SlotPhase::First {
            let angle = self.tried as f64 / FIRST as f64 * TAU;
            let way = Vector3::new(angle.cos(), angle.sin(), 0.0);
            return Next::Touch(course.sideways(&self.middle, shallow, &way, REACH));
        }
        let Some(walls) = self.walls.clone().filter(|_| self.measuring.felt.len() >= LEAST_FIRST) else {
            let walls = self.measuring.felt.len();
            return Next::Failed(ExploreError::NoWall { kind: "slot", walls, asked: FIRST, reach_mm: REACH * 1e3 });
        };
        let in_f = |v: Vector3<f64>| course.pose_of.inverse_transform_vector(&(walls.pose_of.rotation * v));
        let centre = course.in_f(&walls.center());
        match self.phase {
            SlotPhase::Looking | SlotPhase::First => unreachable!("these have returned"),
            SlotPhase::Around => {
                // beside both walls, towards both ends
                let [x, y] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]][self.tried];
                let side = Vector3::new(x * walls.length / 3.0, y * (walls.width / 2.0 + BESIDE * ball), 0.0);
                Next::Touch(course.down(&(centre + in_f(side)), course.params.clearance + 2.0 * ball + ROUGH))
            }
            SlotPhase::End(..) if self.tried >= SEARCHES => Next::Failed(ExploreError::NoEnd { searches: self.tried }),
            SlotPhase::End(sign, beyond) => {
                let from = self.end_from(course, &walls, sign, beyond);
                Next::Touch(course.sideways(&from, shallow, &in_f(Vector3::x() * sign), REACH + ball))
            }
            SlotPhase::Floor => Next::Touch(course.sideways(&centre, shallow, &-Vector3::z(), REACH)),
            SlotPhase::Wall => self.next_wall(course, &walls),
        }
    }

    fn take(&mut self, course: &mut SearchContext, touch: &Touched) {
        match self.phase {
            SlotPhase::Looking => {
                if let Some(place) = self.looking.take(course, touch) {
                    self.middle = place;
                    self.free = vec![end_of(&touch.wish)];
                    self.phase = SlotPhase::First;
                }
            }
            SlotPhase::First => self.take_first(course, touch),
            SlotPhase::Around => self.take_around(course, touch),
            SlotPhase::End(sign, beyond) => self.take_end(course, touch, sign, beyond),
            SlotPhase::Floor => self.take_floor(course, touch),
            SlotPhase::Wall => {
                self.measuring.take(touch);
                self.renew(course);
            }
        }
    }

    fn feature(&self, course: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        let walls = self.walls.as_ref().filter(|_| self.looking.top.len() >= 3).ok_or_else(|| self.not_done(course))?;
        let top = surface_about(course, &course.in_f(&walls.center()), &self.looking.top)?;
        let fitted = fit(walls, &self.measuring.felt, &params())?;
        // where an end was not felt it has no length, and no middle
        fitted.length().ok_or_else(|| self.not_done(course))?;
        let touches = numbers([&self.measuring.felt, &self.looking.top]);
        Ok(Some(Feature::slot(&fitted, &top, self.floor.as_ref(), touches)))
    }

    fn uncertainty(&self, course: &SearchContext) -> Option<f64> {
        let walls = self.walls.as_ref().filter(|_| self.phase == SlotPhase::Wall)?;
        let is_told = self.open_part(walls).is_none() && self.is_consistent(course, walls);
        let asked = Self::asked(&course.params, walls);
        let share = || self.measuring.told(walls, &params(), Self::before(walls), &asked, course.params.touch_sigma);
        let has_enough = self.measuring.felt.len() >= LEAST_WALL;
        (has_enough && is_told).then(share).flatten().map(|share| share * course.params.sigma)
    }

    fn slides(&self, course: &SearchContext) -> Vec<Slide> {
        let Some(walls) = &self.walls else { return Vec::new() };
        let ball = course.params.ball_radius;
        let (length, rim) = oblong(walls.width, walls.length);
        let to_f = course.pose_of.inverse() * walls.pose_of;
        let at = |share: f64| {
            let (place, over) = rim(share);
            let place = to_f * place;
            (Point3::new(place.x, place.y, course.height), to_f.rotation * over)
        };
        let rim = RimStation {
            at: &at,
            length,
            is_closed: true,
            back: BESIDE * ball,
            depths: [BELOW_RIM * ball, self.depth],
            room: walls.width / 2.0 - ball,
        };
        rim.slides(course)
    }
}
