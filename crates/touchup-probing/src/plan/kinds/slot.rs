//! A slot from one flag: its opening, its direction, its ends, then its walls and ends.
//!
//! 1. A place for the ball to fall in ([`OpeningSearch`]).
//! 2. Sideways from there in eight directions: a first slot, whose ends may be open.
//! 3. Down beside it: the plane of its opening. Only from here on does a long path sideways stay at
//!    its depth.
//! 4. Along it to both ends, then down to its floor.
//! 5. Each end on its middle and to both sides of it, then walls and ends by the largest gain of a
//!    touch.
//!
//! The contacts decide between round and straight ends. Corners of a slot with straight ends are
//! not touched, and earlier contacts there do not count.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use super::cylinder_fit::{squareness, surface_about};
use super::hole::numbers;
use super::slot_fit::{CORNER, SlotFit};
use crate::plan::design::{Knowledge, TargetUncertainties};
use crate::plan::error::ExploreError;
use crate::plan::measuring::{CandidateTouch, Measuring, SurfaceRequest};
use crate::plan::pattern::{PatternStep, TouchPattern};
use crate::plan::search::{BELOW_RIM, BESIDE, CHAMFER, OpeningSearch, REACH, ROUGH, SHALLOW};
use crate::plan::search_context::{
    AROUND, FeatureQuantity, OpenNumbers, PatternParams, SearchContext, TouchPlan, TouchResult,
    toward,
};
use crate::plan::slide::{RimStation, Slide, stadium_rim};
use touchup_features::features::fit::{
    Ends, Fit, FitParams, Freedom, Observation, Plane, Stadium, SurfaceModel, fit,
};
use touchup_features::features::{End, Feature};
use touchup_method::reconstruct::KnownSurface;

/// Freedom in which walls may lean: across the slot, by both walls. Along it only the ends would
/// show a lean, and an assumed end may be an obstacle.
const LEAN: [Freedom; 1] = [Freedom::TiltY];
/// Number of first directions: five numbers are unknown.
const FIRST: usize = 8;
/// Minimum number of walls touched in these directions.
const LEAST_FIRST: usize = 5;
/// Directions without a clear contact after which the ball has slid in over a rim.
const SLID_IN: usize = 3;
/// Maximum number of searches for an end.
const SEARCHES: usize = 6;
/// Candidate places along a wall, and around an end.
const ALONG: usize = 9;
/// Minimum number of touches for credible walls.
const LEAST_WALL: usize = 10;
/// Search beyond an expected wall, m.
const BEYOND: f64 = 3e-3;
/// Parts of an end that need a touch, its middle and both sides: angles from the slot's direction,
/// rad. One touch alone may be of any object; three on one half circle as wide as the slot are of
/// its end.
const PARTS: [[f64; 2]; 3] = [
    [-PI / 3.0, -PI / 8.0],
    [-PI / 8.0, PI / 8.0],
    [PI / 8.0, PI / 3.0],
];
/// Parts of a straight end: positions across the slot, over the distance of the ball's centre from
/// the middle line.
const STRAIGHT_PARTS: [[f64; 2]; 3] = [[-0.5, -0.15], [-0.15, 0.15], [0.15, 0.5]];
/// Farthest candidate from the middle of a wall, over the start of its corners: their position is
/// not exact.
const OFF_CORNER: f64 = 0.85;
/// Rms of contacts that agree with the walls, over the standard deviation of a touch.
const AGREES: f64 = 2.0;
/// Overlap of walls with free positions of the ball that is tolerable, m.
const SLACK: f64 = 0.2e-3;
/// Depth below which a ball lay on the surface, m.
const FLAT: f64 = 0.1e-3;
/// Distance of the ball's centre beyond a rim, over its radius, below which it lay on the rim.
const ON_RIM: f64 = 0.5;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum SlotPhase {
    #[default]
    Opening,
    First,
    Around,
    /// along the slot: sign of its x, and distance of the start beyond the first place, m
    End(f64, f64),
    Floor,
    Wall,
}

