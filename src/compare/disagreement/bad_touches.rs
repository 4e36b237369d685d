//! Touches that others contradict.

use nalgebra::{Point3, Vector3};

use super::cells::Cells;
use super::{Class, RefinedShape};
use crate::compare::CompareError;
use crate::compare::deviation::closest_places;
use crate::touch::ProbedPoint;

/// Bad touches one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct BadTouches {
    /// numbers of the touches, in ascending order
    pub touches: Vec<u32>,
    /// mean place, m
    pub centre: Point3<f64>,
    /// the largest distance from the surface that the other touches make, m, with its sign: positive outside
    pub off: f64,
    /// … in standard deviations
    pub sigmas: f64,
    /// how many were held apart while the mesh was refined
    pub held_apart: usize,
    /// good touches of other strokes or times nearby
    pub against: usize,
}

/// Off by more standard deviations than this …
const SIGMAS: f64 = 6.0;
/// … and by more than this, m: what a lattice of half a millimetre leaves at an edge.
const LEAST_OFF: f64 = 0.15e-3;
/// Touches so close together in time are one, ns.
const PAUSE_NS: i64 = 100_000_000;
/// Touches so near speak of the same place, m, where there is no ball; else its radius.
const NEAR: f64 = 1e-3;
/// A place is badly touched when this share of its touches is bad.
const SHARE: f64 = 0.5;

/// Those held apart, and those that lie off the surface which all others make.
pub(super) fn find(refined: &RefinedShape<'_>, touches: &[ProbedPoint]) -> Result<Vec<BadTouches>, CompareError> {
    let off = distances(refined, touches)?;
    let is_bad = |at: usize| {
        let touch = &touches[at];
        let limit = (SIGMAS * touch.sigma.hypot(touch.calibration)).max(LEAST_OFF);
        touch.is_held_apart || off[at].abs() > limit
    };
    let bad: Vec<usize> = (0..touches.len()).filter(|&at| is_bad(at)).collect();
    let points: Vec<Point3<f64>> = touches.iter().map(|touch| touch.point).collect();
    let reach = reach(touches);
    let good = Cells::new(&points, (0..touches.len()).filter(|at| bad.binary_search(at).is_err()), reach);
    let goes_on = |a: &usize, b: &usize| touches[*b].stamp_ns.saturating_sub(touches[*a].stamp_ns) <= PAUSE_NS;
    Ok(bad.chunk_by(goes_on).map(|numbers| told(numbers, touches, &off, &good, reach)).collect())
}

fn told(numbers: &[usize], touches: &[ProbedPoint], off: &[f64], good: &Cells<'_>, reach: f64) -> BadTouches {
    let sum: Vector3<f64> = numbers.iter().map(|&at| touches[at].point.coords).sum();
    let sigmas = |at: usize| off[at] / touches[at].sigma.hypot(touches[at].calibration).max(1e-9);
    let worst = numbers.iter().copied().max_by(|a, b| off[*a].abs().total_cmp(&off[*b].abs())).unwrap_or(numbers[0]);
    let is_other = |at: &usize| touches[*at].stamp_ns.abs_diff(touches[worst].stamp_ns) > PAUSE_NS.unsigned_abs();
    BadTouches {
        touches: numbers.iter().map(|&at| at as u32).collect(),
        centre: (sum / numbers.len() as f64).into(),
        off: off[worst],
        sigmas: sigmas(worst).abs(),
        held_apart: numbers.iter().filter(|&&at| touches[at].is_held_apart).count(),
        against: good.near(&touches[worst].point, reach).filter(is_other).count(),
    }
}

/// How far the surface that each touch says is from the refined one, m: of a ball by its centre, which the felt normal
/// does not move.
fn distances(refined: &RefinedShape<'_>, touches: &[ProbedPoint]) -> Result<Vec<f64>, CompareError> {
    let mut off = vec![0.0; touches.len()];
    let mesh = refined.shape.mesh;
    let centres: Vec<Point3<f64>> = touches.iter().map(|touch| touch.centre).collect();
    closest_places(&centres, mesh, refined.shape.tree, |at, hit| {
        off[at] = super::signed(&centres[at], mesh, hit) - touches[at].radius;
    })?;
    Ok(off)
}

fn reach(touches: &[ProbedPoint]) -> f64 {
    let radius = touches.iter().map(|touch| touch.radius).fold(0.0, f64::max);
    if radius > 0.0 { radius } else { NEAR }
}

/// Marks the places that most touches near them say wrongly.
pub(super) fn mark(refined: &RefinedShape<'_>, touches: &[ProbedPoint], bad: &[BadTouches], classes: &mut [Class]) {
    let mesh = refined.shape.mesh;
    let points: Vec<Point3<f64>> = touches.iter().map(|touch| touch.point).collect();
    let reach = reach(touches);
    let all = Cells::new(&points, 0..points.len(), reach);
    let mut is_bad = vec![false; touches.len()];
    bad.iter().flat_map(|bad| &bad.touches).for_each(|&at| is_bad[at as usize] = true);
    let near_bad = Cells::new(&points, (0..points.len()).filter(|&at| is_bad[at]), reach);
    for (at, class) in classes.iter_mut().enumerate() {
        let p = mesh.positions()[at];
        let is_felt = !matches!(class, Class::NeverTouched | Class::Unreachable);
        if is_felt && near_bad.near(&p, reach).next().is_some() {
            let (mut count, mut wrong) = (0, 0);
            all.near(&p, reach / 2.0).for_each(|touch| {
                count += 1;
                wrong += usize::from(is_bad[touch]);
            });
            if wrong > 0 && f64::from(wrong as u32) >= SHARE * f64::from(count) {
                *class = Class::BadTouch;
            }
        }
    }
}
