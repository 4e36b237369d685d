//! Weighted least squares over the freedoms of a surface, weights given.

use nalgebra::{SMatrix, Vector3};

use super::{FREEDOMS, FitError, FitParams, Observation, Steps, SurfaceModel};
use touchup_geometry::numeric::{
    DampedSearch, NormalEquations, SearchEnd, centroid_and_spread, distinct,
};

/// A matrix over the freedoms.
pub(super) type FreedomMatrix = SMatrix<f64, FREEDOMS, FREEDOMS>;

/// Maximum number of successful steps of one solution; a sound problem needs fewer than ten.
const MOST_STEPS: usize = 100;
/// At worst one failed step precedes each.
const SEARCH: DampedSearch = DampedSearch {
    first: 1e-4,
    factors: [0.1, 10.0],
    least: 1e-12,
    most: 1e10,
    tries: 2 * MOST_STEPS,
};
/// The search ends at a step below this number of standard deviations.
const SETTLED: f64 = 1e-6;
/// Maximum step, in sizes of the touched area and in rad: a longer one may leap into the valley in
/// which a circle fitted to a short arc grows without end.
const LONGEST_STEP: f64 = 0.3;
/// Keeps the matrix definite in undetermined directions; as a share of its largest entry.
const RIDGE: f64 = 1e-13;

/// Observations with their groups, and the unit of lengths while solving.
pub(super) struct FitProblem<'a> {
    pub observations: &'a [Observation],
    /// group of each observation, counted from 0 in the order of `group_numbers`
    pub group: Vec<usize>,
    /// ascending
    pub group_numbers: Vec<u32>,
    /// root mean square distance of the points from their centre, m: makes all unknowns of order
    /// one
    pub size: f64,
    /// prior axis, in O, and its standard deviation, rad
    pub known_axis: Option<(Vector3<f64>, f64)>,
    /// correction subtracted from the distance of each point, m
    pub shift: Vec<f64>,
}

impl<'a> FitProblem<'a> {
    pub(crate) fn new(
        observations: &'a [Observation],
        axis: Vector3<f64>,
        params: &FitParams,
    ) -> Self {
        let group_numbers = distinct(observations.iter().map(|o| o.group));
        let group = observations
            .iter()
            .map(|o| group_numbers.partition_point(|&number| number < o.group))
            .collect();
        let (_, size) = centroid_and_spread(observations.iter().map(|o| &o.point));
        Self {
            observations,
            group,
            group_numbers,
            size: if size > 0.0 { size } else { 1.0 },
            known_axis: params.axis_sigma.map(|sigma| (axis, sigma)),
            shift: vec![0.0; observations.len()],
        }
    }

    /// Size of a scaled step of 1 in each freedom: `size` for lengths, 1 rad for angles.
    pub(crate) fn units<M: SurfaceModel>(&self) -> Steps {
        let second = if M::SECOND_IS_LENGTH { self.size } else { 1.0 };
        Steps::from([
            self.size, self.size, self.size, 1.0, 1.0, 1.0, self.size, second,
        ])
    }

    /// Distance less offset and shift, m.
    pub(crate) fn residual<M: SurfaceModel>(&self, surface: &M, i: usize) -> f64 {
        surface.distance(&self.observations[i].point) - self.observations[i].offset - self.shift[i]
    }

    /// All residuals in their own standard deviations.
    pub(crate) fn normalised<M: SurfaceModel>(&self, surface: &M) -> Vec<f64> {
        (0..self.observations.len())
            .map(|i| self.residual(surface, i) / self.observations[i].sigma)
            .collect()
    }

    /// Weights of the squares, 1/m²: the `kept` share (0 to 1) of each observation, over σ² and
    /// over the sum of the shares in its group.
    pub(crate) fn weights(&self, kept: &[f64]) -> Vec<f64> {
        let mut in_group = vec![0.0; self.group_numbers.len()];
        self.group
            .iter()
            .zip(kept)
            .for_each(|(&g, k)| in_group[g] += k);
        let weight = |i: usize| {
            kept[i] / (in_group[self.group[i]].max(1.0) * self.observations[i].sigma.powi(2))
        };
        (0..kept.len()).map(weight).collect()
    }

