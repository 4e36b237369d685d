//! The slot through few touches: where the ball's centre was stopped lies at one distance from a segment.

use nalgebra::{Matrix5, Point2, Vector2, Vector5};

use crate::features::fit::from_segment;
use crate::numeric::{DampedSearch, NormalEquations};

/// All points at a distance from a segment of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SlotFit {
    /// of the segment, m
    pub middle: Point2<f64>,
    /// of the segment, from x, rad
    pub angle: f64,
    /// half its length, m
    pub half: f64,
    /// distance from it, m
    pub radius: f64,
}

/// Directions that are tried as first guesses.
const ANGLES: usize = 24;
/// Half lengths that are tried as first guesses, over the farthest point.
const HALVES: [f64; 4] = [0.3, 0.6, 0.9, 1.2];
/// Places that are free may be this much beyond it, m.
const BESIDE: f64 = 0.2e-3;
/// Fits whose residuals are below this, rms, agree with the points: noise of a touch, and its sliding at a flat angle, m.
const AGREES: f64 = 20e-6;
/// Where along it the place is that the ball fell in, over its half length.
const SHIFTS: [f64; 3] = [-0.9, 0.0, 0.9];
/// All of its steps are made: no touch says how near is near enough.
const SEARCH: DampedSearch =
    DampedSearch { first: 1e-3, factors: [0.2, 5.0], least: 0.0, most: f64::INFINITY, tries: 60 };
/// What no touch determines stays where it is: weight of the guess against one touch.
const HELD: f64 = 1e-9;

impl SlotFit {
    /// Unit vector along it.
    pub fn along(&self) -> Vector2<f64> {
        Vector2::new(self.angle.cos(), self.angle.sin())
    }

    /// How far a point is from where it should be, m, and the derivatives by middle, angle, half length and radius.
    fn residual(&self, p: &Point2<f64>) -> (f64, Vector5<f64>) {
        let (u, v) = (p - self.middle, self.along());
        let w = Vector2::new(-v.y, v.x);
        let (x, y) = (u.dot(&v), u.dot(&w));
        let (distance, n) = from_segment(x, y, self.half);
        let by_middle = -(v * n[0] + w * n[1]);
        // turning the segment by a moves the point to (x + a y, y − a x) of its axes
        let by_angle = n[0] * y - n[1] * x;
        (distance - self.radius, Vector5::new(by_middle.x, by_middle.y, by_angle, -n[0].abs(), -1.0))
    }

    fn rms(&self, points: &[Point2<f64>]) -> f64 {
        (points.iter().map(|p| self.residual(p).0.powi(2)).sum::<f64>() / points.len().max(1) as f64).sqrt()
    }

    /// By least squares from a first guess.
    pub fn fitted(self, points: &[Point2<f64>]) -> Self {
        let scale = points.iter().map(|p| (p - self.middle).norm()).fold(1e-6, f64::max);
        // in units of the size, an angle is as large as a length
        let units = Vector5::new(scale, scale, 1.0, scale, scale);
        let damped = |mut equations: NormalEquations<5>, damping: f64| {
            equations.information += Matrix5::identity() * damping;
            equations
        };
        let equations = |slot: &Self| {
            let mut equations =
                NormalEquations { information: Matrix5::identity() * HELD, ..NormalEquations::default() };
            for p in points {
                let (r, by) = slot.residual(p);
                equations.add(&(by.component_mul(&units) / scale), -(r / scale), 1.0);
            }
            equations
        };
        let better = |slot: &Self, solved: &Vector5<f64>, before: f64| {
            let step = solved.component_mul(&units);
            let next = Self {
                middle: slot.middle + step.fixed_rows::<2>(0),
                angle: slot.angle + step[2],
                half: (slot.half + step[3]).max(0.0),
                radius: (slot.radius + step[4]).abs(),
            };
            Some((next, next.rms(points))).filter(|(_, rms)| *rms < before)
        };
        SEARCH.run((self, self.rms(points)), equations, damped, better, |_, _| false).0
    }

