//! The normal equations of a session, with the freedoms of each surface eliminated.

use std::collections::BTreeMap;

use nalgebra::{SMatrix, SVector, Vector3};

use super::pressed_surface::{PressedSurface, pressed_surfaces};
use super::recorded_press::{RecordedPress, SessionNumbers};
use crate::features::fit::{FREEDOMS, Steps};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, cauchy_weight, median};

/// Number of unknowns of a session: compliance and offset.
const NUMBERS: usize = 4;
/// Number of rounds of surfaces found in the presses, as the session is known until then.
const ROUNDS: usize = 2;
/// Number of steps of Gauss and Newton.
const STEPS: usize = 12;
/// Misfit of half weight, in the usual one: Cauchy's for 95 % efficiency.
const HALF_WEIGHT: f64 = 2.385;
/// Minimum number of groups of strokes whose scatter shows an uncertainty: twice the unknowns.
const FEWEST_GROUPS: usize = 2 * NUMBERS;
/// Smallest usual misfit, m.
const LEAST_MISFIT: f64 = 1e-6;
/// Standard deviation of a step of a surface before its presses, m and rad: freedoms that they do
/// not show stay.
const LOOSE: f64 = 0.1;

type Numbers = SVector<f64, NUMBERS>;
type NumberMatrix = SMatrix<f64, NUMBERS, NUMBERS>;
type SurfaceMatrix = SMatrix<f64, FREEDOMS, FREEDOMS>;
type CrossMatrix = SMatrix<f64, FREEDOMS, NUMBERS>;

impl SessionNumbers {
    fn as_vector(&self) -> Numbers {
        let o = &self.offset_t;
        Numbers::new(self.compliance, o.x, o.y, o.z)
    }

    fn from_vector(x: &Numbers) -> Self {
        Self {
            compliance: x[0],
            offset_t: Vector3::new(x[1], x[2], x[3]),
        }
    }
}

/// Numbers of a session as its presses show them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SessionAdjustment {
    pub found: SessionNumbers,
    /// standard uncertainties: the posterior's
    pub sigma: SessionNumbers,
    /// number of presses on surfaces
    pub presses: usize,
    /// number of surfaces
    pub surfaces: usize,
}

impl SessionAdjustment {
    /// Adjusts a session; `None` without surfaces in its presses.
    ///
    /// - `radius`: of the ball, m. `told`: numbers at the start. `prior`: their standard
    ///   uncertainties before the presses.
    pub(crate) fn of(
        presses: &[RecordedPress],
        radius: f64,
        told: SessionNumbers,
        prior: SessionNumbers,
    ) -> Option<Self> {
        let mut found = None;
        let mut numbers = told;
        for _ in 0..ROUNDS {
            let surfaces = pressed_surfaces(presses, radius, &numbers);
            let adjusted = SessionProblem {
                presses,
                radius,
                told,
                prior,
            }
            .adjusted(surfaces, numbers)?;
            numbers = adjusted.found;
            found = Some(adjusted);
        }
        found
    }
}

/// An observation: a press on a surface.
struct PressRow {
    /// d(p + R o + κ F) − r, m
    misfit: f64,
    by_surface: Steps,
    by_numbers: Numbers,
    stroke: u32,
}

/// Sums over the presses of one surface.
struct SurfaceSums {
    information: SurfaceMatrix,
    cross: CrossMatrix,
    right: Steps,
}

/// A session with its presses and priors.
pub(super) struct SessionProblem<'a> {
    pub presses: &'a [RecordedPress],
    /// of the ball, m
    pub radius: f64,
    pub told: SessionNumbers,
    /// standard uncertainties of these
    pub prior: SessionNumbers,
}

