//! Coupled equations of one held sample with a bound on the error, however stiff.
//!
//! The turned angle follows from the impulse alone, tan(θ/2) = tan(θ₀/2) e^(−β|F|J), which leaves
//! two unknowns: the travel s along a and the impulse J of the expected force,
//!
//! ```text
//! ds/dt = α (F·n(J) − f(h))      dJ/dt = f(h)      h = (p − b₀ − s a)·n(J)
//! ```
//!
//! Radau IIA of order 5 (L-stable, stiffly accurate) \[Hairer Wanner 1996, IV.5\] integrates them;
//! Newton's method solves its stages with the exact Jacobian. A comparison of each step with its
//! two halves, which go on, shortens it until both agree.
//!
//! If the face turns beyond a right angle from a, h leaves its rest point as fast as it approached
//! it before, and roundings start that: the solver follows them through the path, and refuses a
//! result that they decide.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};

use super::error::DynamicsError;

/// Agreement of a step and its halves, as a share of the size of each unknown: the halves are 31
/// times nearer, and a few hundred steps together stay below [`super::RELATIVE_ERROR`].
const AGREEMENT: f64 = 1e-11;
/// Stop of Newton's method, as a share of the required agreement.
const NEWTON: f64 = 1e-2;
const MOST_ITERATIONS: usize = 14;
/// Maximum number of steps, accepted or not.
const MOST_STEPS: usize = 100_000;
/// First step, as a share of the shortest time constant.
const FIRST: f64 = 0.1;
/// Longest step, in time constants of a growing solution: an implicit method would damp it.
const LONGEST_GROWTH: f64 = 1.0;
/// A step may shrink to a tenth and grow eightfold.
const CHANGE: (f64, f64) = (0.1, 8.0);
/// Aim below the required agreement, so that most steps pass.
const SAFETY: f64 = 0.85;

/// Travel, m, and impulse in the same unit (times α), at one instant.
pub(super) type CoupledState = Vector2<f64>;

/// Rate of change of both unknowns per second, and its derivative by both.
pub(super) struct Slope {
    pub rate: CoupledState,
    pub jacobian: Matrix2<f64>,
}

/// Relevant size of each unknown, m.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// size below which the roundings of the input decide
    pub rounding: f64,
    /// impulse that turns the face by one
    pub turning: f64,
    /// travel that changes the expected force by a good part
    pub contact: f64,
}

/// Integrates from zero over `end` (s).
///
/// # Errors
/// [`DynamicsError::Stiff`] if [`MOST_STEPS`] do not suffice, [`DynamicsError::NotFinite`] if the
/// solution is not, [`DynamicsError::Undetermined`] if roundings grow beyond `relative` of the
/// travel.
pub(super) fn integrate(
    end: f64,
    sizes: Sizes,
    relative: f64,
    slope: impl Fn(&CoupledState) -> Slope,
) -> Result<CoupledState, DynamicsError> {
    let (mut y, mut time, mut farthest) = (CoupledState::zeros(), 0.0, 0.0_f64);
    // accumulated roundings of this step and the steps before
    let mut noise = CoupledState::zeros();
    let mut step = end.min(first_step(&slope(&y), sizes));
    for _ in 0..MOST_STEPS {
        if time >= end {
            let allowed = CoupledState::new(
                (relative * farthest).max(sizes.rounding),
                relative * sizes.turning,
            );
            let share = noise.component_div(&allowed).amax();
            return if share <= 1.0 {
                Ok(y)
            } else {
                Err(DynamicsError::Undetermined { share })
            };
        }
        let is_last = step >= end - time;
        let dt = if is_last { end - time } else { step };
        let size = |next: &CoupledState| {
            CoupledState::new(
                farthest.max(next.x.abs()).max(sizes.rounding / AGREEMENT),
                sizes
                    .turning
                    .max(next.y.abs())
                    .max(sizes.rounding / AGREEMENT),
            )
        };
        let change = match two_halves(&y, dt, size, &slope) {
            Some((next, error)) if error <= 1.0 => {
                let grown = [&y, &next].map(|y| propagator(&slope(y).jacobian, dt).abs() * noise);
                noise = grown[0].sup(&grown[1])
                    + f64::EPSILON
                        * CoupledState::new(
                            farthest.max(next.x.abs()),
                            sizes.turning.max(next.y.abs()),
                        );
                y = next;
                farthest = farthest.max(y.x.abs());
                time = if is_last { end } else { time + dt };
                SAFETY * error.powf(-1.0 / 6.0)
            }
            Some((_, error)) if error.is_finite() => SAFETY * error.powf(-1.0 / 6.0),
            _ => CHANGE.0,
        };
        step = dt * change.clamp(CHANGE.0, CHANGE.1);
        if time + step == time && time < end {
            return Err(DynamicsError::NotFinite {
                what: "the path of the face within the step",
            });
        }
    }
    Err(DynamicsError::Stiff {
        rule: "bounded",
        steps: MOST_STEPS,
        reached_s: time,
        dt_s: end,
    })
}

