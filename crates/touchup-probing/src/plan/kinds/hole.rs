//! A hole from one flag: found by a missing surface, measured by its wall.
//!
//! 1. A place for the ball to fall in ([`OpeningSearch`]).
//! 2. Sideways from there in three directions: a first circle. Its middle is a better start of
//!    touches.
//! 3. Down in the middle: the depth of the hole, and the deepest touch of the wall.
//! 4. Down around the hole: the plane of its opening.
//! 5. The wall by the largest gain of a touch, at two depths.

use nalgebra::{Point3, Vector3};

use super::cylinder_fit::{FIRST, MOST_FIRST, RoundWall, surface_about};
use crate::plan::error::ExploreError;
use crate::plan::pattern::{PatternStep, TouchPattern};
use crate::plan::search::{BELOW_RIM, BESIDE, CHAMFER, OpeningSearch, REACH, ROUGH, SHALLOW};
use crate::plan::search_context::{AROUND, PatternParams, SearchContext, TouchPlan, TouchResult};
use crate::plan::slide::Slide;
use touchup_features::features::fit::{Cylinder, Fit, Observation, Plane};
use touchup_features::features::{End, Feature};
use touchup_method::reconstruct::KnownSurface;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum HolePhase {
    #[default]
    Opening,
    First,
    Floor,
    Around,
    Wall,
}

#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct HolePattern {
    phase: HolePhase,
    opening: OpeningSearch,
    wall: RoundWall,
    floor: Option<End>,
    /// the ball's centre on the floor, m in O
    on_floor: Option<Point3<f64>>,
    /// depth of the deepest touch of the wall, m
    depth: f64,
    first: usize,
    around: usize,
}

impl HolePattern {
    pub(crate) fn new(params: &PatternParams) -> Self {
        Self {
            depth: params.depth.max(SHALLOW * params.ball_radius),
            ..Self::default()
        }
    }

    /// The surface around the hole, and its wall.
    fn fitted(&self, context: &SearchContext) -> Result<(Fit<Plane>, Fit<Cylinder>), ExploreError> {
        if self.opening.top.len() < 3 || self.wall.measuring.observations.len() < FIRST {
            return Err(OpeningSearch::not_done(
                context,
                self.phase == HolePhase::Opening,
            ));
        }
        let top = surface_about(context, &self.wall.middle, &self.opening.top)?;
        let wall = self.wall.fitted(context, &top)?;
        Ok((top, wall))
    }

    fn take_first(&mut self, context: &SearchContext, touch: &PatternStep) {
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
            self.opening
                .forget(|p| (p - middle).xy().norm() <= rim, context);
            self.phase = HolePhase::Floor;
        }
    }

    fn take_around(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.opening.top.extend(touch.observation);
        self.around += 1;
        if self.around >= AROUND {
            context.level(&mut self.opening.top, false, &mut [&mut self.wall.middle]);
            if let Some(centre) = self.on_floor {
                self.depth = context.above_floor(self.depth, &context.in_f(&centre));
            }
            self.phase = HolePhase::Wall;
        }
    }
}

impl TouchPattern for HolePattern {
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError> {
        let (ball, middle) = (context.params.ball_radius, self.wall.middle);
        Ok(Some(match self.phase {
            HolePhase::Opening => self.opening.next(context)?,
            HolePhase::First if self.first >= MOST_FIRST => {
                return Err(self.wall.missing(self.first, REACH));
            }
            HolePhase::First => context.sideways(
                &middle,
                SHALLOW * ball,
                &RoundWall::first_direction(self.first),
                REACH,
            ),
            HolePhase::Floor => context.sideways(&middle, SHALLOW * ball, &-Vector3::z(), REACH),
            HolePhase::Around => {
                let away = self.wall.radius(context) + BESIDE * ball;
                let place = context.around(self.around, 0.0, &middle, away);
                context.down(&place, context.params.clearance + 2.0 * ball + ROUGH)
            }
            HolePhase::Wall => return Ok(self.wall.next(context, [BELOW_RIM * ball, self.depth])),
        }))
    }

    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        match self.phase {
            HolePhase::Opening => {
                if let Some(place) = self.opening.take(context, touch) {
                    self.wall.middle = place;
                    self.phase = HolePhase::First;
                }
            }
            HolePhase::First => self.take_first(context, touch),
            HolePhase::Floor => {
                self.floor = touch.observation.map(|contact| context.end(&contact));
                self.on_floor = touch.place.map(|place| context.pose_of * place);
                self.phase = HolePhase::Around;
            }
            HolePhase::Around => self.take_around(context, touch),
            HolePhase::Wall => self.wall.take(context, touch),
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        let (top, wall) = self.fitted(context)?;
        let touches = numbers([&self.wall.measuring.observations, &self.opening.top]);
        Ok(Some(Feature::round(
            &wall,
            &top,
            self.floor.as_ref(),
            touches,
        )))
    }

    fn known_surfaces(&self, context: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError> {
        let (top, wall) = self.fitted(context)?;
        Ok(context.surfaces_of_hole(
            (&wall, &self.wall.measuring.observations),
            (&top, &self.opening.top),
            self.floor.as_ref(),
        ))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        self.wall.uncertainty(context)
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let ball = context.params.ball_radius;
        let room = self.wall.radius(context) - ball;
        self.wall
            .slides(context, BESIDE * ball, [BELOW_RIM * ball, self.depth], room)
    }
}

/// Numbers of the touches with contact, in ascending order.
pub(in crate::plan) fn numbers<const N: usize>(observations: [&Vec<Observation>; N]) -> Vec<u32> {
    let mut numbers: Vec<u32> = observations
        .into_iter()
        .flatten()
        .map(|o| o.group)
        .collect();
    numbers.sort_unstable();
    numbers
}
