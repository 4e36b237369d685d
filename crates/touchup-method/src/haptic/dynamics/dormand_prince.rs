//! An adaptive Runge–Kutta solver of order 5(4), for comparison with the exact steps.

use super::error::DynamicsError;

/// Error per step, relative to the size of each component, of [`super::StepRule::DormandPrince`].
pub(crate) const RELATIVE: f64 = 1e-11;
/// Maximum number of steps, accepted or not; beyond it the problem is stiff: some ten milliseconds.
pub(crate) const MAX_STEPS: usize = 20_000;
/// A step may shrink to a fifth and grow fivefold.
const CHANGE: (f64, f64) = (0.2, 5.0);
/// Aim below the tolerance, so that most steps pass.
const SAFETY: f64 = 0.9;

/// Stages: nodes of the tableau of Dormand and Prince (1980); the right-hand side does not depend
/// on time.
const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
        0.0,
        0.0,
    ],
    [
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
        0.0,
    ],
    [
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
/// Fifth-order weights minus fourth-order weights.
const E: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// Displacement along a, m, and the normal.
pub(crate) type OdeState = [f64; 4];

/// Integrates dy/dt = `rate`(y) from 0 to `end`, s; `scale` is the relevant size of each component,
/// `relative` the error per step in units of it.
///
/// # Errors
/// [`DynamicsError::Stiff`] if `MAX_STEPS` do not suffice, [`DynamicsError::NotFinite`] if the
/// rate is not.
pub fn dormand_prince(
    start: OdeState,
    end: f64,
    scale: OdeState,
    relative: f64,
    rate: impl Fn(&OdeState) -> OdeState,
) -> Result<OdeState, DynamicsError> {
    let (mut y, mut time, mut step) = (start, 0.0, end);
    let mut k = [[0.0; 4]; 7];
    k[0] = rate(&y);
    for _ in 0..MAX_STEPS {
        if time >= end {
            return Ok(y);
        }
        let last = step >= end - time;
        let dt = if last { end - time } else { step };
        let next = stages(&y, dt, &mut k, &rate);
        let error = error_of(&y, &next, dt, &k, &scale) / relative;
        if error <= 1.0 {
            (y, k[0]) = (next, k[6]);
            time = if last { end } else { time + dt };
        } else if !error.is_finite() && dt <= end * f64::EPSILON {
            return Err(DynamicsError::NotFinite {
                what: "rate of change",
            });
        }
        let change = if error.is_finite() {
            SAFETY * error.powf(-0.2)
        } else {
            CHANGE.0
        };
        step = dt * change.clamp(CHANGE.0, CHANGE.1);
    }
    Err(DynamicsError::Stiff {
        rule: "dp5",
        steps: MAX_STEPS,
        reached_s: time,
        dt_s: end,
    })
}

/// Fills `k` and returns the fifth-order result, whose rate is `k[6]`.
fn stages(
    y: &OdeState,
    dt: f64,
    k: &mut [OdeState; 7],
    rate: impl Fn(&OdeState) -> OdeState,
) -> OdeState {
    let mut next = *y;
    for (stage, row) in A.iter().enumerate() {
        next = *y;
        for (weight, slope) in row.iter().zip(k.iter()).take(stage + 1) {
            for (value, slope) in next.iter_mut().zip(slope) {
                *value += dt * weight * slope;
            }
        }
        k[stage + 1] = rate(&next);
    }
    next
}

/// Largest error of a component over its size; NaN becomes infinite.
fn error_of(y: &OdeState, next: &OdeState, dt: f64, k: &[OdeState; 7], scale: &OdeState) -> f64 {
    let mut largest: f64 = 0.0;
    for i in 0..y.len() {
        let error: f64 = dt
            * E.iter()
                .zip(k)
                .map(|(weight, slope)| weight * slope[i])
                .sum::<f64>();
        let size = scale[i].max(y[i].abs()).max(next[i].abs());
        let ratio = error.abs() / size;
        largest = largest.max(if ratio.is_nan() { f64::INFINITY } else { ratio });
    }
    largest
}
