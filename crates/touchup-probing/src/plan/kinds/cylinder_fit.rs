//! Wall of a hole or boss: its requested numbers, and its candidate touches.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::{Isometry3, Point3, Vector3};

use crate::plan::design::{Knowledge, TargetUncertainties};
use crate::plan::error::ExploreError;
use crate::plan::measuring::{CandidateTouch, Measuring, SurfaceRequest};
use crate::plan::pattern::PatternStep;
use crate::plan::search_context::{FeatureQuantity, OpenNumbers, SearchContext, TouchPlan, toward};
use crate::plan::slide::{RimStation, Slide};
use touchup_features::features::fit::{
    Cylinder, Fit, FitError, FitParams, Freedom, Observation, Plane, SurfaceModel, fit,
};
use touchup_geometry::numeric::{NormalEquations, mean};

/// Candidate directions.
const DIRECTIONS: usize = 24;
/// Freedoms in which a round wall may lean.
const LEAN: [Freedom; 2] = [Freedom::TiltX, Freedom::TiltY];
/// Standard deviations of a lean that is significant.
const LEANS: f64 = 4.0;
/// Touches beyond the unknowns for a significant lean: among fewer, a single contact with another
/// object makes a lean.
const LEAST_DEGREES: usize = 6;
/// Maximum lean of a wall, rad.
const MOST_LEAN: f64 = 0.3;
/// Minimum number of touches for a credible wall.
const LEAST_WALL: usize = 8;
/// Number of first directions.
pub(in crate::plan) const FIRST: usize = 3;
/// Maximum number of first directions, after misses.
pub(in crate::plan) const MOST_FIRST: usize = 6;

/// A round wall during its touches.
#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct RoundWall {
    pub measuring: Measuring,
    /// middle in F
    pub middle: Point3<f64>,
    pub is_boss: bool,
}

impl RoundWall {
    /// One of the first directions.
    pub(crate) fn first_direction(at: usize) -> Vector3<f64> {
        // a second round goes between the first
        toward((at as f64 + 0.5 * (at / FIRST) as f64) / FIRST as f64)
    }

    /// Error for a missing wall after these directions.
    pub(crate) fn missing(&self, asked: usize, reach: f64) -> ExploreError {
        let kind = if self.is_boss { "boss" } else { "hole" };
        ExploreError::NoWall {
            kind,
            walls: self.measuring.observations.len(),
            asked,
            reach_mm: reach * 1e3,
        }
    }

    /// Takes a touch of the wall.
    pub(crate) fn take(&mut self, context: &SearchContext, touch: &PatternStep) {
        self.measuring.take(touch);
        self.recentre(context);
    }

    /// Moves the middle to the circle through the contacts.
    pub(crate) fn recentre(&mut self, context: &SearchContext) {
        if let Some((centre, _)) = self.circle(context) {
            self.middle = centre;
        }
    }

    fn circle(&self, context: &SearchContext) -> Option<(Point3<f64>, f64)> {
        let points: Vec<_> = self
            .measuring
            .observations
            .iter()
            .map(|o| context.in_f(&o.point))
            .collect();
        circle_through(&points)
    }

    /// Estimated radius, m.
    pub(crate) fn radius(&self, context: &SearchContext) -> f64 {
        let ball = context.params.ball_radius;
        let centres = self.circle(context).map_or(0.0, |(_, radius)| radius);
        if self.is_boss {
            centres - ball
        } else {
            centres + ball
        }
    }

    fn guess(&self, context: &SearchContext) -> Cylinder {
        let middle = context.pose_of * Point3::new(self.middle.x, self.middle.y, context.height);
        let pose_of = Isometry3::from_parts(middle.coords.into(), context.pose_of.rotation);
        Cylinder {
            pose_of,
            radius: self.radius(context),
            concave: !self.is_boss,
        }
    }

