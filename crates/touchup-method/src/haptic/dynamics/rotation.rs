//! Exact flow of the normal: dn/dt = β f (F − (F·n) n).

use nalgebra::Vector3;

/// Limit of 1 + n·to for opposite vectors: half the square of a rounding of a unit vector.
const OPPOSITE: f64 = 1e-33;

/// Turns `n` towards the unit vector `to` until tan(θ/2) has fallen by e^−`exponent`; away from it
/// if the exponent is negative.
///
/// With e = e^−exponent, m = n + to and p = |m|²/2 = 1 + n·to,
///
/// n′ ∝ 2e m + ((1 − e)² p − 2e²) to,
///
/// which needs no angle and keeps its precision for n and `to` nearly opposite. Opposite vectors
/// stay.
#[inline]
pub fn turn(n: &Vector3<f64>, to: &Vector3<f64>, exponent: f64) -> Vector3<f64> {
    if exponent == 0.0 {
        return *n;
    }
    let to = if exponent < 0.0 { -to } else { *to };
    let e = (-exponent.abs()).exp();
    let m = n + to;
    let p = 0.5 * m.norm_squared();
    if p < OPPOSITE {
        return *n;
    }
    let turned = 2.0 * e * m + ((1.0 - e) * (1.0 - e) * p - 2.0 * e * e) * to;
    // its length is 2e² + p (1 − e²): far above the smallest number, since p is at least `OPPOSITE`
    turned / turned.norm()
}
