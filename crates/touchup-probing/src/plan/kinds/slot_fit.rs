//! Fit of a slot to few touches: the ball's centres lie at one distance from a segment, or on a
//! rectangle for straight ends.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix5, Point2, Vector2, Vector5};

use touchup_features::features::fit::{Ends, from_segment};
use touchup_geometry::numeric::{DampedSearch, NormalEquations};

/// All points at a distance from a segment of a plane; for straight ends the rectangle around them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plan) struct SlotFit {
    /// middle of the segment, m
    pub middle: Point2<f64>,
    /// angle of the segment, from x, rad
    pub angle: f64,
    /// half the length of the segment, m
    pub half: f64,
    /// distance from the segment, m
    pub radius: f64,
    pub ends: Ends,
}

/// Directions of first guesses.
const ANGLES: usize = 24;
/// Half lengths of first guesses, over the farthest point.
const HALVES: [f64; 4] = [0.3, 0.6, 0.9, 1.2];
/// Maximum distance of free places beyond the slot, m.
const BESIDE: f64 = 0.2e-3;
/// Rms of residuals below which a fit agrees with the points: noise of a touch, and its sliding at
/// a flat angle, m.
const AGREES: f64 = 20e-6;
/// Positions of the ball's fall along first guesses, over their half length.
const SHIFTS: [f64; 3] = [-0.9, 0.0, 0.9];
/// Share of the residuals below which the other kind of ends is credible.
const BETTER: f64 = 0.5;
/// Length that a slot with straight ends may lack against its width, over half its width: a nearly
/// square slot has no long side to choose.
const SHORTER: f64 = 0.5;
/// Lack of length, over half the width, up to which a slot with straight ends is not turned to be
/// longer than wide.
const SQUARE: f64 = 0.02;
/// Maximum size of the corners of straight ends, over the distance of the ball's centre from the
/// middle line.
pub(in crate::plan) const CORNER: f64 = 0.5;
/// Rounds that assign points to corners.
const CORNER_ROUNDS: usize = 3;
/// Minimum share of the points off the corners.
const LEAST_KEPT: f64 = 0.6;
/// Unknowns of the fit.
const FREEDOMS: usize = 5;
/// A search that makes all of its steps: no touch says which step is small enough.
const SEARCH: DampedSearch = DampedSearch {
    first: 1e-3,
    factors: [0.2, 5.0],
    least: 0.0,
    most: f64::INFINITY,
    tries: 60,
};
/// A search from first guesses with straight ends; the best gets a full fit.
const COARSE: DampedSearch = DampedSearch {
    tries: 12,
    ..SEARCH
};
/// Points between new searches for a fit that disagrees with them.
const ANEW: usize = 4;
/// Weight of the guess against one touch: it holds freedoms that no touch determines.
const HELD: f64 = 1e-9;

impl SlotFit {
    /// Unit vector along the slot.
    pub(crate) fn along(&self) -> Vector2<f64> {
        Vector2::new(self.angle.cos(), self.angle.sin())
    }

    /// Distance of a point from the slot, m, and the derivatives by middle, angle, half length and
    /// radius.
    fn residual(&self, p: &Point2<f64>) -> (f64, Vector5<f64>) {
        let (u, v) = (p - self.middle, self.along());
        let w = Vector2::new(-v.y, v.x);
        let (x, y) = (u.dot(&v), u.dot(&w));
        let (residual, n) = match self.ends {
            Ends::Round => {
                let (distance, n) = from_segment(x, y, self.half);
                (distance - self.radius, n)
            }
            Ends::Straight => self.outside_rectangle(x, y),
        };
        let by_middle = -(v * n[0] + w * n[1]);
        // turning the segment by a moves the point to (x + a y, y − a x) of its axes
        let by_angle = n[0] * y - n[1] * x;
        let by_radius = if self.ends == Ends::Round {
            -1.0
        } else {
            -n[0].abs() - n[1].abs()
        };
        (
            residual,
            Vector5::new(by_middle.x, by_middle.y, by_angle, -n[0].abs(), by_radius),
        )
    }