#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct SlotPattern {
    phase: SlotPhase,
    opening: OpeningSearch,
    /// place at which the ball fell in, in F
    middle: Point3<f64>,
    measuring: Measuring,
    /// contacts in the corners of a slot with straight ends
    corners: Vec<Observation>,
    /// estimate of the slot, in F and in O
    slot_fit: Option<SlotFit>,
    walls: Option<Stadium>,
    floor: Option<End>,
    depth: f64,
    tried: usize,
    /// contacts at unknown places among the first touches
    unclear: usize,
    /// centres of the ball after searches without contact: at its fall into the slot, and along it;
    /// m in O
    free: Vec<Point3<f64>>,
    /// centres of a ball that did not fall in, m in O
    on_top: Vec<Point3<f64>>,
}

impl SlotPattern {
    pub(crate) fn new(params: &PatternParams) -> Self {
        Self {
            depth: params.depth.max(SHALLOW * params.ball_radius),
            ..Self::default()
        }
    }

    /// Fits the walls to the contacts, at the height of the surface, so that depths are coordinates
    /// of their frame.
    fn renew(&mut self, context: &SearchContext) {
        let corners = std::mem::take(&mut self.corners);
        self.measuring.observations.extend(corners);
        self.measuring.observations.sort_by_key(|o| o.group);
        let flat: Vec<_> = self
            .measuring
            .observations
            .iter()
            .map(|o| context.in_f(&o.point).xy())
            .collect();
        let free: Vec<_> = self
            .free
            .iter()
            .map(|place| context.in_f(place).xy())
            .collect();
        let agrees = AGREES * context.params.touch_sigma;
        self.slot_fit = match self.slot_fit {
            Some(known) if self.phase == SlotPhase::Wall => {
                Some(known.fitted_to_more(&flat, &free, agrees))
            }
            // the first guess of its length may be far off
            known => SlotFit::through(&flat, &free, &self.middle.xy(), agrees)
                .map(|slot_fit| known.map_or(slot_fit, |known| slot_fit.along_as(&known))),
        };
        let observations = std::mem::take(&mut self.measuring.observations);
        let is_in_corner = |o: &Observation| {
            self.slot_fit
                .is_some_and(|fit| fit.is_in_corner(&context.in_f(&o.point).xy()))
        };
        (self.corners, self.measuring.observations) =
            observations.into_iter().partition(is_in_corner);
        self.walls = self
            .slot_fit
            .map(|slot_fit| Self::walls_of(context, &slot_fit));
    }

    fn walls_of(context: &SearchContext, slot_fit: &SlotFit) -> Stadium {
        let centre =
            context.pose_of * Point3::new(slot_fit.middle.x, slot_fit.middle.y, context.height);
        let along =
            context.pose_of.rotation * Vector3::new(slot_fit.along().x, slot_fit.along().y, 0.0);
        let width = 2.0 * (slot_fit.radius + context.params.ball_radius);
        Stadium::new(
            centre,
            &context.out(),
            &along,
            [width, width + 2.0 * slot_fit.half],
            slot_fit.ends,
            true,
        )
    }

    fn squareness(&self, context: &SearchContext, walls: &Stadium) -> (f64, FitParams) {
        squareness(
            context.square(context.lean),
            walls,
            &self.measuring.observations,
            &LEAN,
        )
    }

    /// The surface around the slot, and its walls.
    fn fitted(&self, context: &SearchContext) -> Result<(Fit<Plane>, Fit<Stadium>), ExploreError> {
        let not_done = || OpeningSearch::not_done(context, self.phase == SlotPhase::Opening);
        let walls = self
            .walls
            .as_ref()
            .filter(|_| self.opening.top.len() >= 3)
            .ok_or_else(not_done)?;
        let top = surface_about(context, &context.in_f(&walls.center()), &self.opening.top)?;
        let (_, params) = self.squareness(context, walls);
        let fitted = self.measuring.fitted(walls, &params)?;
        // an untouched end leaves length and middle open
        fitted.std(Freedom::Second).ok_or_else(not_done)?;
        Ok((top, fitted))
    }