    fn wanted(&self, context: &SearchContext, guess: &Cylinder) -> SurfaceRequest {
        let sigma = context.params.sigma;
        let asked = TargetUncertainties::default();
        let (lean, fit) = squareness(
            context.square(context.lean),
            guess,
            &self.measuring.observations,
            &LEAN,
        );
        let asked = match context.params.quantity {
            _ if context
                .open
                .is_some_and(|open| open != OpenNumbers::default()) =>
            {
                let OpenNumbers { place, size, .. } = context.open.unwrap_or_default();
                let asked = place.map_or(asked.clone(), |sigma| {
                    asked.each(&[Freedom::X, Freedom::Y], sigma)
                });
                size.map_or(asked.clone(), |sigma| {
                    asked.and(&[(Freedom::Size, 2.0)], sigma)
                })
            }
            FeatureQuantity::Position => asked.each(&[Freedom::X, Freedom::Y], sigma),
            FeatureQuantity::Axis => asked.each(&[Freedom::TiltX, Freedom::TiltY], sigma),
            FeatureQuantity::Diameter => asked.and(&[(Freedom::Size, 2.0)], sigma),
            FeatureQuantity::All | FeatureQuantity::Length | FeatureQuantity::Width => asked
                .each(&[Freedom::X, Freedom::Y], sigma)
                .and(&[(Freedom::Size, 2.0)], sigma),
        };
        SurfaceRequest {
            before: Knowledge::before::<Cylinder>(
                guess.radius.max(context.params.ball_radius),
                lean,
            ),
            asked: asked.and_the_rest::<Cylinder>(sigma, guess.radius),
            fit,
            least: LEAST_WALL,
            params: context.params,
        }
    }

    /// Standard uncertainty of the requested number, m or rad.
    pub(crate) fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        let guess = self.guess(context);
        self.measuring
            .uncertainty(&guess, &self.wanted(context, &guess))
    }

    /// Touch of the wall with the largest gain.
    ///
    /// - `depths`: below the surface, m.
    pub(crate) fn next(&mut self, context: &SearchContext, depths: [f64; 2]) -> Option<TouchPlan> {
        let surface = self.guess(context);
        let ball = context.params.ball_radius;
        // in a hole from the middle, at a boss from beside it
        let from = if self.is_boss {
            surface.radius + ball + context.params.clearance
        } else {
            0.0
        };
        let travel = if self.is_boss {
            context.params.clearance
        } else {
            surface.radius - ball
        };
        let possible = (0..DIRECTIONS)
            .flat_map(|at| depths.map(|depth| (at as f64 / DIRECTIONS as f64, depth)));
        let (middle, is_boss) = (self.middle, self.is_boss);
        let possible = possible.map(|(turned, depth)| {
            let direction = toward(turned);
            let into = if is_boss { -direction } else { direction };
            let planned =
                context.sideways(&(middle + direction * from), depth, &into, travel + REACH);
            let point = surface.pose_of
                * (Point3::origin() + direction * surface.radius - Vector3::z() * depth);
            CandidateTouch {
                point,
                travel,
                planned,
            }
        });
        let wanted = self.wanted(context, &surface);
        self.measuring
            .next(&surface, &wanted, context.on_part(possible))
    }

    /// Cylinder through the contacts of the wall, perpendicular to a surface.
    pub(crate) fn fitted(
        &self,
        context: &SearchContext,
        top: &Fit<Plane>,
    ) -> Result<Fit<Cylinder>, ExploreError> {
        let middle = self.guess(context).pose_of.translation.vector.into();
        let guess = Cylinder::new(
            middle,
            &top.surface.normal(),
            self.radius(context),
            !self.is_boss,
        );
        let lean = top.axis_std().map_or(context.lean, |both| both / SQRT_2);
        let (_, params) = squareness(
            context.square(lean),
            &guess,
            &self.measuring.observations,
            &LEAN,
        );
        self.measuring.fitted(&guess, &params)
    }

    /// Paths along the wall and across its rim.
    ///
    /// - `back`: extent of the known surface above the rim, m; `depths`: below it, m; `room`:
    ///   beside the ball at the wall, m.
    pub(crate) fn slides(
        &self,
        context: &SearchContext,
        back: f64,
        depths: [f64; 2],
        room: f64,
    ) -> Vec<Slide> {
        let radius = self.radius(context);
        let middle = Point3::new(self.middle.x, self.middle.y, context.height);
        // the open is around a boss, and inside a hole
        let side = if self.is_boss { 1.0 } else { -1.0 };
        let at = &|share: f64| (middle + toward(share) * radius, toward(share) * side);
        RimStation {
            at,
            length: TAU * radius,
            is_closed: true,
            back,
            depths,
            room,
        }
        .slides(context)
    }
}

impl SearchContext {
    /// Lean of walls against the normal of a surface, standard deviation in each of two directions,
    /// rad.
    ///
    /// - `lean`: of that normal as measured, likewise.
    pub(crate) fn square(&self, lean: f64) -> f64 {
        self.params.square.hypot(lean)
    }
}

