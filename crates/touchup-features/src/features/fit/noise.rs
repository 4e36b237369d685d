//! Errors of touches that do not repeat, from repeated visits to one place.
//!
//! Two visits to one place differ by their errors alone. Half the mean square difference of visits
//! a time t apart is the variogram \[Matheron 1963\],
//!
//! γ(t) = q² + w² (1 − exp(−t/T)),
//!
//! of white noise q and an Ornstein-Uhlenbeck wander w of the ball along each axis. Residuals of a
//! fit of few passes hide the wander, as the surface follows it; differences of visits do not, and
//! all surfaces of a session share one variogram. Errors that repeat at a place, as those of the
//! calibration, are not in it.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector2};

use touchup_geometry::numeric::{
    NormalEquations, SIGMA_OF_MEDIAN, VoxelKey, mean, median, voxel_of,
};

/// Number of classes of the time between visits, each twice as long as the one before: the last one
/// begins at 2¹¹ groups, 200 s, beyond each wander that is not a drift.
const CLASSES: usize = 12;
/// Minimum number of pairs of visits in a used class: their median is within a third.
const LEAST_PAIRS: usize = 10;
/// Number of pairs from which on a class weighs no more: those of one time share their wander.
const MOST_PAIRS: f64 = 300.0;
/// Minimum number of classes for the three unknowns.
const LEAST_CLASSES: usize = 4;
/// Number of correlation times to try, from one group to the longest time between visits: a step
/// of a third at most if that is below 12 min.
const MEMORIES: u32 = 32;
/// Number of solutions with weights of the one before: the weights have settled within a few
/// percent.
const REWEIGHTINGS: usize = 4;

/// Errors of touches that do not repeat; all 0 if unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TouchNoise {
    /// Standard deviation of the mean error of a group along the normal, independent from group to
    /// group, m.
    pub white: f64,
    /// Standard deviation of the wander of the centre of the ball, along each axis, m.
    pub wander: f64,
    /// Correlation time of the wander, in differences of group numbers.
    pub memory: f64,
}

/// The touches of one group on one surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    pub group: u32,
    /// mean place, m
    pub point: Point3<f64>,
    /// mean distance from the surface less the offset, m
    pub residual: f64,
}

/// One class of pairs of visits.
#[derive(Clone, Debug, Default)]
struct LagClass {
    /// sum of the times between visits, in groups
    time: f64,
    /// absolute differences of residuals, m
    differences: Vec<f64>,
}

/// Mean time between the visits of a class, in groups, half the mean square difference, m², and the
/// number of pairs.
type VariogramPoint = [f64; 3];

impl TouchNoise {
    /// From the visits to some surfaces, in order of their groups; unknown if few places were
    /// visited again.
    ///
    /// - `size`: of a place, m.
    pub(crate) fn of(surfaces: impl IntoIterator<Item = Vec<Visit>>, size: f64) -> Self {
        let mut classes = vec![LagClass::default(); CLASSES];
        for visits in surfaces {
            let mut places: BTreeMap<VoxelKey, Vec<Visit>> = BTreeMap::new();
            for visit in visits {
                let place = places.entry(voxel_of(&visit.point, size)).or_default();
                add_pairs(&mut classes, place, &visit);
                place.push(visit);
            }
        }
        let variogram: Vec<VariogramPoint> =
            classes.into_iter().filter_map(LagClass::point).collect();
        Self::of_variogram(&variogram)
    }

    fn of_variogram(variogram: &[VariogramPoint]) -> Self {
        if variogram.len() < LEAST_CLASSES {
            return Self::default();
        }
        let longest = variogram.iter().map(|[time, ..]| *time).fold(1.0, f64::max);
        let memory = |i: u32| longest.powf(f64::from(i) / f64::from(MEMORIES - 1));
        let fits = (0..MEMORIES).map(|i| Self::of_memory(variogram, memory(i)));
        fits.min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or_else(Self::default, |(_, noise)| noise)
    }

    /// The noise of least squares for a correlation time, and its sum of squares. A half mean
    /// square has a relative error, so the weights are those of the model \[Cressie 1985\].
    fn of_memory(variogram: &[VariogramPoint], memory: f64) -> (f64, Self) {
        let row = |time: f64| Vector2::new(1.0, 1.0 - (-time / memory).exp());
        let mut variances = Vector2::zeros();
        for round in 0..REWEIGHTINGS {
            let rows = variogram.iter().map(|&[time, half_square, pairs]| {
                let model = if round == 0 {
                    half_square
                } else {
                    row(time).dot(&variances)
                };
                let weight = pairs.min(MOST_PAIRS).sqrt() / model;
                (row(time) * weight, half_square * weight)
            });
            variances = not_negative(&NormalEquations::of(rows));
        }
        let square = |&[time, half_square, pairs]: &VariogramPoint| {
            pairs.min(MOST_PAIRS) * (half_square / row(time).dot(&variances)).ln().powi(2)
        };
        let [white, wander] = [variances.x, variances.y].map(f64::sqrt);
        let noise = Self {
            white,
            wander,
            memory,
        };
        (variogram.iter().map(square).sum(), noise)
    }
}