    fn wanted(&self, context: &SearchContext, walls: &Stadium) -> SurfaceRequest {
        let params = &context.params;
        let (sigma, (lean, fit)) = (params.sigma, self.squareness(context, walls));
        let asked = TargetUncertainties::default();
        let asked = match params.quantity {
            _ if context
                .open
                .is_some_and(|open| open != OpenNumbers::default()) =>
            {
                let OpenNumbers {
                    place,
                    size,
                    length,
                } = context.open.unwrap_or_default();
                let asked = place.map_or(asked.clone(), |sigma| {
                    asked.each(&[Freedom::X, Freedom::Y], sigma)
                });
                let asked = size.map_or(asked.clone(), |sigma| asked.each(&[Freedom::Size], sigma));
                length.map_or(asked.clone(), |sigma| asked.each(&[Freedom::Second], sigma))
            }
            FeatureQuantity::Position => asked.each(&[Freedom::X, Freedom::Y], sigma),
            FeatureQuantity::Axis => asked.each(&[Freedom::TiltX, Freedom::TiltY], sigma),
            FeatureQuantity::Length => asked.each(&[Freedom::Second], sigma),
            FeatureQuantity::Width => asked.each(&[Freedom::Size], sigma),
            FeatureQuantity::All | FeatureQuantity::Diameter => {
                // direction as certain as the ends
                let asked = asked.each(&[Freedom::X, Freedom::Y], sigma);
                asked
                    .each(&[Freedom::Turn], 2.0 * sigma / walls.length)
                    .each(&[Freedom::Second, Freedom::Size], sigma)
            }
        };
        SurfaceRequest {
            before: Knowledge::before::<Stadium>(walls.length, lean),
            asked: asked.and_the_rest::<Stadium>(sigma, walls.width / 2.0),
            fit,
            least: LEAST_WALL,
            params: *params,
        }
    }

    /// An untouched part of an end: the sign of the end along the slot, and its angles. Touches
    /// that the fit rejects do not count.
    fn open_part(&self, context: &SearchContext, walls: &Stadium) -> Option<(f64, [f64; 2])> {
        let (half, ball) = (
            (walls.length - walls.width).max(0.0) / 2.0,
            context.params.ball_radius,
        );
        let (_, params) = self.squareness(context, walls);
        let fitted = fit(walls, &self.measuring.observations, &params).ok();
        let used = fitted.iter().flat_map(|fitted| &fitted.used);
        let kept = self
            .measuring
            .observations
            .iter()
            .zip(used)
            .filter(|(_, used)| **used);
        let kept: Vec<_> = kept
            .map(|(o, _)| walls.pose_of.inverse_transform_point(&o.point))
            .collect();
        let is_touched = |sign: f64, [low, high]: [f64; 2]| {
            kept.iter().any(|q| match walls.ends {
                Ends::Round => {
                    sign * q.x > half && (low..=high).contains(&q.y.atan2(sign * q.x - half))
                }
                Ends::Straight => {
                    let is_of_end = walls.length / 2.0 - sign * q.x < walls.width / 2.0 - q.y.abs();
                    is_of_end && (low..=high).contains(&(q.y / (walls.width / 2.0 - ball)))
                }
            })
        };
        // the middle of an end first: it determines its sides
        let parts = if walls.ends == Ends::Round {
            PARTS
        } else {
            STRAIGHT_PARTS
        };
        let parts = [1, 0, 2].map(|part| parts[part]);
        let all = [1.0, -1.0]
            .into_iter()
            .flat_map(|sign| parts.map(|part| (sign, part)));
        all.into_iter()
            .find(|(sign, part)| !is_touched(*sign, *part))
    }

    /// Whether the walls agree with the free positions of the ball, which lie inside, and with
    /// positions on top, which do not.
    fn is_consistent(&self, context: &SearchContext, walls: &Stadium) -> bool {
        let ball = context.params.ball_radius;
        let has_room = |centre: &Point3<f64>| walls.distance(centre) > ball - SLACK;
        let sunk = |centre: &Point3<f64>| context.height - context.below(&context.in_f(centre));
        let is_over =
            |centre: &Point3<f64>| sunk(centre) < FLAT && walls.distance(centre) > ON_RIM * ball;
        self.free.iter().all(has_room) && !self.on_top.iter().any(is_over)
    }

