//! Directions of the forces of sliding presses: what is wrong with the sensor.
//!
//! The part acts on a ball that slides along v̂ over a surface with the outward normal n by
//! N (n − μ v̂). Of a force F that is read rightly, therefore,
//!
//! (v̂ · F) / (n · F) + μ = 0 and (n × v̂ · F) / (n · F) = 0
//!
//! Surfaces and courses are those of the touches, so that the scan is no part of it. The faults of
//! [`ForceFault`] compete by their likelihood, each with a price for its unknowns (Schwarz 1978).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::along_time::{CHANGE_PARTS, likeliest_time, price};
use super::force_fault::{FAULT_FREEDOMS, FaultNumbers, ForceFault, MeasuredForce, without_trace};
use super::grouped_scores::GroupedScores;
use super::problem::HALF_WEIGHT;
use super::recorded_press::RecordedPress;
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, cauchy_cost, cauchy_weight, median};
use touchup_method::stylus::ChangeCourse;

/// Unknowns: those of the fault, and friction.
const UNKNOWNS: usize = FAULT_FREEDOMS + 1;
const FRICTION: usize = FAULT_FREEDOMS;
/// Number of steps of Gauss and Newton, and the usual misfit in the first, half of it in each next.
const STEPS: usize = 8;
const WIDEST: f64 = 1.0;
/// Smallest usual misfit.
const LEAST_MISFIT: f64 = 1e-6;
/// Minimum share of a force that lies along the normal, for a direction.
const LEAST_NORMAL: f64 = 0.3;
/// Maximum share of a way that lies along the normal.
const STEEP: f64 = 0.5;
/// Minimum number of strokes for each unknown.
const STROKES_PER_UNKNOWN: usize = 4;
/// Minimum mean square of the normals along each direction in T, for gains: along one that no surface
/// faces, a gain is another friction.
const LEAST_FACING: f64 = 0.02;

type ForceVector = SVector<f64, UNKNOWNS>;
type ForceMatrix = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// A press that slides over a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlidingPress {
    measured: MeasuredForce,
    stroke: u32,
    /// unit vectors in T: normal of the surface, way of the ball, and across both
    normal: Vector3<f64>,
    along: Vector3<f64>,
    across: Vector3<f64>,
}

/// What the directions of forces show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceAdjustment {
    /// the likeliest fault
    pub fault: ForceFault,
    pub found: FaultNumbers,
    /// standard uncertainties
    pub sigma: FaultNumbers,
    /// natural logarithm of the odds against none, and against the likeliest of another kind
    pub odds: [f64; 2],
    /// usual misfit of directions with it, rad
    pub scatter: f64,
    /// number of presses that slide on surfaces
    pub presses: usize,
}

/// Numbers of least squares with one fault, or none.
struct FaultFit {
    fault: Option<ForceFault>,
    found: FaultNumbers,
    sigma: FaultNumbers,
    misfits: Vec<f64>,
    scale: f64,
    alike: f64,
}

impl SlidingPress {
    /// - `normal`: of the surface, in O; `None` if the ball does not slide along it.
    pub(super) fn of(press: &RecordedPress, normal: &Vector3<f64>) -> Option<Self> {
        let way = press.course.try_normalize(0.0)?;
        let rise = way.dot(normal);
        let along = (way - normal * rise).try_normalize(0.0)?;
        let measured = MeasuredForce {
            stamp_ns: press.stamp_ns,
            rotation: press.rotation,
            force: press.rotation.inverse_transform_vector(&press.force),
        };
        let in_t = |of: &Vector3<f64>| press.rotation.inverse_transform_vector(of);
        (rise.abs() < STEEP).then(|| Self {
            measured,
            stroke: press.stroke,
            normal: in_t(normal),
            along: in_t(&along),
            across: in_t(&normal.cross(&along)),
        })
    }

    /// Misfits along and across the way, each with its derivatives.
    fn rows(
        &self,
        fault: Option<ForceFault>,
        numbers: &FaultNumbers,
        friction: f64,
    ) -> [(f64, ForceVector); 2] {
        let force = fault.map_or(self.measured.force, |of| of.undone(&self.measured, numbers));
        let by = fault.map(|of| of.derivatives(&self.measured, numbers));
        let press = force.dot(&self.normal).max(LEAST_NORMAL * force.norm());
        [(self.along, friction), (self.across, 0.0)].map(|(axis, held)| {
            let lean = axis.dot(&force) / press;
            let gradient = (axis - self.normal * lean) / press;
            let mut row = ForceVector::zeros();
            if let Some(by) = &by {
                row.fixed_rows_mut::<FAULT_FREEDOMS>(0)
                    .copy_from(&by.tr_mul(&gradient));
            }
            row[FRICTION] = if axis == self.along { 1.0 } else { 0.0 };
            (lean + held, row)
        })
    }
}