    /// The best one through points around a place, in any direction, among those with the free places inside. Where no point is at an
    /// end many lengths agree: then the shortest of them, whose ends lie no farther than what was touched.
    pub fn through(points: &[Point2<f64>], free: &[Point2<f64>], place: &Point2<f64>) -> Option<Self> {
        let distance = |p: &Point2<f64>| (p - place).norm();
        let near = points.iter().map(distance).fold(f64::INFINITY, f64::min);
        let far = points.iter().chain(free).map(distance).fold(0.0, f64::max);
        // a point beside the segment determines neither end: one of them has to be near where it really is
        let guess = |angle: f64, half: f64, shift: f64| {
            let direction = Vector2::new(angle.cos(), angle.sin());
            Self { middle: place + direction * (shift * half), angle, half, radius: near }
        };
        let angles = (0..ANGLES).map(|step| step as f64 / ANGLES as f64 * std::f64::consts::PI);
        let sized = angles.flat_map(|angle| HALVES.map(|half| (angle, half * far)));
        let guesses = sized.flat_map(|(angle, half)| SHIFTS.map(|shift| guess(angle, half, shift)));
        let beside = |fit: &Self| free.iter().filter(|p| fit.residual(p).0 > BESIDE).count();
        let fits = guesses.map(|guess| guess.fitted(points));
        let fits = fits.map(|fit| (beside(&fit), fit.rms(points).max(AGREES), fit));
        let shorter = |a: &Self, b: &Self| a.half.total_cmp(&b.half);
        fits.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(shorter(&a.2, &b.2))).map(|(.., fit)| fit)
    }

    /// The same, with its direction as that of another rather than against it.
    pub fn along_as(self, other: &Self) -> Self {
        let turn = if self.along().dot(&other.along()) < 0.0 { std::f64::consts::PI } else { 0.0 };
        Self { angle: self.angle + turn, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places of a slot from (−9, 0) to (5, 0) with a distance of 1.5 around its segment, by hand.
    #[test]
    fn eight_touches_determine_a_slot() {
        let points =
            [[6.5, 0.0], [4.0, 1.5], [0.0, 1.5], [-3.0, 1.5], [-10.5, 0.0], [-2.0, -1.5], [0.0, -1.5], [2.0, -1.5]];
        let turn = nalgebra::Rotation2::new(0.7);
        let points = points.map(|p| {
            let p = turn * Point2::new(p[0] * 1e-3, p[1] * 1e-3);
            Point2::from(p.coords)
        });
        let found = SlotFit::through(&points, &[], &Point2::origin()).unwrap();
        let middle = turn * Point2::new(-2e-3, 0.0);
        assert!((found.middle - middle).norm() < 1e-8, "{found:?}");
        assert!((found.half - 7e-3).abs() < 1e-8 && (found.radius - 1.5e-3).abs() < 1e-8, "{found:?}");
        assert!((found.along().perp(&Vector2::new(0.7f64.cos(), 0.7f64.sin()))).abs() < 1e-6, "{found:?}");
    }

    /// Touched on its straight walls alone, a slot may have any length from that of what was touched on: no more is believed.
    #[test]
    fn a_slot_with_open_ends_is_no_longer_than_what_was_touched() {
        let walls =
            [[-4.0, 1.5], [-1.0, 1.5], [0.5, 1.5], [3.0, 1.5], [-3.0, -1.5], [-0.5, -1.5], [1.0, -1.5], [4.5, -1.5]];
        let points = walls.map(|[x, y]| Point2::new(x * 1e-3, y * 1e-3));
        let found = SlotFit::through(&points, &[], &Point2::origin()).unwrap();
        assert!(found.along().y.abs() < 0.02 && (found.radius - 1.5e-3).abs() < 0.05e-3, "{found:?}");
        assert!(found.half > 3.5e-3 && found.half < 7e-3, "{found:?}");
    }

    /// Near one end, seven touches leave the direction of a slot of 20 × 6 open; where the ball moved freely determines it.
    #[test]
    fn a_free_place_determines_the_direction_of_a_slot() {
        // the ball's centre 0.35 mm before the centre of the right end, as if by hand
        let points = [[1.15, 0.0], [0.85, 1.08], [0.0, 1.46], [-1.5, 1.5], [-1.5, -1.5], [0.0, -1.46], [0.85, -1.08]];
        let points = points.map(|[x, y]| Point2::new(x * 1e-3, y * 1e-3));
        let free = [Point2::new(-12e-3, 0.0)];
        let found = SlotFit::through(&points, &free, &Point2::origin()).unwrap();
        assert!(found.along().y.abs() < 0.05 && (found.radius - 1.5e-3).abs() < 0.1e-3, "{found:?}");
        assert!(found.half > 5e-3, "{found:?}");
    }
}