    /// Touches of walls and ends, each from the middle line of the slot; only of one part of an end
    /// if that is open.
    fn possible(
        &self,
        context: &SearchContext,
        walls: &Stadium,
        part: Option<(f64, [f64; 2])>,
    ) -> Vec<CandidateTouch> {
        if walls.ends == Ends::Straight {
            return self.possible_straight(context, walls, part);
        }
        let (half, radius) = (
            (walls.length - walls.width).max(0.0) / 2.0,
            walls.width / 2.0,
        );
        let travel = radius - context.params.ball_radius;
        let is_wanted = |&(x, angle): &(f64, f64)| {
            part.is_none_or(|(sign, [low, high])| {
                let from_end = if sign > 0.0 { angle } else { PI - angle };
                sign * x >= half && from_end > low && from_end < high
            })
        };
        let places = around_stadium(half, ALONG).filter(is_wanted);
        let places = places.map(|(x, angle)| {
            (
                Point3::new(x, 0.0, 0.0),
                Vector3::new(angle.cos(), angle.sin(), 0.0),
            )
        });
        self.sideways_from(context, walls, places, radius, travel)
    }

    /// The same for straight ends: across from the middle line, and along it from half a width
    /// before the end, away from the corners.
    fn possible_straight(
        &self,
        context: &SearchContext,
        walls: &Stadium,
        part: Option<(f64, [f64; 2])>,
    ) -> Vec<CandidateTouch> {
        let (ball, radius, half) = (
            context.params.ball_radius,
            walls.width / 2.0,
            (walls.length - walls.width) / 2.0,
        );
        let room = radius - ball;
        let flat = OFF_CORNER * (1.0 - CORNER);
        let along = half + room * flat;
        let sides = (0..ALONG).flat_map(|at| {
            [-1.0, 1.0].map(|sign| {
                (
                    Point3::new(spread(at, ALONG) * along, 0.0, 0.0),
                    Vector3::y() * sign,
                )
            })
        });
        let ends =
            (0..ALONG).flat_map(|at| [-1.0, 1.0].map(|sign| (spread(at, ALONG) * flat, sign)));
        let in_part = |&(y, sign): &(f64, f64)| {
            part.is_none_or(|(wanted, [low, high])| sign == wanted && (low..=high).contains(&y))
        };
        let ends = ends
            .filter(in_part)
            .map(|(y, sign)| (Point3::new(sign * half, y * room, 0.0), Vector3::x() * sign));
        self.sideways_from(
            context,
            walls,
            sides.filter(|_| part.is_none()).chain(ends),
            radius,
            room,
        )
    }

    /// Touches from places in the middle plane of the walls along directions in it, at both depths.
    fn sideways_from(
        &self,
        context: &SearchContext,
        walls: &Stadium,
        places: impl Iterator<Item = (Point3<f64>, Vector3<f64>)>,
        radius: f64,
        travel: f64,
    ) -> Vec<CandidateTouch> {
        let depths = [BELOW_RIM * context.params.ball_radius, self.depth];
        let in_f = |v: Vector3<f64>| {
            context
                .pose_of
                .inverse_transform_vector(&(walls.pose_of.rotation * v))
        };
        let planned = |(place, direction): (Point3<f64>, Vector3<f64>), depth: f64| {
            let from = context.in_f(&(walls.pose_of * place));
            let point = walls.pose_of * (place - Vector3::z() * depth + direction * radius);
            CandidateTouch {
                point,
                travel,
                planned: context.sideways(&from, depth, &in_f(direction), travel + BEYOND),
            }
        };
        context.on_part(places.flat_map(|place| depths.map(|depth| planned(place, depth))))
    }

    fn take_first(&mut self, context: &SearchContext, touch: &PatternStep) {
        self.take_wall(touch);
        self.tried += 1;
        if touch.result == TouchResult::Unclear {
            self.unclear += 1;
        }
        // one unclear touch may be of any object
        if self.measuring.observations.is_empty()
            && self.corners.is_empty()
            && self.unclear >= SLID_IN
        {
            self.opening.slid_in(self.middle, context);
            (self.phase, self.tried, self.unclear) = (SlotPhase::Opening, 0, 0);
            return;
        }
        if self.tried < FIRST {
            return;
        }
        self.tried = 0;
        self.renew(context);
        self.on_top = self.opening.top.iter().map(|o| o.point).collect();
        if let Some(walls) = &self.walls {
            let into_material = |p: &Point3<f64>| -walls.distance(&(context.pose_of * p));
            self.opening.forget(|p| into_material(p) < CHAMFER, context);
        }
        self.phase = SlotPhase::Around;
    }

