//! Explicit solvers with a fixed step.

use super::problem::State;

/// `steps` steps of Euler's method: order 1, one evaluation each.
pub fn euler(start: State, end: f64, steps: usize, mut rate: impl FnMut(&State) -> State) -> State {
    let dt = end / steps as f64;
    (0..steps).fold(start, |y, _| moved(&y, dt, &rate(&y)))
}

/// `steps` steps of the classical Runge–Kutta method: order 4, four evaluations each.
pub fn runge_kutta(start: State, end: f64, steps: usize, mut rate: impl FnMut(&State) -> State) -> State {
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
