//! The normal equations of a session, with the freedoms of each surface eliminated.

use std::collections::BTreeMap;

use nalgebra::SMatrix;

use super::grouped_scores::GroupedScores;
use super::numbers::{NUMBERS, NumberMatrix, NumberVector, SessionNumbers};
use super::placed_press::PlacedPress;
use super::pressed_surface::PressedSurface;
use super::recorded_press::RecordedPress;
use super::session_change::SessionChange;
use crate::features::fit::{FREEDOMS, Steps};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, cauchy_cost, cauchy_weight, median};

/// Number of steps of Gauss and Newton, and the usual misfit, m, in the first, half of it in each
/// next: presses on a surface that moved are not lost before it is found.
const STEPS: usize = 14;
const WIDEST: f64 = 8e-3;
/// Misfit of half weight, in the usual one: Cauchy's for 95 % efficiency.
pub(super) const HALF_WEIGHT: f64 = 2.385;
/// Number of unknowns without a change: compliance and offset.
const UNCHANGING: usize = 4;
/// Smallest usual misfit, m.
pub(super) const LEAST_MISFIT: f64 = 1e-6;
/// Standard deviation of a step of a surface before its presses, m and rad: freedoms that they do
/// not show stay.
const LOOSE: f64 = 0.1;

type SurfaceMatrix = SMatrix<f64, FREEDOMS, FREEDOMS>;
type CrossMatrix = SMatrix<f64, FREEDOMS, NUMBERS>;

/// An observation: a press on a surface.
struct PressRow {
    /// d(p + R o + κ F) − r, m
    misfit: f64,
    by_surface: Steps,
    by_numbers: NumberVector,
    stroke: u32,
}

/// Sums over the presses of one surface.
struct SurfaceSums {
    information: SurfaceMatrix,
    cross: CrossMatrix,
    right: Steps,
}

/// A session with its presses and priors.
#[derive(Clone, Copy)]
pub(super) struct SessionProblem<'a> {
    pub presses: &'a [RecordedPress],
    /// of the ball, m
    pub radius: f64,
    pub told: SessionNumbers,
    /// standard uncertainties of these
    pub prior: SessionNumbers,
    pub change: Option<SessionChange>,
}

/// Numbers and surfaces of least squares.
pub(super) struct SolvedSession {
    pub found: SessionNumbers,
    /// standard uncertainties
    pub sigma: SessionNumbers,
    pub surfaces: Vec<PressedSurface>,
    /// of all presses, m
    pub misfits: Vec<f64>,
    /// usual one, m
    pub scale: f64,
    /// number of presses that count as one: variance of the numbers in that of independent presses
    pub alike: f64,
}

impl SolvedSession {
    /// Cauchy's cost of all misfits.
    ///
    /// - `scale`: usual one, m.
    pub(super) fn cost(&self, scale: f64) -> f64 {
        HALF_WEIGHT.powi(2) * cauchy_cost(&self.misfits, HALF_WEIGHT * scale)
    }
}

impl SessionProblem<'_> {
    /// One of the presses where it was with these numbers.
    pub(super) fn placed(&self, at: u32, numbers: &SessionNumbers) -> PlacedPress {
        self.presses[at as usize].placed(numbers, self.change.as_ref())
    }

    /// Observation of a press.
    fn row(
        &self,
        surface: &PressedSurface,
        press: &RecordedPress,
        numbers: &SessionNumbers,
    ) -> PressRow {
        let placed = press.placed(numbers, self.change.as_ref());
        let (distance, normal, by_surface) = surface.at(&placed.centre);
        let by_numbers = press.by_numbers(&placed, &normal, numbers, self.change.as_ref());
        PressRow {
            misfit: distance - self.radius,
            by_surface,
            by_numbers: by_numbers.as_vector(),
            stroke: press.stroke,
        }
    }

    fn rows(&self, surface: &PressedSurface, numbers: &SessionNumbers) -> Vec<PressRow> {
        let presses = surface.presses.iter();
        presses
            .map(|&at| self.row(surface, &self.presses[at as usize], numbers))
            .collect()
    }

    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        let of_change = self.change.map_or(0, |change| change.cause.freedoms());
        UNCHANGING + of_change
    }

    /// The numbers and surfaces of least squares; `None` without any surface, or if rounding leaves
    /// no solution.
    pub(super) fn solved(
        &self,
        mut surfaces: Vec<PressedSurface>,
        mut numbers: SessionNumbers,
    ) -> Option<SolvedSession> {
        let mut width = WIDEST;
        for _ in 0..STEPS {
            width /= 2.0;
            let step = SessionEquations::of(self, &surfaces, &numbers, width)?;
            let change = step.reduced.cholesky()?.solve(&step.right);
            numbers = SessionNumbers::from_vector(&(numbers.as_vector() + change));
            for (surface, sums) in surfaces.iter_mut().zip(&step.sums) {
                surface.move_by(&sums.step(&change)?);
            }
        }
        let last = SessionEquations::of(self, &surfaces, &numbers, 0.0)?;
        let grouped = GroupedScores {
            information: last.reduced,
            scores: last.scores,
        };
        let (variances, alike) = grouped.variances(self.unknowns())?;
        Some(SolvedSession {
            found: numbers,
            sigma: SessionNumbers::from_vector(&variances.map(f64::sqrt)),
            surfaces,
            misfits: last.misfits,
            scale: last.scale,
            alike,
        })
    }
}