    /// Takes a touch of a search for walls.
    fn take_wall(&mut self, touch: &PatternStep) {
        self.measuring.take(touch);
        if touch.result == TouchResult::Nothing {
            self.free.push(touch.planned.end());
        }
    }

    /// The next place on the part around a slot: beside both walls, towards both ends.
    fn place_around(&self, context: &mut SearchContext, walls: &Stadium) -> Point3<f64> {
        let ball = context.params.ball_radius;
        let in_f = |v: Vector3<f64>| {
            context
                .pose_of
                .inverse_transform_vector(&(walls.pose_of.rotation * v))
        };
        let centre = context.in_f(&walls.center());
        let away = walls.width / 2.0 + BESIDE * ball;
        let beside =
            |x: f64, y: f64| centre + in_f(Vector3::new(x * walls.length / 3.0, y * away, 0.0));
        let wanted =
            [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]].map(|[x, y]| beside(x, y));
        // elsewhere beside it, and beyond its ends
        let beyond = [-1.0, 1.0]
            .map(|x| centre + in_f(Vector3::x() * x * (walls.length / 2.0 + BESIDE * ball)));
        let others =
            (0..ALONG).flat_map(|at| [-1.0, 1.0].map(|y| beside(1.5 * spread(at, ALONG), y)));
        let others: Vec<_> = others.chain(beyond).collect();
        context.over_part(self.tried, &wanted, &others)
    }

    fn take_around(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.opening.top.extend(touch.observation);
        self.tried += 1;
        if self.tried >= AROUND {
            self.tried = 0;
            context.level(&mut self.opening.top, false, &mut [&mut self.middle]);
            self.renew(context);
            self.phase = SlotPhase::End(1.0, 0.0);
        }
    }

    fn take_end(&mut self, context: &SearchContext, touch: &PatternStep, sign: f64, beyond: f64) {
        self.take_wall(touch);
        self.tried += 1;
        let ball = context.params.ball_radius;
        self.phase = match (touch.result, sign > 0.0) {
            (TouchResult::Nothing, _) => SlotPhase::End(sign, beyond + REACH),
            // again, from a little before
            (TouchResult::Unclear, _) => SlotPhase::End(sign, beyond - ball),
            (TouchResult::At { .. }, true) => SlotPhase::End(-1.0, 0.0),
            (TouchResult::At { .. }, false) => SlotPhase::Floor,
        };
        if matches!(touch.result, TouchResult::At { .. }) {
            self.tried = 0;
            self.renew(context);
        }
    }

    fn take_floor(&mut self, context: &SearchContext, touch: &PatternStep) {
        self.floor = touch.observation.map(|contact| context.end(&contact));
        if let Some(centre) = touch.place {
            self.depth = context.above_floor(self.depth, &centre);
        }
        self.phase = SlotPhase::Wall;
    }
}

/// Even steps from −1 to 1.
fn spread(at: usize, count: usize) -> f64 {
    at as f64 / (count - 1) as f64 * 2.0 - 1.0
}

/// Places around the walls of a slot: along each side, then about the middle of each end; x of the
/// start on the middle line, and the angle of the touch.
pub(in crate::plan) fn around_stadium(half: f64, count: usize) -> impl Iterator<Item = (f64, f64)> {
    let spread = move |at: usize| spread(at, count);
    let sides =
        (0..count).flat_map(move |at| [-PI, PI].map(|turn| (spread(at) * half, turn / 2.0)));
    let ends = (0..count).flat_map(move |at| {
        let angle = spread(at) * PI / 3.0;
        [(half, angle), (-half, PI - angle)]
    });
    sides.chain(ends)
}