    /// Distance of a place of its axes from the nearest side, m, and the unit vector away from it.
    fn outside_rectangle(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        let (beyond_end, beyond_wall) = (x.abs() - self.half - self.radius, y.abs() - self.radius);
        if beyond_end > beyond_wall {
            (beyond_end, [1f64.copysign(x), 0.0])
        } else {
            (beyond_wall, [0.0, 1f64.copysign(y)])
        }
    }

    fn rms(&self, points: &[Point2<f64>]) -> f64 {
        (points
            .iter()
            .map(|p| self.residual(p).0.powi(2))
            .sum::<f64>()
            / points.len().max(1) as f64)
            .sqrt()
    }

    /// Least-squares fit from a first guess.
    pub(crate) fn fitted(self, points: &[Point2<f64>]) -> Self {
        self.fitted_by(&SEARCH, points)
    }

    fn fitted_by(self, search: &DampedSearch, points: &[Point2<f64>]) -> Self {
        let scale = points
            .iter()
            .map(|p| (p - self.middle).norm())
            .fold(1e-6, f64::max);
        // in units of the size, an angle is as large as a length
        let units = Vector5::new(scale, scale, 1.0, scale, scale);
        let damped = |mut equations: NormalEquations<5>, damping: f64| {
            equations.information += Matrix5::identity() * damping;
            equations
        };
        let equations = |slot: &Self| {
            let mut equations = NormalEquations {
                information: Matrix5::identity() * HELD,
                ..NormalEquations::default()
            };
            for p in points {
                let (r, by) = slot.residual(p);
                equations.add(&(by.component_mul(&units) / scale), -(r / scale), 1.0);
            }
            equations
        };
        let better = |slot: &Self, solved: &Vector5<f64>, before: f64| {
            let step = solved.component_mul(&units);
            let radius = (slot.radius + step[4]).abs();
            let shortest = if slot.ends == Ends::Round {
                0.0
            } else {
                -SHORTER * radius
            };
            let next = Self {
                middle: slot.middle + step.fixed_rows::<2>(0),
                angle: slot.angle + step[2],
                half: (slot.half + step[3]).max(shortest),
                radius,
                ends: slot.ends,
            };
            Some((next, next.rms(points))).filter(|(_, rms)| *rms < before)
        };
        search
            .run(
                (self, self.rms(points)),
                equations,
                damped,
                better,
                |_, _| false,
            )
            .0
    }

    /// The same for straight ends, without the points of its corners; the longer side is the
    /// length.
    fn fitted_straight(self, search: &DampedSearch, points: &[Point2<f64>]) -> Self {
        let begun = self.fitted_by(search, points);
        let fitted = (0..CORNER_ROUNDS).fold(begun, |fit, _| {
            fit.fitted_by(search, &fit.off_corners(points))
        });
        if fitted.half >= -SQUARE * fitted.radius {
            return fitted;
        }
        let [radius, half] = [fitted.radius + fitted.half, -fitted.half];
        Self {
            angle: fitted.angle + FRAC_PI_2,
            radius,
            half,
            ..fitted
        }
        .fitted_by(search, &fitted.off_corners(points))
    }

    /// Whether a point may be in a corner of straight ends, which the fit does not model.
    pub(crate) fn is_in_corner(&self, p: &Point2<f64>) -> bool {
        let (u, v) = (p - self.middle, self.along());
        let corner = CORNER * self.radius;
        let is_near = |place: f64, half: f64| half - place.abs() < corner;
        self.ends == Ends::Straight
            && is_near(u.dot(&v), self.half + self.radius)
            && is_near(v.perp(&u), self.radius)
    }

    fn off_corners(&self, points: &[Point2<f64>]) -> Vec<Point2<f64>> {
        points
            .iter()
            .filter(|p| !self.is_in_corner(p))
            .copied()
            .collect()
    }