impl SurfaceSums {
    fn of(rows: &[PressRow], scale: f64) -> Self {
        let mut sums = Self {
            information: SurfaceMatrix::identity() / (LOOSE * LOOSE),
            cross: CrossMatrix::zeros(),
            right: Steps::zeros(),
        };
        for row in rows {
            let weight = row.weight(scale);
            sums.information
                .ger(weight, &row.by_surface, &row.by_surface, 1.0);
            sums.cross
                .ger(weight, &row.by_surface, &row.by_numbers, 1.0);
            sums.right.axpy(-weight * row.misfit, &row.by_surface, 1.0);
        }
        sums
    }

    /// Step of the surface with one of the numbers.
    fn step(&self, change: &NumberVector) -> Option<Steps> {
        Some(
            self.information
                .cholesky()?
                .solve(&(self.right - self.cross * change)),
        )
    }
}

impl PressRow {
    fn weight(&self, scale: f64) -> f64 {
        cauchy_weight((self.misfit / (HALF_WEIGHT * scale)).powi(2)) / (scale * scale)
    }
}

/// Linear equations of the numbers, with the surfaces eliminated.
struct SessionEquations {
    sums: Vec<SurfaceSums>,
    /// information of the numbers after elimination: Schur complement
    reduced: NumberMatrix,
    right: NumberVector,
    /// scores of strokes, in their order
    scores: Vec<NumberVector>,
    /// of all presses, m, and the usual one
    misfits: Vec<f64>,
    scale: f64,
}

impl SessionEquations {
    fn of(
        problem: &SessionProblem,
        surfaces: &[PressedSurface],
        numbers: &SessionNumbers,
        width: f64,
    ) -> Option<Self> {
        let rows: Vec<Vec<PressRow>> = surfaces
            .iter()
            .map(|surface| problem.rows(surface, numbers))
            .collect();
        let misfits: Vec<f64> = rows.iter().flatten().map(|row| row.misfit).collect();
        let mut sizes: Vec<f64> = misfits.iter().map(|misfit| misfit.abs()).collect();
        let usual = (SIGMA_OF_MEDIAN * median(&mut sizes)?).max(LEAST_MISFIT);
        let scale = usual.max(width);
        let prior = problem.prior.as_vector().map(|sigma| 1.0 / (sigma * sigma));
        let off = problem.told.as_vector() - numbers.as_vector();
        let mut reduced = NumberMatrix::from_diagonal(&prior);
        let mut right: NumberVector = prior.component_mul(&off);
        let mut scores: BTreeMap<u32, NumberVector> = BTreeMap::new();
        let mut sums = Vec::new();
        for rows in &rows {
            let of = SurfaceSums::of(rows, scale);
            let explained = of.information.cholesky()?.solve(&of.cross);
            for row in rows {
                let weight = row.weight(scale);
                reduced.ger(weight, &row.by_numbers, &row.by_numbers, 1.0);
                right.axpy(-weight * row.misfit, &row.by_numbers, 1.0);
                let own = row.by_numbers - explained.tr_mul(&row.by_surface);
                *scores.entry(row.stroke).or_default() += own * (weight * row.misfit);
            }
            reduced -= of.cross.tr_mul(&explained);
            right -= explained.tr_mul(&of.right);
            sums.push(of);
        }
        Some(Self {
            sums,
            reduced,
            right,
            scores: scores.into_values().collect(),
            misfits,
            scale: usual,
        })
    }
}