impl SessionProblem<'_> {
    /// Observation of a press.
    fn row(
        &self,
        surface: &PressedSurface,
        press: &RecordedPress,
        numbers: &SessionNumbers,
    ) -> PressRow {
        let (distance, normal, by_surface) = surface.at(&press.placed(numbers));
        let by_offset = press.rotation.inverse_transform_vector(&normal);
        PressRow {
            misfit: distance - self.radius,
            by_surface,
            by_numbers: Numbers::new(
                press.force.dot(&normal),
                by_offset.x,
                by_offset.y,
                by_offset.z,
            ),
            stroke: press.stroke,
        }
    }

    fn rows(&self, surface: &PressedSurface, numbers: &SessionNumbers) -> Vec<PressRow> {
        let presses = surface.presses.iter();
        presses
            .map(|&at| self.row(surface, &self.presses[at as usize], numbers))
            .collect()
    }

    /// The numbers and surfaces of least squares; `None` without any surface, or if rounding leaves
    /// no solution.
    pub(super) fn adjusted(
        &self,
        mut surfaces: Vec<PressedSurface>,
        mut numbers: SessionNumbers,
    ) -> Option<SessionAdjustment> {
        let presses = surfaces.iter().map(|surface| surface.presses.len()).sum();
        let count = surfaces.len();
        for _ in 0..STEPS {
            let step = Equations::of(self, &surfaces, &numbers)?;
            let change = step.reduced.cholesky()?.solve(&step.right);
            numbers = SessionNumbers::from_vector(&(numbers.as_vector() + change));
            for (surface, sums) in surfaces.iter_mut().zip(&step.sums) {
                surface.move_by(&sums.step(&change)?);
            }
        }
        let last = Equations::of(self, &surfaces, &numbers)?;
        let variances = last.variances()?;
        Some(SessionAdjustment {
            found: numbers,
            sigma: SessionNumbers::from_vector(&variances.map(f64::sqrt)),
            presses,
            surfaces: count,
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
    fn step(&self, change: &Numbers) -> Option<Steps> {
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
struct Equations {
    sums: Vec<SurfaceSums>,
    /// information of the numbers after elimination: Schur complement
    reduced: NumberMatrix,
    right: Numbers,
    /// scores of strokes, in their order
    scores: Vec<Numbers>,
}

impl Equations {
    fn of(
        problem: &SessionProblem,
        surfaces: &[PressedSurface],
        numbers: &SessionNumbers,
    ) -> Option<Self> {
        let rows: Vec<Vec<PressRow>> = surfaces
            .iter()
            .map(|surface| problem.rows(surface, numbers))
            .collect();
        let mut sizes: Vec<f64> = rows.iter().flatten().map(|row| row.misfit.abs()).collect();
        let scale = (SIGMA_OF_MEDIAN * median(&mut sizes)?).max(LEAST_MISFIT);
        let prior = problem.prior.as_vector().map(|sigma| 1.0 / (sigma * sigma));
        let off = problem.told.as_vector() - numbers.as_vector();
        let mut reduced = NumberMatrix::from_diagonal(&prior);
        let mut right: Numbers = prior.component_mul(&off);
        let mut scores: BTreeMap<u32, Numbers> = BTreeMap::new();
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
        })
    }

    /// Variances of the numbers: of independent presses, or of independent groups of strokes,
    /// whichever is largest (batch means: errors that wander slowly are the same in neighbours).
    fn variances(&self) -> Option<Numbers> {
        let inverse = self.reduced.cholesky()?.inverse();
        let lengths = (0..).map(|power| 1 << power);
        let lengths = lengths.take_while(|length| self.scores.len() >= FEWEST_GROUPS * length);
        let of_groups = lengths.map(|length: usize| {
            let groups = self.scores.chunks(length);
            let spare = groups.len() as f64 / (groups.len() - NUMBERS) as f64;
            let scores = groups.map(|group| inverse * group.iter().sum::<Numbers>());
            scores
                .map(|score| score.component_mul(&score))
                .sum::<Numbers>()
                * spare
        });
        Some(of_groups.fold(inverse.diagonal(), |most, of| most.sup(&of)))
    }
}