impl ForceAdjustment {
    /// Adjusts directions; `None` without enough of them, or if no fault is likelier than none.
    pub(super) fn of(presses: &[SlidingPress]) -> Option<Self> {
        let sizes = presses.iter().map(|press| press.measured.force.norm());
        let largest = sizes.fold(0.0, f64::max);
        let is_faced = is_faced_from_all_sides(presses);
        let faults = faults(presses).filter(|fault| is_faced || *fault != Some(ForceFault::Gains));
        let fits = faults.filter_map(|fault| FaultFit::of(presses, fault, largest));
        let fits: Vec<FaultFit> = fits.filter(|fit| fit.is_possible(largest)).collect();
        let scale = fits.iter().map(|fit| fit.scale).min_by(f64::total_cmp)?;
        let alike = fits.iter().map(|fit| fit.alike).fold(1.0, f64::max);
        let likelihood = |fit: &FaultFit| fit.likelihood(scale, alike);
        let likeliest = |is: &dyn Fn(&FaultFit) -> bool| {
            let some = fits.iter().filter(|fit| is(fit));
            some.max_by(|a, b| likelihood(a).total_cmp(&likelihood(b)))
        };
        let first = likeliest(&|_| true)?;
        let kind = first.fault?.is_of_zero();
        let none = likeliest(&|fit| fit.fault.is_none())?;
        let other = likeliest(&|fit| fit.fault.is_some_and(|of| of.is_of_zero() != kind));
        let odds = [Some(none), other]
            .map(|of| of.map_or(f64::INFINITY, |of| likelihood(first) - likelihood(of)));
        let timed = first.at_likeliest_time(presses, largest, &likelihood);
        let first = timed.as_ref().unwrap_or(first);
        Some(Self {
            fault: first.fault?,
            found: first.found,
            sigma: first.sigma,
            odds,
            scatter: first.scale,
            presses: presses.len(),
        })
    }
}

fn is_faced_from_all_sides(presses: &[SlidingPress]) -> bool {
    let normals = presses.iter().map(|press| press.normal);
    let squares: Matrix3<f64> = normals.map(|normal| normal * normal.transpose()).sum();
    squares.symmetric_eigenvalues().min() > LEAST_FACING * squares.trace()
}

/// None, and all that compete.
fn faults(presses: &[SlidingPress]) -> impl Iterator<Item = Option<ForceFault>> {
    let stamp = |at: usize| {
        let press = presses.get(at).or(presses.last());
        press.map_or(0, |press| press.measured.stamp_ns)
    };
    let at = |part: usize| ChangeCourse::At(stamp(part * presses.len() / CHANGE_PARTS));
    let drift = ChangeCourse::Between(stamp(0), stamp(presses.len()));
    let courses: Vec<ChangeCourse> = (1..CHANGE_PARTS).map(at).chain([drift]).collect();
    let changes = courses.into_iter().map(ForceFault::ZeroChanged);
    let steady = [
        ForceFault::Turned,
        ForceFault::Gains,
        ForceFault::Zero,
        ForceFault::Weight,
    ];
    [None]
        .into_iter()
        .chain(steady.into_iter().chain(changes).map(Some))
}

impl FaultFit {
    /// `None` with too few strokes, or if rounding leaves no solution.
    fn of(presses: &[SlidingPress], fault: Option<ForceFault>, largest: f64) -> Option<Self> {
        let mut prior = ForceVector::repeat(1.0);
        let of_fault = fault.map_or(FaultNumbers::repeat(1e-9), |fault| fault.prior(largest));
        prior
            .fixed_rows_mut::<FAULT_FREEDOMS>(0)
            .copy_from(&of_fault);
        let (mut numbers, mut friction) = (FaultNumbers::zeros(), 0.0);
        let mut width = WIDEST;
        for step in 0..=STEPS {
            let last = step == STEPS;
            width = if last { 0.0 } else { width / 2.0 };
            let mut held = ForceVector::zeros();
            held.fixed_rows_mut::<FAULT_FREEDOMS>(0).copy_from(&numbers);
            held[FRICTION] = friction;
            let equations = ForceEquations::of(presses, fault, (&numbers, friction), width)?;
            let of_prior = prior.map(|sigma| 1.0 / (sigma * sigma));
            let information = equations.information + ForceMatrix::from_diagonal(&of_prior);
            if last {
                return equations.fit(fault, numbers, information);
            }
            let right = equations.right - of_prior.component_mul(&held);
            let change = information.cholesky()?.solve(&right);
            let of_fault = change.fixed_rows::<FAULT_FREEDOMS>(0).into_owned();
            numbers = fault.map_or(numbers, |of| of.moved(&numbers, &of_fault));
            friction += change[FRICTION];
        }
        None
    }

