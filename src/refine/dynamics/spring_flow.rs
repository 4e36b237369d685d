//! The exact flow of a linear spring: dh/dt = v − α (a·n) (F·n + k h) is linear in h.

use super::contact_model::{Hold, Shift};

/// Below it the series is taken, above it the closed form (which there loses no more than four roundings).
const SERIES_UP_TO: f64 = 1.0;
/// 1/19! is below a rounding of 1/2.
const SERIES_TERMS: u32 = 19;

/// s = α t ((F·n + k h₀) φ₁(z) + k v t φ₂(z)), z = −α (a·n) k t, and J = −k ∫ h dt likewise.
#[inline]
pub(super) fn flow(hold: &Hold, stiffness: f64) -> Shift {
    let Hold { h, drift, cosine, force, alpha, dt } = *hold;
    let (phi1, phi2) = phi(-alpha * cosine * stiffness * dt);
    let way = alpha * dt * ((force + stiffness * h) * phi1 + stiffness * drift * dt * phi2);
    let impulse = -stiffness * dt * (h * phi1 + (drift - alpha * cosine * force) * dt * phi2);
    Shift { way, impulse }
}

/// φ₁(z) = (e^z − 1)/z and φ₂(z) = (e^z − 1 − z)/z².
#[inline]
fn phi(z: f64) -> (f64, f64) {
    if z.abs() < SERIES_UP_TO {
        let phi2 = (3..=SERIES_TERMS).rev().fold(1.0, |sum, k| 1.0 + sum * z / f64::from(k)) / 2.0;
        return (1.0 + z * phi2, phi2);
    }
    let phi1 = z.exp_m1() / z;
    (phi1, (phi1 - 1.0) / z)
}
