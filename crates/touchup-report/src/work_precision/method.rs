//! Integrators of the comparison, each with its swept settings.

use std::cell::Cell;

use nalgebra::{Point3, Vector3};

use super::problem::{Problem, State};
use super::rosenbrock;
use crate::Effort;
use touchup_method::haptic::dormand_prince;
use touchup_method::haptic::{FaceDynamics, FaceState, StepRule};
use touchup_method::names;

/// A Jacobian has four columns: its cost by differences.
const JACOBIAN_COUNTS: u64 = 4;
/// The flow, and twice the flow with drift.
const FLOWS_CORRECTED: u64 = 3;

names! {
    /// An integrator.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Method {
        /// explicit Euler, fixed step
        Euler = "explicit Euler",
        /// classical Runge–Kutta of order 4, fixed step
        RungeKutta = "RK4",
        /// Dormand–Prince 5(4), adaptive: ode45's pair
        DormandPrince = "Dormand–Prince 5(4)",
        /// RODAS 4(3), adaptive: implicit, L-stable
        Rodas = "RODAS 4(3), implicit",
        /// touchup's exact position flow, then its exact rotation
        Lie = "Lie, exact flows",
        /// the exact flows with the drift caused by the rotation
        DriftCorrected = "drift-corrected",
    }
}

/// Setting that controls the accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SolverSetting {
    /// equal steps over the sample
    Steps(usize),
    /// error per step over the size of each unknown
    RelativeTolerance(f64),
}

/// Final state of an integrator, and its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverResult {
    /// at the end of the sample
    pub face: FaceState,
    /// evaluations of the right-hand side; a Jacobian counts as four, an exact flow as one
    pub evaluations: u64,
}

impl Method {
    /// Whether it is touchup's own.
    pub fn is_exact(self) -> bool {
        matches!(self, Self::Lie | Self::DriftCorrected)
    }

    /// Settings from coarse to fine.
    pub fn settings(self, effort: Effort) -> Vec<SolverSetting> {
        let doublings = |most: u32| (0..=most).map(|k| SolverSetting::Steps(1 << k)).collect();
        let tolerances = || {
            (1..=12)
                .map(|k| SolverSetting::RelativeTolerance(10f64.powi(-k)))
                .collect()
        };
        match self {
            Self::Euler => doublings(effort.choose(12, 14)),
            Self::RungeKutta => doublings(effort.choose(11, 13)),
            Self::DormandPrince | Self::Rodas => tolerances(),
            Self::Lie | Self::DriftCorrected => doublings(effort.choose(8, 10)),
        }
    }

    /// The face at the end of the sample; `None` if it gave up, or for a non-finite result.
    pub fn solve(self, problem: &Problem, setting: SolverSetting) -> Option<SolverResult> {
        let (start, end, scale) = (problem.start(), problem.dt_s, problem.scale());
        let count = Cell::new(0u64);
        let rate = |y: &State| {
            count.set(count.get() + 1);
            problem.rate(y)
        };
        let state = match (self, setting) {
            (Self::Euler, SolverSetting::Steps(steps)) => euler(start, end, steps, rate),
            (Self::RungeKutta, SolverSetting::Steps(steps)) => runge_kutta(start, end, steps, rate),
            (Self::DormandPrince, SolverSetting::RelativeTolerance(relative)) => {
                dormand_prince(start, end, scale, relative, rate).ok()?
            }
            (Self::Rodas, SolverSetting::RelativeTolerance(relative)) => {
                let jacobian = |y: &State| {
                    count.set(count.get() + JACOBIAN_COUNTS);
                    problem.jacobian(y)
                };
                rosenbrock::integrate(start, end, scale, relative, rate, jacobian)?
            }
            (Self::Lie, SolverSetting::Steps(steps)) => {
                return exact_steps(problem, StepRule::Lie, steps);
            }
            (Self::DriftCorrected, SolverSetting::Steps(steps)) => {
                return exact_steps(problem, StepRule::DriftCorrected, steps);
            }
            _ => return None,
        };
        let face = FaceState {
            b: Point3::from(state[0] * problem.normal),
            n: Vector3::new(state[1], state[2], state[3]),
        };
        let is_finite = state.iter().all(|x| x.is_finite());
        is_finite.then_some(SolverResult {
            face,
            evaluations: count.get(),
        })
    }
}

/// `steps` steps of Euler's method: order 1, one evaluation each.
fn euler(start: State, end: f64, steps: usize, mut rate: impl FnMut(&State) -> State) -> State {
    let dt = end / steps as f64;
    (0..steps).fold(start, |y, _| moved(&y, dt, &rate(&y)))
}

/// `steps` steps of the classical Runge–Kutta method: order 4, four evaluations each.
fn runge_kutta(
    start: State,
    end: f64,
    steps: usize,
    mut rate: impl FnMut(&State) -> State,
) -> State {
    let dt = end / steps as f64;
    (0..steps).fold(start, |y, _| {
        let k1 = rate(&y);
        let k2 = rate(&moved(&y, 0.5 * dt, &k1));
        let k3 = rate(&moved(&y, 0.5 * dt, &k2));
        let k4 = rate(&moved(&y, dt, &k3));
        let mean = [0, 1, 2, 3].map(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0);
        moved(&y, dt, &mean)
    })
}

fn moved(y: &State, dt: f64, rate: &State) -> State {
    [0, 1, 2, 3].map(|i| y[i] + dt * rate[i])
}

fn exact_steps(problem: &Problem, rule: StepRule, steps: usize) -> Option<SolverResult> {
    let dynamics = FaceDynamics::new(problem.params(rule)).ok()?;
    let (tip, dt) = (Point3::from(problem.arm), problem.dt_s / steps as f64);
    let (mut face, mut evaluations) = (problem.face(), 0);
    for _ in 0..steps {
        let next = dynamics
            .step_from(&problem.normal, &face, &tip, &problem.force, dt)
            .ok()?;
        // a normal that does not turn needs no correction
        evaluations += if rule == StepRule::Lie || next.n == face.n {
            1
        } else {
            FLOWS_CORRECTED
        };
        face = next;
    }
    Some(SolverResult { face, evaluations })
}