/// The solution with no entry below 0, not both 0 for values above 0.
fn not_negative(equations: &NormalEquations<2>) -> Vector2<f64> {
    let alone = |i: usize| {
        let mut only = Vector2::zeros();
        only[i] = equations.right[i] / equations.information[(i, i)];
        only
    };
    match equations.solution() {
        Some(both) if both.x >= 0.0 && both.y >= 0.0 => both,
        Some(both) if both.x >= 0.0 => alone(0),
        _ => alone(1),
    }
}

impl Visit {
    /// The mean of visits of one group, at least one.
    pub(crate) fn joined(visits: &[Self]) -> Self {
        Self {
            group: visits[0].group,
            point: mean(visits.iter().map(|visit| visit.point.coords)).into(),
            residual: mean(visits.iter().map(|visit| visit.residual)),
        }
    }
}

/// Adds the differences of a visit from earlier ones at its place, as many steps back as the powers
/// of two: all classes are served, at a cost that grows with the logarithm of their number.
fn add_pairs(classes: &mut [LagClass], before: &[Visit], visit: &Visit) {
    let back = (0..).map(|power| 1usize << power);
    for earlier in back.map_while(|back| before.len().checked_sub(back).map(|at| &before[at])) {
        let time = visit.group.saturating_sub(earlier.group).max(1);
        let class = &mut classes[(time.ilog2() as usize).min(CLASSES - 1)];
        class.time += f64::from(time);
        class
            .differences
            .push((visit.residual - earlier.residual).abs());
    }
}

impl LagClass {
    /// Its point of the variogram; `None` if it has few pairs, or equal ones.
    fn point(mut self) -> Option<VariogramPoint> {
        let pairs = self.differences.len();
        let typical = SIGMA_OF_MEDIAN * median(&mut self.differences)?;
        (pairs >= LEAST_PAIRS && typical > 0.0).then(|| {
            [
                self.time / pairs as f64,
                typical * typical / 2.0,
                pairs as f64,
            ]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 8] = [1.0, 2.5, 6.0, 12.0, 23.0, 47.0, 95.0, 190.0];

    fn variogram(half_square: impl Fn(f64) -> f64) -> Vec<VariogramPoint> {
        TIMES.map(|time| [time, half_square(time), 50.0]).to_vec()
    }

    /// The times to try are up to a tenth off the true one, which is between two of them.
    #[test]
    fn an_exact_variogram_gives_the_noise_that_made_it() {
        let [white, wander, memory] = [9e-6, 60e-6, 18.0];
        let exact = |time: f64| white * white + wander * wander * (1.0 - (-time / memory).exp());
        let found = TouchNoise::of_variogram(&variogram(exact));
        assert!((found.white / white - 1.0).abs() < 0.2, "{found:?}");
        assert!((found.wander / wander - 1.0).abs() < 0.02, "{found:?}");
        assert!((found.memory / memory - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn equal_classes_are_white_noise_and_few_are_no_estimate() {
        let level = variogram(|_| 4e-10);
        let found = TouchNoise::of_variogram(&level);
        assert!(
            (found.white.hypot(found.wander) - 20e-6).abs() < 1e-9,
            "{found:?}"
        );
        let few = TouchNoise::of_variogram(&level[..LEAST_CLASSES - 1]);
        assert_eq!(few, TouchNoise::default());
    }

    /// Visit n to a place has the pairs with the visits 1, 2, 4, … before it.
    #[test]
    fn only_visits_to_one_place_of_one_surface_are_compared() {
        let visit = |group: u32, x: f64| Visit {
            group,
            point: Point3::new(x, 0.5, 0.5),
            residual: f64::from(group * 7 % 5) * 1e-5,
        };
        let mut classes = vec![LagClass::default(); CLASSES];
        let before = [visit(3, 0.1), visit(5, 0.2), visit(9, 0.3)];
        add_pairs(&mut classes, &before, &visit(10, 0.4));
        let counts: Vec<_> = classes
            .iter()
            .map(|class| class.differences.len())
            .collect();
        // 10 − 9 and 10 − 5 groups
        assert_eq!(counts[..4], [1, 0, 1, 0]);
        let apart = (0..40).map(|at| visit(at, f64::from(at)));
        let alone = (0..40).map(|at| vec![visit(at, 0.5)]);
        assert_eq!(
            TouchNoise::of([apart.collect()], 1.0),
            TouchNoise::default()
        );
        assert_eq!(TouchNoise::of(alone, 1.0), TouchNoise::default());
        let again = (0..40).map(|at| visit(at, 0.5));
        assert_ne!(
            TouchNoise::of([again.collect()], 1.0),
            TouchNoise::default()
        );
    }
}