    /// Number of free places outside, and residuals off the corners, rms by the degrees of freedom,
    /// m; infinite for too few points.
    fn cost(&self, points: &[Point2<f64>], free: &[Point2<f64>]) -> (usize, f64) {
        let kept = self.off_corners(points);
        let beside = free.iter().filter(|p| self.residual(p).0 > BESIDE).count();
        let is_enough =
            kept.len() > FREEDOMS && kept.len() as f64 >= LEAST_KEPT * points.len() as f64;
        let squares: f64 = kept.iter().map(|p| self.residual(p).0.powi(2)).sum();
        let all_round = self.ends == Ends::Round && kept.len() <= FREEDOMS;
        let degrees = if all_round {
            kept.len()
        } else {
            kept.len().saturating_sub(FREEDOMS)
        };
        let rms = if is_enough || all_round {
            (squares / degrees.max(1) as f64).sqrt()
        } else {
            f64::INFINITY
        };
        (beside, rms)
    }

    /// Fit to more points; if it disagrees with them, the best of all fits at intervals.
    ///
    /// - `agrees`: residuals of a fit that agrees, m.
    pub(crate) fn fitted_to_more(
        self,
        points: &[Point2<f64>],
        free: &[Point2<f64>],
        agrees: f64,
    ) -> Self {
        let near = if self.ends == Ends::Round {
            self.fitted(points)
        } else {
            self.fitted_straight(&SEARCH, points)
        };
        let cost = near.cost(points, free);
        if cost.0 == 0 && cost.1 <= agrees || !points.len().is_multiple_of(ANEW) {
            return near;
        }
        let other = Self::through(points, free, &self.middle, agrees).filter(|other| {
            let (beside, rms) = other.cost(points, free);
            beside <= cost.0 && rms < BETTER * cost.1
        });
        other.unwrap_or(near)
    }

    /// Best slot through points around a place, in any direction, with the free places inside. If
    /// no point is at an end many lengths agree: then the shortest counts, whose ends lie no
    /// farther than the contacts. Ends are round unless the points say otherwise.
    ///
    /// - `agrees`: residuals of a fit that agrees with the points, m.
    pub(crate) fn through(
        points: &[Point2<f64>],
        free: &[Point2<f64>],
        place: &Point2<f64>,
        agrees: f64,
    ) -> Option<Self> {
        let agrees = agrees.max(AGREES);
        let round = Self::best(points, free, place, Ends::Round, agrees)?;
        let (beside, rms) = round.cost(points, free);
        if beside == 0 && rms <= agrees {
            return Some(round);
        }
        let straight = Self::best(points, free, place, Ends::Straight, agrees)?
            .fitted_straight(&SEARCH, points);
        let (straight_beside, straight_rms) = straight.cost(points, free);
        let is_straight = straight_beside <= beside && straight_rms < BETTER * rms;
        Some(if is_straight { straight } else { round })
    }

    fn best(
        points: &[Point2<f64>],
        free: &[Point2<f64>],
        place: &Point2<f64>,
        ends: Ends,
        agrees: f64,
    ) -> Option<Self> {
        let distance = |p: &Point2<f64>| (p - place).norm();
        let near = points.iter().map(distance).fold(f64::INFINITY, f64::min);
        let far = points.iter().chain(free).map(distance).fold(0.0, f64::max);
        // a point beside the segment determines neither end: a guess has to have one end near its
        // true place
        let guess = |angle: f64, half: f64, shift: f64| {
            let direction = Vector2::new(angle.cos(), angle.sin());
            Self {
                middle: place + direction * (shift * half),
                angle,
                half,
                radius: near,
                ends,
            }
        };
        let angles = (0..ANGLES).map(|step| step as f64 / ANGLES as f64 * PI);
        let sized = angles.flat_map(|angle| HALVES.map(|half| (angle, half * far)));
        let guesses = sized.flat_map(|(angle, half)| SHIFTS.map(|shift| guess(angle, half, shift)));
        let fits = guesses.map(|guess| match ends {
            Ends::Round => guess.fitted(points),
            Ends::Straight => guess.fitted_straight(&COARSE, points),
        });
        let fits = fits.map(|fit| {
            let (beside, rms) = fit.cost(points, free);
            (beside, rms.max(agrees), fit)
        });
        let shorter = |a: &Self, b: &Self| a.half.total_cmp(&b.half);
        fits.min_by(|a, b| {
            a.0.cmp(&b.0)
                .then(a.1.total_cmp(&b.1))
                .then(shorter(&a.2, &b.2))
        })
        .map(|(.., fit)| fit)
    }