/// Prior of the lean of walls against the axis of a guess, rad in each of two directions, and
/// settings of their fit: within that prior, or free if their touches show a larger lean.
///
/// - `known`: prior for walls perpendicular to their surface, rad; `leans`: freedoms that may show
///   a lean.
pub(in crate::plan) fn squareness<M: SurfaceModel>(
    known: f64,
    guess: &M,
    touches: &[Observation],
    leans: &[Freedom],
) -> (f64, FitParams) {
    let freely = fit(guess, touches, &FitParams::default())
        .ok()
        .filter(|free| free.degrees >= LEAST_DEGREES);
    let is_leaning = freely.is_some_and(|free| {
        // its axis against the guess's, in the directions of its own x and y
        let before = guess.pose_of().rotation * Vector3::z();
        let off = free.surface.pose_of().inverse_transform_vector(&before);
        leans.iter().any(|lean| {
            let off = if *lean == Freedom::TiltX {
                off.x
            } else {
                off.y
            };
            free.std(*lean)
                .is_some_and(|std| off.abs() > LEANS * std.hypot(known))
        })
    });
    match is_leaning {
        true => (MOST_LEAN, FitParams::default()),
        false => (
            known,
            FitParams {
                axis_sigma: Some(known),
                ..FitParams::default()
            },
        ),
    }
}

/// Search beyond an expected wall, m.
const REACH: f64 = 3e-3;

/// Plane through the contacts of the surface about a place of F.
pub(in crate::plan) fn surface_about(
    context: &SearchContext,
    middle: &Point3<f64>,
    observations: &[Observation],
) -> Result<Fit<Plane>, FitError> {
    let middle = context.pose_of * Point3::new(middle.x, middle.y, context.height);
    fit(
        &Plane::new(middle, &context.out()),
        observations,
        &FitParams::default(),
    )
}

/// Middle and radius of the circle through points of a plane, by least squares of x² + y² = 2ax +
/// 2by + c \[Kåsa 1976\].
fn circle_through(points: &[Point3<f64>]) -> Option<(Point3<f64>, f64)> {
    let mean = mean(points.iter().map(|p| p.coords));
    let row = |p: &Point3<f64>| {
        let (x, y) = (p.x - mean.x, p.y - mean.y);
        (Vector3::new(2.0 * x, 2.0 * y, 1.0), x * x + y * y)
    };
    let solved = NormalEquations::of(points.iter().map(row)).solution()?;
    let radius = (solved.z + solved.x * solved.x + solved.y * solved.y).sqrt();
    let centre = Point3::new(mean.x + solved.x, mean.y + solved.y, 0.0);
    (radius.is_finite() && points.len() >= 3).then_some((centre, radius))
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    const BALL: f64 = 1.5e-3;

    /// Centres of a ball on a hole of 8 mm, whose axis leans towards x by an angle, at two depths;
    /// by hand.
    fn touches(lean: f64) -> Vec<Observation> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean);
        let place = |group: u32| {
            let angle = TAU * f64::from(group) / 12.0;
            let depth = if group.is_multiple_of(2) { 1e-3 } else { 5e-3 };
            let noise = 5e-6 * (7.0 * f64::from(group)).sin();
            let point = turn
                * Point3::from(toward(angle / TAU) * (4e-3 - BALL + noise) - Vector3::z() * depth);
            Observation {
                point,
                offset: BALL,
                sigma: 5e-6,
                group,
            }
        };
        (0..12).map(place).collect()
    }

    /// The fit of a hole within the prior is square; a hole that leans by 5° is measured as it is.
    #[test]
    fn walls_that_lean_are_not_taken_for_square_ones() {
        let guess = Cylinder::new(Point3::origin(), &Vector3::z(), 4e-3, true);
        let known = 2.5e-3;
        let (sigma, params) = squareness(known, &guess, &touches(0.5 * known), &LEAN);
        assert_eq!((sigma, params.axis_sigma), (known, Some(known)));
        let leaning = touches(5f64.to_radians());
        let (_, params) = squareness(known, &guess, &leaning, &LEAN);
        assert_eq!(params.axis_sigma, None);
        let axis = fit(&guess, &leaning, &params).unwrap().surface.axis();
        let drawn = Vector3::new(5f64.to_radians().sin(), 0.0, 5f64.to_radians().cos());
        assert!(axis.cross(&drawn).norm() < 3e-3, "{axis:?}");
        // half of them: not enough for a lean
        assert_eq!(
            squareness(known, &guess, &leaning[..6], &LEAN).1.axis_sigma,
            Some(known)
        );
    }
}
