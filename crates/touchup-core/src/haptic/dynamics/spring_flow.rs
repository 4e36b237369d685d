//! The exact flow of a linear spring: dh/dt = v − α (a·n) (F·n + k h) is linear in h.

use super::hold::{Hold, Shift};

/// Below it the series is taken, above it the closed form (which there loses no more than four roundings).
const SERIES_UP_TO: f64 = 1.0;
/// 1/k! for k = 2 … 19; the next one is below a rounding of 1/2.
const INVERSE_FACTORIALS: [f64; 18] = {
    let (mut inverse, mut factorial, mut k) = ([0.0; 18], 1.0, 2);
    while k < 20 {
        factorial *= k as f64;
        inverse[k - 2] = 1.0 / factorial;
        k += 1;
    }
    inverse
};

/// s = α t ((F·n + k h₀) φ₁(z) + k v t φ₂(z)), z = −α (a·n) k t, and J = −k ∫ h dt likewise.
#[inline]
pub(super) fn flow(hold: &Hold, stiffness: f64) -> Shift {
    let Hold { h, drift, cosine, force, alpha, dt } = *hold;
    let (phi1, phi2) = phi(-alpha * cosine * stiffness * dt);
    let displacement = alpha * dt * ((force + stiffness * h) * phi1 + stiffness * drift * dt * phi2);
    let impulse = -stiffness * dt * (h * phi1 + (drift - alpha * cosine * force) * dt * phi2);
    Shift { displacement, impulse }
}

/// φ₁(z) = (e^z − 1)/z and φ₂(z) = (e^z − 1 − z)/z².
#[inline]
fn phi(z: f64) -> (f64, f64) {
    if z.abs() < SERIES_UP_TO {
        let phi2 = INVERSE_FACTORIALS.iter().rev().fold(0.0, |sum, inverse| sum * z + inverse);
        return (1.0 + z * phi2, phi2);
    }
    let phi1 = z.exp_m1() / z;
    (phi1, (phi1 - 1.0) / z)
}