impl TouchPattern for SlotPattern {
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError> {
        let ball = context.params.ball_radius;
        let shallow = SHALLOW * ball;
        match self.phase {
            SlotPhase::Opening => return self.opening.next(context).map(Some),
            SlotPhase::First => {
                let direction = toward(self.tried as f64 / FIRST as f64);
                return Ok(Some(context.sideways(
                    &self.middle,
                    shallow,
                    &direction,
                    REACH,
                )));
            }
            _ => {}
        }
        let touched = self.measuring.observations.len() + self.corners.len();
        let walls = self.walls.filter(|_| touched >= LEAST_FIRST);
        let no_wall = ExploreError::NoWall {
            kind: "slot",
            walls: touched,
            asked: FIRST,
            reach_mm: REACH * 1e3,
        };
        let walls = walls.ok_or(no_wall)?;
        let in_f = |v: Vector3<f64>| {
            context
                .pose_of
                .inverse_transform_vector(&(walls.pose_of.rotation * v))
        };
        let centre = context.in_f(&walls.center());
        Ok(Some(match self.phase {
            SlotPhase::Around => {
                let place = self.place_around(context, &walls);
                context.down(&place, context.params.clearance + 2.0 * ball + ROUGH)
            }
            SlotPhase::End(..) if self.tried >= SEARCHES => {
                return Err(ExploreError::NoEnd {
                    searches: self.tried,
                });
            }
            SlotPhase::End(sign, beyond) => {
                // from the middle line of the slot
                let at = walls
                    .pose_of
                    .inverse_transform_point(&(context.pose_of * self.middle))
                    .x;
                let from =
                    context.in_f(&(walls.pose_of * Point3::new(at + sign * beyond, 0.0, 0.0)));
                context.sideways(&from, shallow, &in_f(Vector3::x() * sign), REACH + ball)
            }
            SlotPhase::Floor => context.sideways(&centre, shallow, &-Vector3::z(), REACH),
            // the other phases have returned
            SlotPhase::Wall | SlotPhase::Opening | SlotPhase::First => {
                let possible = self.possible(context, &walls, self.open_part(context, &walls));
                let wanted = self.wanted(context, &walls);
                return Ok(self.measuring.next(&walls, &wanted, possible));
            }
        }))
    }

    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        match self.phase {
            SlotPhase::Opening => {
                if let Some(place) = self.opening.take(context, touch) {
                    self.middle = place;
                    self.free = vec![touch.planned.end()];
                    self.phase = SlotPhase::First;
                }
            }
            SlotPhase::First => self.take_first(context, touch),
            SlotPhase::Around => self.take_around(context, touch),
            SlotPhase::End(sign, beyond) => self.take_end(context, touch, sign, beyond),
            SlotPhase::Floor => self.take_floor(context, touch),
            SlotPhase::Wall => {
                self.measuring.take(touch);
                self.renew(context);
            }
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        let (top, fitted) = self.fitted(context)?;
        let touches = numbers([&self.measuring.observations, &self.opening.top]);
        Ok(Some(Feature::slot(
            &fitted,
            &top,
            self.floor.as_ref(),
            touches,
        )))
    }

    fn known_surfaces(&self, context: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError> {
        let (top, walls) = self.fitted(context)?;
        Ok(context.surfaces_of_slot(
            (&walls, &self.measuring.observations),
            (&top, &self.opening.top),
            self.floor.as_ref(),
        ))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        let walls = self
            .walls
            .as_ref()
            .filter(|_| self.phase == SlotPhase::Wall)?;
        let is_determined =
            self.open_part(context, walls).is_none() && self.is_consistent(context, walls);
        let known = || {
            self.measuring
                .uncertainty(walls, &self.wanted(context, walls))
        };
        is_determined.then(known).flatten()
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let Some(walls) = self
            .walls
            .as_ref()
            .filter(|walls| walls.ends == Ends::Round)
        else {
            return Vec::new();
        };
        let ball = context.params.ball_radius;
        let (length, rim) = stadium_rim(walls.width, walls.length);
        let to_f = context.pose_of.inverse() * walls.pose_of;
        let at = |share: f64| {
            let (place, over) = rim(share);
            let place = to_f * place;
            (
                Point3::new(place.x, place.y, context.height),
                to_f.rotation * over,
            )
        };
        let (depths, room) = ([BELOW_RIM * ball, self.depth], walls.width / 2.0 - ball);
        RimStation {
            at: &at,
            length,
            is_closed: true,
            back: BESIDE * ball,
            depths,
            room,
        }
        .slides(context)
    }
}
