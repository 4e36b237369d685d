//! One surface where a place was felt at two heights: what a session shows twice as a change.

use nalgebra::{Point3, Vector3};

use super::numbers::SessionNumbers;
use super::pressed_surface::PressedSurface;
use super::problem::SessionProblem;

/// Farthest presses on one place off the surface, m, and along it, as a share of the distance that the
/// ball keeps from the edge of a step of that height.
const ACROSS: f64 = 6e-3;
const ALONG: f64 = 0.7;
/// Minimum cosine of their normals.
const ALIKE: f64 = 0.95;
/// Minimum share of the presses of a surface on places of another.
const SHARE: f64 = 0.1;
/// Most presses of a surface that are compared.
const MOST_COMPARED: usize = 400;

/// Some presses on a surface, each with the normal there.
struct FeltFace {
    /// of the ball, m
    radius: f64,
    places: Vec<(Point3<f64>, Vector3<f64>)>,
}

/// Surfaces, each with the presses of all others, and of no surface, that felt the same places.
///
/// - `lost`: presses on no surface.
pub(super) fn merged(
    problem: &SessionProblem,
    (mut surfaces, lost): (Vec<PressedSurface>, Vec<u32>),
    numbers: &SessionNumbers,
) -> Vec<PressedSurface> {
    surfaces.sort_by_key(|surface| std::cmp::Reverse(surface.presses.len()));
    let mut kept: Vec<(PressedSurface, FeltFace)> = Vec::new();
    for surface in surfaces {
        let face = FeltFace::of(problem, &surface, numbers);
        let shared = kept.iter_mut().find(|(_, other)| other.is_shared(&face));
        match shared {
            Some((other, _)) => other.presses.extend(surface.presses),
            None => kept.push((surface, face)),
        }
    }
    for at in lost {
        let placed = problem.placed(at, numbers);
        let near = kept
            .iter_mut()
            .find(|(_, face)| face.is_near(&placed.centre, &placed.force));
        if let Some((surface, _)) = near {
            surface.presses.push(at);
        }
    }
    kept.into_iter().map(|(surface, _)| surface).collect()
}

impl FeltFace {
    fn of(problem: &SessionProblem, surface: &PressedSurface, numbers: &SessionNumbers) -> Self {
        let step = surface.presses.len().div_ceil(MOST_COMPARED).max(1);
        let some = surface.presses.iter().step_by(step);
        let place = |&at: &u32| {
            let centre = problem.placed(at, numbers).centre;
            (centre, surface.at(&centre).1)
        };
        Self {
            radius: problem.radius,
            places: some.map(place).collect(),
        }
    }

    /// Whether a place with a normal lies over or under this one.
    fn is_near(&self, centre: &Point3<f64>, normal: &Vector3<f64>) -> bool {
        self.places.iter().any(|(own, of)| {
            let apart = own - centre;
            let across = apart.dot(normal);
            of.dot(normal) > ALIKE
                && across.abs() < ACROSS
                && (apart - normal * across).norm() < ALONG * self.kept_from_step(across.abs())
        })
    }

    /// Distance of the centre of the ball from the edge of a step that it touches from below:
    /// √(2 r h − h²), r from h = r on.
    fn kept_from_step(&self, height: f64) -> f64 {
        let height = height.min(self.radius);
        (height * (2.0 * self.radius - height)).sqrt()
    }

    /// Whether enough of another face does.
    fn is_shared(&self, other: &Self) -> bool {
        let places = other.places.iter();
        let shared = places.filter(|(centre, normal)| self.is_near(centre, normal));
        shared.count() as f64 >= SHARE * other.places.len() as f64
    }
}
