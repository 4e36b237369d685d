//! The place nearest to a point that is on several surfaces at once.

use nalgebra::{Point3, Vector3};

use touchup_geometry::brep::AnalyticSurface;
use touchup_geometry::numeric::{DampedSearch, NormalEquations};

/// Condition for a place.
#[derive(Clone, Copy, Debug)]
pub(super) enum PlaceCondition<'a> {
    /// on a surface
    On(&'a AnalyticSurface),
    /// on the line through a point along a unit vector
    Along(Point3<f64>, Vector3<f64>),
}

/// Damping in units of squared sines between surfaces: they meet at more than 10⁻⁵ rad.
const SEARCH: DampedSearch = DampedSearch {
    first: 1e-4,
    factors: [0.1, 10.0],
    least: 1e-10,
    most: 1e3,
    tries: 80,
};
/// Step of a found place, m: far below each tolerance.
const SETTLED: f64 = 1e-13;

impl PlaceCondition<'_> {
    fn rows(&self, p: &Point3<f64>) -> [(Vector3<f64>, f64); 3] {
        match self {
            Self::On(surface) => {
                let none = (Vector3::zeros(), 0.0);
                [(surface.normal(p), -surface.signed_distance(p)), none, none]
            }
            Self::Along(origin, direction) => {
                let off = p - origin;
                let off = off - direction * off.dot(direction);
                [0, 1, 2].map(|i| (Vector3::ith(i, 1.0) - direction * direction[i], -off[i]))
            }
        }
    }

    fn square(&self, p: &Point3<f64>) -> f64 {
        self.rows(p).iter().map(|(_, off)| off * off).sum()
    }
}

/// The place near `start` with the least squares of its distances.
pub(super) fn settled(conditions: &[PlaceCondition], start: &Point3<f64>) -> Point3<f64> {
    let cost = |p: &Point3<f64>| conditions.iter().map(|one| one.square(p)).sum::<f64>();
    let equations =
        |p: &Point3<f64>| NormalEquations::of(conditions.iter().flat_map(|one| one.rows(p)));
    let damped = |mut equations: NormalEquations<3>, damping: f64| {
        for axis in 0..3 {
            equations.add(&Vector3::ith(axis, 1.0), 0.0, damping);
        }
        equations
    };
    let better = |p: &Point3<f64>, step: &Vector3<f64>, before: f64| {
        let next = p + step;
        let after = cost(&next);
        (after < before).then_some((next, after))
    };
    let is_last = |step: &Vector3<f64>, _: &NormalEquations<3>| step.norm() < SETTLED;
    SEARCH
        .run((*start, cost(start)), equations, damped, better, is_last)
        .0
}

/// The place near `start` on all surfaces, and its largest distance from one, m.
pub(super) fn on_all(surfaces: &[&AnalyticSurface], start: &Point3<f64>) -> (Point3<f64>, f64) {
    let conditions: Vec<_> = surfaces.iter().map(|one| PlaceCondition::On(one)).collect();
    let place = settled(&conditions, start);
    (place, farthest(surfaces, &place))
}

/// Largest distance of a place from some surfaces, m.
pub(super) fn farthest(surfaces: &[&AnalyticSurface], place: &Point3<f64>) -> f64 {
    let distances = surfaces.iter().map(|one| one.signed_distance(place).abs());
    distances.fold(0.0, f64::max)
}