    /// Normal equations of the residuals around a surface: a scaled step is minus their solution.
    pub(crate) fn equations<M: SurfaceModel>(
        &self,
        surface: &M,
        weights: &[f64],
    ) -> NormalEquations<FREEDOMS> {
        let units = self.units::<M>();
        let mut sum = self.prior(surface);
        let own = surface.to_own();
        for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let (distance, by) = surface.derivatives_at(&own(&self.observations[i].point));
            let residual = distance - self.observations[i].offset - self.shift[i];
            sum.add(&by.component_mul(&units), residual, w);
        }
        sum
    }

    /// Equations of the prior axis: seen from F it leans by −a, a its own x and y.
    ///
    /// Turning F by ω takes a from a to a + a × ω, ω as in [`SurfaceModel::derivatives`].
    pub(crate) fn prior<M: SurfaceModel>(&self, surface: &M) -> NormalEquations<FREEDOMS> {
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

    fn cost<M: SurfaceModel>(&self, surface: &M, weights: &[f64]) -> f64 {
        let of_points = |(i, w): (usize, &f64)| {
            if *w > 0.0 {
                w * self.residual(surface, i).powi(2)
            } else {
                0.0
            }
        };
        self.prior(surface).square + weights.iter().enumerate().map(of_points).sum::<f64>()
    }

    /// Takes steps that do not raise the cost, until one is shorter than `last` standard
    /// deviations.
    fn search<M: SurfaceModel>(
        &self,
        search: &DampedSearch,
        surface: M,
        weights: &[f64],
        last: f64,
    ) -> (M, SearchEnd) {
        let units = self.units::<M>();
        let start = self.cost(&surface, weights);
        let equations = |surface: &M| self.equations(surface, weights);
        let damped = |equations: NormalEquations<FREEDOMS>, damping: f64| {
            let ridge = RIDGE
                * equations
                    .information
                    .diagonal()
                    .max()
                    .max(f64::MIN_POSITIVE);
            let mut damped = equations.damped(damping);
            damped.information += FreedomMatrix::identity() * ridge;
            damped
        };
        let better = |surface: &M, step: &Steps, before: f64| {
            let next = surface.moved(&-step.component_mul(&units));
            let cost = (step.norm() <= LONGEST_STEP && next.check().is_ok())
                .then(|| self.cost(&next, weights));
            cost.filter(|cost| *cost <= before).map(|cost| (next, cost))
        };
        // in standard deviations, squared
        let is_last = |step: &Steps, equations: &NormalEquations<FREEDOMS>| {
            step.dot(&equations.right) < last * last
        };
        let (surface, _, end) = search.run((surface, start), equations, damped, better, is_last);
        (surface, end)
    }

    /// Takes one step that does not raise the cost, if any.
    pub(crate) fn step<M: SurfaceModel>(&self, surface: M, weights: &[f64]) -> M {
        self.search(
            &DampedSearch {
                first: 1e-6,
                ..SEARCH
            },
            surface,
            weights,
            f64::INFINITY,
        )
        .0
    }

    /// The surface of least cost.
    ///
    /// # Errors
    /// [`FitError::NotConverged`].
    pub(crate) fn solve<M: SurfaceModel>(
        &self,
        surface: M,
        weights: &[f64],
    ) -> Result<M, FitError> {
        match self.search(&SEARCH, surface, weights, SETTLED) {
            (_, SearchEnd::Unsettled) => Err(FitError::NotConverged {
                iterations: MOST_STEPS,
            }),
            (surface, _) => Ok(surface),
        }
    }

    /// The same surface with its frame amid the kept observations, at least one.
    pub(crate) fn described<M: SurfaceModel>(&self, surface: &M, kept: &[f64]) -> M {
        let is_kept = self
            .observations
            .iter()
            .zip(kept)
            .filter(|(_, k)| **k > 0.0);
        let local = |o: &Observation| surface.pose_of().inverse_transform_point(&o.point).coords;
        surface.described_from(&is_kept.map(|(o, _)| local(o)).collect::<Vec<_>>())
    }
}