/// Length of the first step, s: it changes little, and the next ones grow from there.
fn first_step(Slope { rate, jacobian }: &Slope, sizes: Sizes) -> f64 {
    let fastest = jacobian
        .amax()
        .max(rate.y.abs() / sizes.turning)
        .max(rate.amax() / sizes.contact);
    FIRST / fastest.max(f64::MIN_POSITIVE)
}

/// The state after both halves of a step, and its difference from the whole step, in units of the
/// required agreement.
fn two_halves(
    y: &CoupledState,
    dt: f64,
    size: impl Fn(&CoupledState) -> CoupledState,
    slope: &impl Fn(&CoupledState) -> Slope,
) -> Option<(CoupledState, f64)> {
    let whole = radau(y, dt, &size, slope)?;
    let middle = radau(y, 0.5 * dt, &size, slope)?;
    let halves = radau(&middle, 0.5 * dt, &size, slope)?;
    let error = (whole - halves).component_div(&size(&halves)).amax() / AGREEMENT;
    Some((halves, error))
}

/// Half of the trace, and the squared half distance of both eigenvalues, negative for complex ones.
fn eigenvalues(jacobian: &Matrix2<f64>) -> (f64, f64) {
    let [[a, c], [b, d]] = jacobian.data.0;
    let across = 0.5 * (a - d);
    (0.5 * (a + d), across * across + b * c)
}

/// The larger real part of both eigenvalues, 1/s.
fn fastest_growth(jacobian: &Matrix2<f64>) -> f64 {
    let (half, squared) = eigenvalues(jacobian);
    half + squared.max(0.0).sqrt()
}

/// e^(A t): growth of a small difference in a step.
fn propagator(jacobian: &Matrix2<f64>, dt: f64) -> Matrix2<f64> {
    let (half, squared) = eigenvalues(jacobian);
    let distance = squared.abs().sqrt();
    // even and odd part, each with e^(half t) inside, which alone may overflow
    let (even, odd) = if distance * dt < 1e-4 {
        ((half * dt).exp(), (half * dt).exp() * dt)
    } else if squared > 0.0 {
        let [fast, slow] = [half + distance, half - distance].map(|rate| (rate * dt).exp());
        (0.5 * (fast + slow), 0.5 * (fast - slow) / distance)
    } else {
        let size = (half * dt).exp();
        (
            size * (distance * dt).cos(),
            size * (distance * dt).sin() / distance,
        )
    };
    Matrix2::identity() * even + (jacobian - Matrix2::identity() * half) * odd
}

/// One step; `None` if Newton's method does not converge.
fn radau(
    y: &CoupledState,
    dt: f64,
    size: impl Fn(&CoupledState) -> CoupledState,
    slope: &impl Fn(&CoupledState) -> Slope,
) -> Option<CoupledState> {
    let weights = coefficients() * dt;
    let mut z = SVector::<f64, 6>::zeros();
    let mut last = f64::INFINITY;
    for _ in 0..MOST_ITERATIONS {
        let mut growth = 0.0_f64;
        let mut residual = -z;
        let mut matrix = SMatrix::<f64, 6, 6>::identity();
        for j in 0..3 {
            let Slope { rate, jacobian } = slope(&(y + z.fixed_rows::<2>(2 * j)));
            growth = growth.max(fastest_growth(&jacobian));
            for i in 0..3 {
                let mut part = residual.fixed_rows_mut::<2>(2 * i);
                part += weights[(i, j)] * rate;
                let mut block = matrix.fixed_view_mut::<2, 2>(2 * i, 2 * j);
                block -= weights[(i, j)] * jacobian;
            }
        }
        let change = matrix.lu().solve(&residual)?;
        z += change;
        let end = y + z.fixed_rows::<2>(4);
        let sizes = size(&end);
        let left = (0..3)
            .map(|i| change.fixed_rows::<2>(2 * i).component_div(&sizes).amax())
            .fold(0.0, f64::max);
        // or no nearer than roundings allow
        if left <= NEWTON * AGREEMENT || left <= AGREEMENT && left > 0.5 * last {
            return (growth * dt <= LONGEST_GROWTH).then_some(end);
        }
        if !left.is_finite() {
            return None;
        }
        last = left;
    }
    None
}

/// Coefficients of the three stages at (4 ∓ √6)/10 and 1 \[Hairer Wanner 1996, table IV.5.6\].
fn coefficients() -> Matrix3<f64> {
    const ROOT: f64 = 2.449_489_742_783_178;
    Matrix3::new(
        (88.0 - 7.0 * ROOT) / 360.0,
        (296.0 - 169.0 * ROOT) / 1800.0,
        (-2.0 + 3.0 * ROOT) / 225.0,
        (296.0 + 169.0 * ROOT) / 1800.0,
        (88.0 + 7.0 * ROOT) / 360.0,
        (-2.0 - 3.0 * ROOT) / 225.0,
        (16.0 - ROOT) / 36.0,
        (16.0 + ROOT) / 36.0,
        1.0 / 9.0,
    )
}
