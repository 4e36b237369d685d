//! Touches that others contradict.

use nalgebra::{Point3, Vector3};

use super::places::{Class, RefinedShape};
use crate::compare::CompareError;
use crate::compare::deviation::{at_closest_places, signed};
use touchup_geometry::mesh::{FaceHit, SerialWorkers};
use touchup_geometry::numeric::{PointGrid, median};
use touchup_method::stylus::ProbedPoint;

/// Consecutive bad touches.
#[derive(Clone, Debug, PartialEq)]
pub struct BadTouches {
    /// indices of the touches, ascending
    pub touches: Vec<u32>,
    /// mean place, m
    pub centre: Point3<f64>,
    /// the largest signed distance from the surface of the other touches, m: positive outside
    pub off: f64,
    /// the same distance in standard deviations
    pub sigmas: f64,
    /// number of touches rejected during refinement
    pub rejected: usize,
    /// number of good touches there from other passes with similar normals
    pub against: usize,
}

/// Minimum distance of a bad touch from the surface, in standard deviations.
const SIGMAS: f64 = 6.0;
/// Minimum distance, m: the error of a half-millimetre lattice at an edge.
const LEAST_OFF: f64 = 0.15e-3;
/// Minimum number of touches at other times that contradict one.
const FEWEST: usize = 3;
/// Minimum cosine between similar normals: 26°.
const ALIKE: f64 = 0.9;
/// Minimum standard deviation, m.
const LEAST_SIGMA: f64 = 1e-6;
/// Maximum pause between touches of one group, ns.
const PAUSE_NS: i64 = 100_000_000;
/// Radius of one place, m, for a tip without a ball; else the ball's radius.
const NEAR: f64 = 1e-3;
/// Minimum share of bad touches at a badly touched place.
const SHARE: f64 = 0.5;

/// Rejected touches, and touches off both the surface and the other measurements there.
pub(super) fn find(
    refined: &RefinedShape<'_>,
    touches: &[ProbedPoint],
) -> Result<Vec<BadTouches>, CompareError> {
    let (off, feet) = distances(refined, touches)?;
    let points: Vec<Point3<f64>> = touches.iter().map(|touch| touch.point).collect();
    let reach = reach(touches);
    let taken = PointGrid::of(
        &points,
        (0..touches.len()).filter(|&at| !touches[at].is_rejected),
        reach,
    );
    let is_bad = |at: usize| {
        let limit = limit(&touches[at]);
        touches[at].is_rejected
            || (off[at].abs() > limit
                && contradiction(touches, at, &taken, &feet[at], reach).is_some_and(|d| d > limit))
    };
    let bad: Vec<usize> = (0..touches.len()).filter(|&at| is_bad(at)).collect();
    let good = PointGrid::of(
        &points,
        (0..touches.len()).filter(|at| bad.binary_search(at).is_err()),
        reach,
    );
    let goes_on = |a: &usize, b: &usize| {
        touches[*b].stamp_ns.saturating_sub(touches[*a].stamp_ns) <= PAUSE_NS
    };
    let bad_touches_of = |numbers: &[usize]| {
        bad_touches_of(numbers, touches, &off, |worst| {
            against(touches, worst, &good, &feet[worst], reach).count()
        })
    };
    Ok(bad.chunk_by(goes_on).map(bad_touches_of).collect())
}

/// Minimum distance of a bad touch from the surface, m.
fn limit(touch: &ProbedPoint) -> f64 {
    (SIGMAS * touch.sigma_along_normal()).max(LEAST_OFF)
}

/// Touches at other times near the foot of a touch on the surface, with similar normals.
fn against<'a>(
    touches: &'a [ProbedPoint],
    at: usize,
    others: &'a PointGrid,
    foot: &'a Point3<f64>,
    reach: f64,
) -> impl Iterator<Item = usize> + 'a {
    others.near(foot, reach / 2.0).filter(move |&other| {
        let is_other =
            touches[other].stamp_ns.abs_diff(touches[at].stamp_ns) > PAUSE_NS.unsigned_abs();
        is_other && touches[other].normal.dot(&touches[at].normal) > ALIKE
    })
}

