//! The wall of a hole or boss: what is asked of it, and where it could be touched.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};

use super::design::{Asked, Knowledge};
use super::measuring::{Measuring, Possible};
use super::search_context::{PatternParams, Quantity, SearchContext, TouchPlan};
use crate::features::fit::{Cylinder, Fit, FitError, FitParams, Freedom, Observation, Plane, fit};
use crate::numeric::{NormalEquations, mean};

/// Directions that are candidates.
const DIRECTIONS: usize = 24;
/// A hole stands square to its surface within this, rad.
pub(super) const SQUARE: f64 = 0.02;
/// The ball's centre is this far below the surface where the wall is touched highest, over its radius: below a rim that is broken
/// by no more, and as near to the opening as it may be, as that is where the numbers are asked for.
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
    /// The middle of the circle through what was felt.
    pub fn recentre(&mut self, course: &SearchContext) {
        if let Some((centre, _)) = self.circle(course) {
            self.middle = centre;
        }
    }

    fn circle(&self, course: &SearchContext) -> Option<(Point3<f64>, f64)> {
        let points: Vec<_> = self.measuring.felt.iter().map(|o| course.in_f(&o.point)).collect();
        circle_through(&points)
    }

    /// As far as is known, m.
    pub fn radius(&self, course: &SearchContext) -> f64 {
        let ball = course.params.ball_radius;
        let centres = self.circle(course).map_or(0.0, |(_, radius)| radius);
        if self.is_boss { centres - ball } else { centres + ball }
    }

    fn guess(&self, course: &SearchContext) -> Cylinder {
        let middle = course.pose_of * Point3::new(self.middle.x, self.middle.y, course.height);
        let pose_of = Isometry3::from_parts(middle.coords.into(), course.pose_of.rotation);
        Cylinder { pose_of, radius: self.radius(course), concave: !self.is_boss }
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

    fn before(course: &SearchContext, guess: &Cylinder) -> Knowledge {
        Knowledge::before::<Cylinder>(guess.radius.max(course.params.ball_radius), SQUARE)
    }

    /// Standard uncertainty of what is asked, m or rad.
    pub fn uncertainty(&self, course: &SearchContext) -> Option<f64> {
        let guess = self.guess(course);
        let params = FitParams { axis_sigma: Some(SQUARE), ..FitParams::default() };
        let asked = Self::asked(&course.params);
        let share =
            || self.measuring.told(&guess, &params, Self::before(course, &guess), &asked, course.params.touch_sigma);
        let has_enough = self.measuring.felt.len() >= LEAST_WALL;
        has_enough.then(share).flatten().map(|share| share * course.params.sigma)
    }

    /// Whether it is known as well as was asked.
    pub fn is_known(&self, course: &SearchContext) -> bool {
        self.uncertainty(course).is_some_and(|sigma| sigma <= course.params.sigma)
    }

    /// The touch of the wall that tells most.
    ///
    /// - `depths`: below the surface, m.
    pub fn best(&mut self, course: &SearchContext, depths: [f64; 2]) -> Option<TouchPlan> {
        let surface = self.guess(course);
        let ball = course.params.ball_radius;
        // in a hole from the middle, of a boss from beside it
        let from = if self.is_boss { surface.radius + ball + course.params.clearance } else { 0.0 };
        let travel = if self.is_boss { course.params.clearance } else { surface.radius - ball };
        let possible = (0..DIRECTIONS).flat_map(|at| depths.map(|depth| (at as f64 / DIRECTIONS as f64 * TAU, depth)));
        let possible = possible.map(|(angle, depth)| {
            let way = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let wish = course.sideways(&(self.middle + way * from), depth, &self.towards(way), travel + REACH);
            let point = surface.pose_of * (Point3::origin() + way * surface.radius - Vector3::z() * depth);
            Possible { point, travel, wish }
        });
        let possible = possible.collect();
        let known = self.measuring.known(&surface, Self::before(course, &surface), course.params.touch_sigma);
        let asked = Self::asked(&course.params).and_the_rest::<Cylinder>(course.params.sigma, surface.radius);
        let (best, _) = self.measuring.best(&surface, &known, possible, &asked, course.params.touch_sigma)?;
        Some(self.measuring.aim(&best))
    }

    /// Into the wall, at a direction from the middle.
    pub fn towards(&self, way: Vector3<f64>) -> Vector3<f64> {
        if self.is_boss { -way } else { way }
    }

    /// The cylinder through what was felt of the wall, square to a surface.
    pub fn fitted(&self, course: &SearchContext, top: &Fit<Plane>) -> Result<Fit<Cylinder>, FitError> {
        let middle = self.guess(course).pose_of.translation.vector.into();
        let guess = Cylinder::new(middle, &top.surface.normal(), self.radius(course), !self.is_boss);
        fit(&guess, &self.measuring.felt, &FitParams { axis_sigma: Some(SQUARE), ..FitParams::default() })
    }
}

/// So much farther than expected a wall is looked for, m.
const REACH: f64 = 3e-3;

/// The plane through what was felt of the surface about a place of F.
pub(super) fn surface_about(
    course: &SearchContext,
    middle: &Point3<f64>,
    felt: &[Observation],
) -> Result<Fit<Plane>, FitError> {
    let middle = course.pose_of * Point3::new(middle.x, middle.y, course.height);
    fit(&Plane::new(middle, &course.out()), felt, &FitParams::default())
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
