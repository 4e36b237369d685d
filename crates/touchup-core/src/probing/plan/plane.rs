//! A plane: a first triangle, then where a touch tells most of its place or of its normal.

use nalgebra::Point3;

use super::cylinder_fit::surface_about;
use super::design::{Asked, Knowledge};
use super::error::ExploreError;
use super::hole::numbers;
use super::measuring::{Measuring, Possible};
use super::pattern::{Next, Stage, Touched};
use super::search::{ROUGH, hexagonal};
use super::search_context::{PatternParams, Quantity, SearchContext, TouchResult};
use super::slide::Slide;
use crate::features::Feature;
use crate::features::fit::{FitParams, Freedom, Plane};

/// Places across the field that are candidates.
const ACROSS: f64 = 6.0;
/// So many touches before it is believed.
const LEAST: usize = 6;
/// What leans more is another surface, rad.
const LEAN: f64 = 0.2;

#[derive(Clone, Debug)]
pub(super) struct PlanePattern {
    measuring: Measuring,
    /// where it can be touched, in F
    places: Vec<Point3<f64>>,
    first: usize,
}

/// Touches of the first triangle.
const FIRST: usize = 3;

impl PlanePattern {
    pub fn new(params: &PatternParams) -> Self {
        let places = hexagonal(2.0 * params.flag_radius / ACROSS, params.flag_radius);
        Self { measuring: Measuring::default(), places, first: 0 }
    }

    fn guess(course: &SearchContext) -> Plane {
        Plane { pose_of: course.pose_of * nalgebra::Translation3::new(0.0, 0.0, course.height) }
    }

    fn asked(params: &PatternParams) -> Asked {
        let asked = Asked::default();
        let lean =
            |asked: Asked, sigma: f64| asked.and(&[(Freedom::TiltX, 1.0)], sigma).and(&[(Freedom::TiltY, 1.0)], sigma);
        let place = |asked: Asked| asked.and(&[(Freedom::Z, 1.0)], params.sigma);
        match params.quantity {
            Quantity::Axis => lean(asked, params.sigma),
            Quantity::Position => place(asked),
            // at the rim of the field it is to be known as well as in its middle
            _ => lean(place(asked), params.sigma / params.flag_radius),
        }
    }

    fn before(course: &SearchContext) -> Knowledge {
        Knowledge::before::<Plane>(course.params.flag_radius, LEAN)
    }

    fn possible(&self, course: &SearchContext) -> Vec<Possible> {
        let PatternParams { clearance, ball_radius, .. } = course.params;
        let search = clearance + ball_radius + ROUGH;
        let at = |place: &Point3<f64>| Possible {
            point: course.pose_of * Point3::new(place.x, place.y, course.height),
            travel: clearance,
            wish: course.down(place, search),
        };
        self.places.iter().map(at).collect()
    }
}

impl Stage for PlanePattern {
    fn next(&mut self, course: &SearchContext) -> Next {
        let possible = self.possible(course);
        if self.first < FIRST {
            // a third of a turn apart, near the rim
            let angle = self.first as f64 / FIRST as f64 * std::f64::consts::TAU;
            let way = nalgebra::Vector3::new(angle.cos(), angle.sin(), 0.0);
            let far = |p: &Possible| course.in_f(&p.point).coords.dot(&way);
            let Some(at) = possible.into_iter().max_by(|a, b| far(a).total_cmp(&far(b))) else {
                return Next::Done { is_as_asked: false };
            };
            return Next::Touch(self.measuring.aim(&at));
        }
        let asked = Self::asked(&course.params);
        let known = self.measuring.known(&Self::guess(course), Self::before(course), course.params.touch_sigma);
        if self.uncertainty(course).is_some_and(|sigma| sigma <= course.params.sigma) {
            return Next::Done { is_as_asked: true };
        }
        let best = self.measuring.best(&Self::guess(course), &known, possible, &asked, course.params.touch_sigma);
        match best {
            Some((best, _)) => Next::Touch(self.measuring.aim(&best)),
            None => Next::Done { is_as_asked: false },
        }
    }

    fn take(&mut self, course: &mut SearchContext, touch: &Touched) {
        self.first += 1;
        self.measuring.take(touch);
        let Some(place) = touch.place.filter(|_| matches!(touch.felt, TouchResult::At { .. })) else { return };
        let surface = course.below(&place);
        if self.measuring.felt.len() == 1 {
            course.height = surface;
        } else if (surface - course.height).abs() > course.params.ball_radius {
            // a step away: another surface
            self.measuring.refuse_last(touch);
        }
    }

    fn feature(&self, course: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        if self.measuring.felt.len() < FIRST {
            return Err(ExploreError::NotDone { touches: course.touches });
        }
        let fitted = surface_about(course, &Point3::origin(), &self.measuring.felt)?;
        let middle = course.pose_of * Point3::origin();
        Ok(Some(Feature::plane(&fitted, &middle, numbers([&self.measuring.felt]))))
    }

    fn uncertainty(&self, course: &SearchContext) -> Option<f64> {
        let (asked, sigma) = (Self::asked(&course.params), course.params.touch_sigma);
        let guess = Self::guess(course);
        let share = || self.measuring.told(&guess, &FitParams::default(), Self::before(course), &asked, sigma);
        (self.measuring.felt.len() >= LEAST).then(share).flatten().map(|share| share * course.params.sigma)
    }

    fn slides(&self, course: &SearchContext) -> Vec<Slide> {
        let Ok(fitted) = surface_about(course, &Point3::origin(), &self.measuring.felt) else { return Vec::new() };
        let level = SearchContext { pose_of: fitted.surface.pose_of, height: 0.0, ..course.clone() };
        vec![level.raster(course.params.flag_radius)]
    }
}