/// Median distance of a touch from the planes of other touches there, m; `None` if they are too
/// few.
fn contradiction(
    touches: &[ProbedPoint],
    at: usize,
    taken: &PointGrid,
    foot: &Point3<f64>,
    reach: f64,
) -> Option<f64> {
    let off = |other: usize| {
        (touches[at].point - touches[other].point)
            .dot(&touches[other].normal)
            .abs()
    };
    let mut off: Vec<f64> = against(touches, at, taken, foot, reach).map(off).collect();
    if off.len() < FEWEST {
        None
    } else {
        median(&mut off)
    }
}

fn bad_touches_of(
    numbers: &[usize],
    touches: &[ProbedPoint],
    off: &[f64],
    against: impl Fn(usize) -> usize,
) -> BadTouches {
    let sum: Vector3<f64> = numbers.iter().map(|&at| touches[at].point.coords).sum();
    let sigmas = |at: usize| off[at] / touches[at].sigma_along_normal().max(LEAST_SIGMA);
    let worst = numbers
        .iter()
        .copied()
        .max_by(|a, b| off[*a].abs().total_cmp(&off[*b].abs()))
        .unwrap_or(numbers[0]);
    BadTouches {
        touches: numbers.iter().map(|&at| at as u32).collect(),
        centre: (sum / numbers.len() as f64).into(),
        off: off[worst],
        sigmas: sigmas(worst).abs(),
        rejected: numbers
            .iter()
            .filter(|&&at| touches[at].is_rejected)
            .count(),
        against: against(worst),
    }
}

/// Distance of each touch from the refined surface, m, by the ball's centre, which is independent
/// of the measured normal; and the closest place there.
fn distances(
    refined: &RefinedShape<'_>,
    touches: &[ProbedPoint],
) -> Result<(Vec<f64>, Vec<Point3<f64>>), CompareError> {
    let mesh = refined.shape.mesh;
    let centres: Vec<Point3<f64>> = touches.iter().map(|touch| touch.centre).collect();
    let foot = |centre: &Point3<f64>, hit: &FaceHit| (signed(centre, mesh, hit), hit.point);
    let feet = at_closest_places(&centres, mesh, refined.shape.tree, &SerialWorkers, foot)?;
    Ok(feet
        .into_iter()
        .zip(touches)
        .map(|((distance, foot), touch)| (distance - touch.radius, foot))
        .unzip())
}

fn reach(touches: &[ProbedPoint]) -> f64 {
    let radius = touches.iter().map(|touch| touch.radius).fold(0.0, f64::max);
    if radius > 0.0 { radius } else { NEAR }
}

/// Marks the places that most nearby touches measure wrongly.
pub(super) fn mark(
    refined: &RefinedShape<'_>,
    touches: &[ProbedPoint],
    bad: &[BadTouches],
    classes: &mut [Class],
) {
    let mesh = refined.shape.mesh;
    let points: Vec<Point3<f64>> = touches.iter().map(|touch| touch.point).collect();
    let reach = reach(touches);
    let all = PointGrid::of(&points, 0..points.len(), reach);
    let mut is_bad = vec![false; touches.len()];
    bad.iter()
        .flat_map(|bad| &bad.touches)
        .for_each(|&at| is_bad[at as usize] = true);
    let near_bad = PointGrid::of(&points, (0..points.len()).filter(|&at| is_bad[at]), reach);
    for (at, class) in classes.iter_mut().enumerate() {
        let p = mesh.positions()[at];
        if class.is_touched() && near_bad.near(&p, reach).next().is_some() {
            let count = all.near(&p, reach / 2.0).count();
            let wrong = all
                .near(&p, reach / 2.0)
                .filter(|&touch| is_bad[touch])
                .count();
            if wrong > 0 && wrong as f64 >= SHARE * count as f64 {
                *class = Class::BadTouch;
            }
        }
    }
}