    /// Whether a zero and a weight are smaller than the largest force, and gains reverse none.
    fn is_possible(&self, largest: f64) -> bool {
        match self.fault {
            Some(fault) if fault.is_of_zero() => [0, 3]
                .iter()
                .all(|&from| self.found.fixed_rows::<3>(from).norm() < largest),
            Some(ForceFault::Gains) => {
                let gains = Matrix3::identity() + without_trace(&self.found);
                (gains + gains.transpose()).cholesky().is_some()
            }
            Some(_) | None => true,
        }
    }

    /// Natural logarithm of the likelihood, with a price for its unknowns.
    fn likelihood(&self, scale: f64, alike: f64) -> f64 {
        let freedoms = self.fault.map_or(0, |fault| {
            let of_time = matches!(fault, ForceFault::ZeroChanged(_));
            fault.freedoms() + usize::from(of_time)
        });
        let count = self.misfits.len() as f64 / alike;
        -HALF_WEIGHT.powi(2) * cauchy_cost(&self.misfits, HALF_WEIGHT * scale) / alike
            - price(freedoms, count)
    }

    /// A changed zero at its likeliest time.
    fn at_likeliest_time(
        &self,
        presses: &[SlidingPress],
        largest: f64,
        likelihood: &dyn Fn(&Self) -> f64,
    ) -> Option<Self> {
        let Some(ForceFault::ZeroChanged(ChangeCourse::At(at))) = self.fault else {
            return None;
        };
        let from = presses.partition_point(|press| press.measured.stamp_ns < at);
        let fit = |time: usize| {
            let course = ChangeCourse::At(presses[time].measured.stamp_ns);
            Self::of(presses, Some(ForceFault::ZeroChanged(course)), largest)
        };
        likeliest_time(presses.len(), from, fit, likelihood)
    }
}

/// Linear equations of the unknowns.
struct ForceEquations {
    information: ForceMatrix,
    right: ForceVector,
    /// scores of strokes, in their order
    scores: Vec<ForceVector>,
    misfits: Vec<f64>,
    scale: f64,
}

impl ForceEquations {
    fn of(
        presses: &[SlidingPress],
        fault: Option<ForceFault>,
        (numbers, friction): (&FaultNumbers, f64),
        width: f64,
    ) -> Option<Self> {
        let rows: Vec<[(f64, ForceVector); 2]> = presses
            .iter()
            .map(|press| press.rows(fault, numbers, friction))
            .collect();
        let misfits: Vec<f64> = rows.iter().flatten().map(|(misfit, _)| *misfit).collect();
        let mut sizes: Vec<f64> = misfits.iter().map(|misfit| misfit.abs()).collect();
        let usual = (SIGMA_OF_MEDIAN * median(&mut sizes)?).max(LEAST_MISFIT);
        let scale = usual.max(width);
        let (mut information, mut right) = (ForceMatrix::zeros(), ForceVector::zeros());
        let mut scores: Vec<ForceVector> = Vec::new();
        let mut stroke = None;
        for (press, rows) in presses.iter().zip(&rows) {
            if stroke.replace(press.stroke) != Some(press.stroke) {
                scores.push(ForceVector::zeros());
            }
            for (misfit, row) in rows {
                let weight =
                    cauchy_weight((misfit / (HALF_WEIGHT * scale)).powi(2)) / (scale * scale);
                information.ger(weight, row, row, 1.0);
                right.axpy(-weight * misfit, row, 1.0);
                if let Some(score) = scores.last_mut() {
                    score.axpy(weight * misfit, row, 1.0);
                }
            }
        }
        Some(Self {
            information,
            right,
            scores,
            misfits,
            scale: usual,
        })
    }

    /// - `information`: with that of the prior.
    fn fit(
        self,
        fault: Option<ForceFault>,
        found: FaultNumbers,
        information: ForceMatrix,
    ) -> Option<FaultFit> {
        let unknowns = 1 + fault.map_or(0, ForceFault::freedoms);
        if self.scores.len() < STROKES_PER_UNKNOWN * unknowns {
            return None;
        }
        let grouped = GroupedScores {
            information,
            scores: self.scores,
        };
        let (variances, alike) = grouped.variances(unknowns)?;
        let sigma = variances.map(f64::sqrt);
        Some(FaultFit {
            fault,
            found,
            sigma: sigma.fixed_rows::<FAULT_FREEDOMS>(0).into_owned(),
            misfits: self.misfits,
            scale: self.scale,
            alike,
        })
    }
}