    /// The same slot, with its direction along another's rather than against it.
    pub(crate) fn along_as(self, other: &Self) -> Self {
        let turn = if self.along().dot(&other.along()) < 0.0 {
            PI
        } else {
            0.0
        };
        Self {
            angle: self.angle + turn,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points at a distance of 1.5 around the segment from (−9, 0) to (5, 0), by hand.
    #[test]
    fn eight_touches_determine_a_slot() {
        let points = [
            [6.5, 0.0],
            [4.0, 1.5],
            [0.0, 1.5],
            [-3.0, 1.5],
            [-10.5, 0.0],
            [-2.0, -1.5],
            [0.0, -1.5],
            [2.0, -1.5],
        ];
        let turn = nalgebra::Rotation2::new(0.7);
        let points = points.map(|p| {
            let p = turn * Point2::new(p[0] * 1e-3, p[1] * 1e-3);
            Point2::from(p.coords)
        });
        let found = SlotFit::through(&points, &[], &Point2::origin(), 0.0).unwrap();
        let middle = turn * Point2::new(-2e-3, 0.0);
        assert!((found.middle - middle).norm() < 1e-8, "{found:?}");
        assert!(
            (found.half - 7e-3).abs() < 1e-8 && (found.radius - 1.5e-3).abs() < 1e-8,
            "{found:?}"
        );
        assert!(
            (found
                .along()
                .perp(&Vector2::new(0.7f64.cos(), 0.7f64.sin())))
            .abs()
                < 1e-6,
            "{found:?}"
        );
    }

    /// With contacts on its straight walls alone, a slot may have any length from theirs on: the
    /// fit has no more.
    #[test]
    fn a_slot_with_open_ends_is_no_longer_than_what_was_touched() {
        let walls = [
            [-4.0, 1.5],
            [-1.0, 1.5],
            [0.5, 1.5],
            [3.0, 1.5],
            [-3.0, -1.5],
            [-0.5, -1.5],
            [1.0, -1.5],
            [4.5, -1.5],
        ];
        let points = walls.map(|[x, y]| Point2::new(x * 1e-3, y * 1e-3));
        let found = SlotFit::through(&points, &[], &Point2::origin(), 0.0).unwrap();
        assert!(
            found.along().y.abs() < 0.02 && (found.radius - 1.5e-3).abs() < 0.05e-3,
            "{found:?}"
        );
        assert!(found.half > 3.5e-3 && found.half < 7e-3, "{found:?}");
    }

    /// Near one end, seven touches leave the direction of a slot of 20 × 6 open; a free place
    /// determines it.
    #[test]
    fn a_free_place_determines_the_direction_of_a_slot() {
        // the ball's centre 0.35 mm before the centre of the right end, by hand
        let points = [
            [1.15, 0.0],
            [0.85, 1.08],
            [0.0, 1.46],
            [-1.5, 1.5],
            [-1.5, -1.5],
            [0.0, -1.46],
            [0.85, -1.08],
        ];
        let points = points.map(|[x, y]| Point2::new(x * 1e-3, y * 1e-3));
        let free = [Point2::new(-12e-3, 0.0)];
        let found = SlotFit::through(&points, &free, &Point2::origin(), 0.0).unwrap();
        assert!(
            found.along().y.abs() < 0.05 && (found.radius - 1.5e-3).abs() < 0.1e-3,
            "{found:?}"
        );
        assert!(found.half > 5e-3, "{found:?}");
    }
}
