//! Weighted least squares by Levenberg's and Marquardt's method, weights given.

use nalgebra::{SMatrix, Vector3};

use super::{FREEDOMS, FitError, FitParams, Observation, Steps, Surface};
use crate::numeric::{NormalEquations, centroid_and_spread};

/// A matrix over the freedoms.
pub(super) type FreedomMatrix = SMatrix<f64, FREEDOMS, FREEDOMS>;

/// Steps of one solution; a sound problem needs fewer than ten.
const MOST_STEPS: usize = 100;
/// A step below this many standard deviations is the last.
const SETTLED: f64 = 1e-6;
/// First damping, as a share of the diagonal; it falls or grows tenfold.
const DAMPING: f64 = 1e-4;
/// Longest step, in sizes of what was touched and in rad: a longer one may leap into the valley in which a circle fitted to
/// a short arc grows without end.
const LONGEST_STEP: f64 = 0.3;
/// Tenfold increases of the damping before the solver gives up.
const MOST_RAISES: usize = 14;
/// Keeps the matrix definite in directions that nothing fixes; as a share of its largest entry.
const RIDGE: f64 = 1e-13;

/// Observations with their groups, and the unit in which lengths are counted while solving.
pub(super) struct FitProblem<'a> {
    pub observations: &'a [Observation],
    /// group of each observation, counted from 0
    pub group: Vec<usize>,
    pub groups: usize,
    /// root mean square distance of the points from their centre, m: makes all unknowns of order one
    pub size: f64,
    /// axis known before, in O, and its standard deviation, rad
    pub known_axis: Option<(Vector3<f64>, f64)>,
    /// what is taken off the distance of each point, m
    pub shift: Vec<f64>,
}

impl<'a> FitProblem<'a> {
    pub fn new(observations: &'a [Observation], axis: Vector3<f64>, params: &FitParams) -> Self {
        let mut names: Vec<u32> = observations.iter().map(|o| o.group).collect();
        names.sort_unstable();
        names.dedup();
        let group = observations.iter().map(|o| names.partition_point(|&name| name < o.group)).collect();
        let (_, size) = centroid_and_spread(observations.iter().map(|o| &o.point));
        Self {
            observations,
            group,
            groups: names.len(),
            size: if size > 0.0 { size } else { 1.0 },
            known_axis: params.axis_sigma.map(|sigma| (axis, sigma)),
            shift: vec![0.0; observations.len()],
        }
    }

    /// What a scaled step of 1 is in each freedom: `size` for lengths, 1 rad for angles.
    pub fn units<M: Surface>(&self) -> Steps {
        let second = if M::SECOND_IS_LENGTH { self.size } else { 1.0 };
        Steps::from([self.size, self.size, self.size, 1.0, 1.0, 1.0, self.size, second])
    }

    /// Distance less offset and shift, m.
    pub fn residual<M: Surface>(&self, surface: &M, i: usize) -> f64 {
        surface.distance(&self.observations[i].point) - self.observations[i].offset - self.shift[i]
    }

    /// All residuals in their own standard deviations.
    pub fn normalised<M: Surface>(&self, surface: &M) -> Vec<f64> {
        (0..self.observations.len()).map(|i| self.residual(surface, i) / self.observations[i].sigma).collect()
    }

    /// Weights of the squares, 1/m²: what is `kept` (0 to 1) of each, over σ² and over how many are kept of its group.
    pub fn weights(&self, kept: &[f64]) -> Vec<f64> {
        let mut in_group = vec![0.0; self.groups];
        self.group.iter().zip(kept).for_each(|(&g, k)| in_group[g] += k);
        let weight = |i: usize| kept[i] / (in_group[self.group[i]].max(1.0) * self.observations[i].sigma.powi(2));
        (0..kept.len()).map(weight).collect()
    }

    /// Of the residuals around a surface, which a scaled step is to take off: the step is minus their solution.
    pub fn equations<M: Surface>(&self, surface: &M, weights: &[f64]) -> NormalEquations<FREEDOMS> {
        let units = self.units::<M>();
        let mut sum = self.prior(surface);
        for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let (distance, by) = surface.derivatives(&self.observations[i].point);
            let residual = distance - self.observations[i].offset - self.shift[i];
            sum.add(&by.component_mul(&units), residual, w);
        }
        sum
    }

    /// What the axis known before adds: seen from F it leans by −a, a its own x and y.
    ///
    /// Turning F by ω takes a from a to a + a × ω, ω as in [`Surface::derivatives`].
    pub fn prior<M: Surface>(&self, surface: &M) -> NormalEquations<FREEDOMS> {
        let mut sum = NormalEquations::default();
        if let Some((axis, sigma)) = self.known_axis {
            let known = surface.pose_of().inverse_transform_vector(&axis);
            let weight = sigma.powi(-2);
            for (lean, tilt, turn) in [(-known.x, 3, -known.y), (-known.y, 4, known.x)] {
                let mut by = Steps::zeros();
                by[tilt] = known.z;
                by[5] = if M::FREE[5] { turn } else { 0.0 };
                sum.add(&by, lean, weight);
            }
        }
        sum
    }

    fn cost<M: Surface>(&self, surface: &M, weights: &[f64]) -> f64 {
        let of_points = |(i, w): (usize, &f64)| if *w > 0.0 { w * self.residual(surface, i).powi(2) } else { 0.0 };
        self.prior(surface).square + weights.iter().enumerate().map(of_points).sum::<f64>()
    }

    /// One step that does not raise the cost, its length in standard deviations, and the damping for the next;
    /// `None` where no step lowers the cost.
    pub fn step<M: Surface>(&self, surface: &M, weights: &[f64], mut damping: f64) -> Option<(M, f64, f64)> {
        let NormalEquations { information, right, square: cost } = self.equations(surface, weights);
        let units = self.units::<M>();
        let ridge = RIDGE * information.diagonal().max().max(f64::MIN_POSITIVE);
        for _ in 0..MOST_RAISES {
            let damped =
                information + FreedomMatrix::from_diagonal(&information.diagonal().map(|x| damping * x + ridge));
            let step = -damped.cholesky()?.solve(&right);
            let next = surface.moved(&step.component_mul(&units));
            if step.norm() <= LONGEST_STEP && next.check().is_ok() && self.cost(&next, weights) <= cost {
                let length = step.dot(&(information * step)).max(0.0).sqrt();
                return Some((next, length, (damping * 0.1).max(1e-12)));
            }
            damping *= 10.0;
        }
        None
    }

    /// The surface of least cost.
    ///
    /// # Errors
    /// [`FitError::NotConverged`].
    pub fn solve<M: Surface>(&self, mut surface: M, weights: &[f64]) -> Result<M, FitError> {
        let mut damping = DAMPING;
        for _ in 0..MOST_STEPS {
            // no step lowers the cost: this is its least, to rounding
            let Some((next, length, lower)) = self.step(&surface, weights, damping) else { return Ok(surface) };
            (surface, damping) = (next, lower);
            if length < SETTLED {
                return Ok(surface);
            }
        }
        Err(FitError::NotConverged { iterations: MOST_STEPS })
    }

    /// The same surface described from amid what is kept, of which there is at least one.
    pub fn described<M: Surface>(&self, surface: &M, kept: &[f64]) -> M {
        let is_kept = self.observations.iter().zip(kept).filter(|(_, k)| **k > 0.0);
        let local = |o: &Observation| surface.pose_of().inverse_transform_point(&o.point).coords;
        surface.described_from(&is_kept.map(|(o, _)| local(o)).collect::<Vec<_>>())
    }
}
