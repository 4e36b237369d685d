//! The wall of a hole or boss: its requested numbers, and its candidate touches.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};

use super::design::{Asked, Knowledge};
use super::measuring::{Measuring, Possible};
use super::search_context::{PatternParams, Quantity, SearchContext, TouchPlan};
use crate::features::fit::{Cylinder, Fit, FitError, FitParams, Freedom, Observation, Plane, fit};
use crate::numeric::{NormalEquations, mean};

/// Directions that are candidates.
const DIRECTIONS: usize = 24;
/// A hole is perpendicular to its surface within this, rad.
pub(super) const SQUARE: f64 = 0.02;
/// The ball's centre is this far below the surface where the wall is touched highest, over its radius: below a rim that is broken
/// by no more, and as near to the opening as it may be, as the numbers refer to that place.
pub(super) const BELOW_RIM: f64 = 0.7;
/// So many touches before it is believed.
pub(super) const LEAST_WALL: usize = 8;

/// A round wall that is being touched.
#[derive(Clone, Debug, Default)]
pub(super) struct RoundWall {
    pub measuring: Measuring,
    /// middle in F
    pub middle: Point3<f64>,
    pub is_boss: bool,
}

impl RoundWall {
    /// The middle of the circle through the contacts.
    pub fn recentre(&mut self, context: &SearchContext) {
        if let Some((centre, _)) = self.circle(context) {
            self.middle = centre;
        }
    }

    fn circle(&self, context: &SearchContext) -> Option<(Point3<f64>, f64)> {
        let points: Vec<_> = self.measuring.observations.iter().map(|o| context.in_f(&o.point)).collect();
        circle_through(&points)
    }

    /// As far as is known, m.
    pub fn radius(&self, context: &SearchContext) -> f64 {
        let ball = context.params.ball_radius;
        let centres = self.circle(context).map_or(0.0, |(_, radius)| radius);
        if self.is_boss { centres - ball } else { centres + ball }
    }

    fn guess(&self, context: &SearchContext) -> Cylinder {
        let middle = context.pose_of * Point3::new(self.middle.x, self.middle.y, context.height);
        let pose_of = Isometry3::from_parts(middle.coords.into(), context.pose_of.rotation);
        Cylinder { pose_of, radius: self.radius(context), concave: !self.is_boss }
    }

    fn asked(params: &PatternParams) -> Asked {
        let asked = Asked::default();
        let place =
            |asked: Asked| asked.and(&[(Freedom::X, 1.0)], params.sigma).and(&[(Freedom::Y, 1.0)], params.sigma);
        let size = |asked: Asked| asked.and(&[(Freedom::Size, 2.0)], params.sigma);
        match params.quantity {
            Quantity::Position => place(asked),
            Quantity::Axis => {
                asked.and(&[(Freedom::TiltX, 1.0)], params.sigma).and(&[(Freedom::TiltY, 1.0)], params.sigma)
            }
            Quantity::Diameter => size(asked),
            Quantity::All | Quantity::Length | Quantity::Width => size(place(asked)),
        }
    }

    fn before(context: &SearchContext, guess: &Cylinder) -> Knowledge {
        Knowledge::before::<Cylinder>(guess.radius.max(context.params.ball_radius), SQUARE)
    }

    /// Standard uncertainty of the requested number, m or rad.
    pub fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        let guess = self.guess(context);
        let params = FitParams { axis_sigma: Some(SQUARE), ..FitParams::default() };
        let asked = Self::asked(&context.params);
        let share = || {
            self.measuring.uncertainty_ratio(
                &guess,
                &params,
                Self::before(context, &guess),
                &asked,
                context.params.touch_sigma,
            )
        };
        let has_enough = self.measuring.observations.len() >= LEAST_WALL;
        has_enough.then(share).flatten().map(|share| share * context.params.sigma)
    }

    /// Whether it has the requested uncertainty.
    pub fn is_known(&self, context: &SearchContext) -> bool {
        self.uncertainty(context).is_some_and(|sigma| sigma <= context.params.sigma)
    }

    /// The touch of the wall with the largest gain.
    ///
    /// - `depths`: below the surface, m.
    pub fn best(&mut self, context: &SearchContext, depths: [f64; 2]) -> Option<TouchPlan> {
        let surface = self.guess(context);
        let ball = context.params.ball_radius;
        // in a hole from the middle, of a boss from beside it
        let from = if self.is_boss { surface.radius + ball + context.params.clearance } else { 0.0 };
        let travel = if self.is_boss { context.params.clearance } else { surface.radius - ball };
        let possible = (0..DIRECTIONS).flat_map(|at| depths.map(|depth| (at as f64 / DIRECTIONS as f64 * TAU, depth)));
        let possible = possible.map(|(angle, depth)| {
            let direction = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let planned =
                context.sideways(&(self.middle + direction * from), depth, &self.towards(direction), travel + REACH);
            let point = surface.pose_of * (Point3::origin() + direction * surface.radius - Vector3::z() * depth);
            Possible { point, travel, planned }
        });
        let possible = possible.collect();
        let known = self.measuring.known(&surface, Self::before(context, &surface), context.params.touch_sigma);
        let asked = Self::asked(&context.params).and_the_rest::<Cylinder>(context.params.sigma, surface.radius);
        let (best, _) = self.measuring.best(&surface, &known, possible, &asked, context.params.touch_sigma)?;
        Some(self.measuring.aim(&best))
    }

    /// Into the wall, at a direction from the middle.
    pub fn towards(&self, direction: Vector3<f64>) -> Vector3<f64> {
        if self.is_boss { -direction } else { direction }
    }

    /// The cylinder through the contacts of the wall, perpendicular to a surface.
    pub fn fitted(&self, context: &SearchContext, top: &Fit<Plane>) -> Result<Fit<Cylinder>, FitError> {
        let middle = self.guess(context).pose_of.translation.vector.into();
        let guess = Cylinder::new(middle, &top.surface.normal(), self.radius(context), !self.is_boss);
        fit(&guess, &self.measuring.observations, &FitParams { axis_sigma: Some(SQUARE), ..FitParams::default() })
    }
}

/// A wall is searched so much farther than expected, m.
const REACH: f64 = 3e-3;

/// The plane through the contacts of the surface about a place of F.
pub(super) fn surface_about(
    context: &SearchContext,
    middle: &Point3<f64>,
    observations: &[Observation],
) -> Result<Fit<Plane>, FitError> {
    let middle = context.pose_of * Point3::new(middle.x, middle.y, context.height);
    fit(&Plane::new(middle, &context.out()), observations, &FitParams::default())
}

/// Middle and radius of the circle through points of a plane, by least squares of x² + y² = 2ax + 2by + c \[Kåsa 1976\].
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
