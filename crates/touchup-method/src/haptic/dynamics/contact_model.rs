//! Contact model: the force expected from the scan, and the displacement of a face by it.
//!
//! The flow of a linear spring is exact too: dh/dt = v − α (a·n) (F·n + k h) is linear in h.

use super::error::DynamicsError;
use super::sigmoid_flow::{advance, share};
use crate::parameters;

/// Share of f_max up to which a sigmoid is reliable: beyond it the depth runs off to infinity, and
/// with it the offset.
pub const LARGEST_SHARE: f64 = 0.99;
/// Scaled time below which the change is less than one rounding of u.
const NO_TIME: f64 = 1e-200;
/// Largest scaled time: longer ones leave too little room below the largest number for a division
/// by e^u, at u = −40 at least.
const LONGEST: f64 = 1e280;
/// Limit of the series for a spring; above it the closed form, which there loses no more than four
/// roundings.
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

/// One face held against one sample, along the direction a in which the face may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hold {
    /// h at the start, m
    pub h: f64,
    /// dh/dt from other causes than the motion of the face, m/s
    pub drift: f64,
    /// a · n
    pub cosine: f64,
    /// F · n, N
    pub force: f64,
    /// α, m/(N·s)
    pub alpha: f64,
    /// time step, s
    pub dt: f64,
}

/// Result of one position flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    /// s = α ∫ (F·n − f) dt, m, along a
    pub displacement: f64,
    /// J = ∫ f dt, N·s
    pub impulse: f64,
}

parameters! {
    /// The sigmoid of Eq 3.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SigmoidParams in "refine" {
        /// Largest force of the sigmoid of Eq 3.
        ///
        /// In N. The paper leaves it open.
        f_max: f64 = 10.0, "f_max_n" [N, 1e-6, 1e6];
        /// Width of the sigmoid of Eq 3.
        ///
        /// In m.
        h_min: f64 = 0.5, "h_min_mm" [MM, 1e-9, 1e6];
        /// Shift of the sigmoid of Eq 3.
        delta: f64 = 5.0, "delta" [ONE, -50, 50];
    }
}

/// Expected force f over the signed distance h of the tip from the face (positive outside).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactModel {
    /// f(h) = f_max / (1 + exp(h/h_min + δ)) \[paper, Eq 3\].
    Sigmoid(SigmoidParams),
    /// f(h) = −k h on both sides of h = 0: a probe of known stiffness.
    Spring {
        /// k, N/m, > 0
        stiffness_n_per_m: f64,
    },
}

impl ContactModel {
    /// # Errors
    /// [`DynamicsError::BadParameter`] for a value that is not finite, or not positive as required.
    pub(crate) fn check(&self) -> Result<(), DynamicsError> {
        let positive = |name, value| DynamicsError::check(name, value, value > 0.0);
        match *self {
            Self::Sigmoid(curve) => {
                positive("f_max_n", curve.f_max)?;
                positive("h_min_m", curve.h_min)?;
                DynamicsError::check("delta", curve.delta, true)
            }
            Self::Spring { stiffness_n_per_m } => positive("k_n_per_m", stiffness_n_per_m),
        }
    }

    /// f(h), N.
    pub fn force(&self, h_m: f64) -> f64 {
        match *self {
            Self::Sigmoid(curve) => curve.f_max * share(h_m / curve.h_min + curve.delta),
            Self::Spring { stiffness_n_per_m } => -stiffness_n_per_m * h_m,
        }
    }

    /// df/dh, N/m, ≤ 0.
    pub(super) fn slope(&self, h_m: f64) -> f64 {
        match *self {
            Self::Sigmoid(curve) => {
                let u = h_m / curve.h_min + curve.delta;
                -curve.f_max / curve.h_min * share(u) * share(-u)
            }
            Self::Spring { stiffness_n_per_m } => -stiffness_n_per_m,
        }
    }

    /// f⁻¹(F), m; infinite if the sigmoid never reaches F.
    pub fn distance(&self, force_n: f64) -> f64 {
        match *self {
            Self::Sigmoid(curve) if force_n <= 0.0 => curve.f_max * f64::INFINITY,
            Self::Sigmoid(curve) if force_n >= curve.f_max => f64::NEG_INFINITY,
            Self::Sigmoid(curve) => {
                let rest = curve.f_max - force_n;
                let quotient = rest / force_n;
                // the sigmoid still reaches a force so small that the quotient overflows
                let log = if quotient.is_finite() {
                    quotient.ln()
                } else {
                    rest.ln() - force_n.ln()
                };
                curve.h_min * (log - curve.delta)
            }
            Self::Spring { stiffness_n_per_m } => -force_n / stiffness_n_per_m,
        }
    }

    /// Derivative of [`Self::distance`], m/N; zero if the distance is infinite.
    pub(super) fn distance_slope(&self, force_n: f64) -> f64 {
        match *self {
            Self::Sigmoid(curve) if force_n <= 0.0 || force_n >= curve.f_max => 0.0,
            Self::Sigmoid(curve) => -curve.h_min * (1.0 / (curve.f_max - force_n) + 1.0 / force_n),
            Self::Spring { stiffness_n_per_m } => -1.0 / stiffness_n_per_m,
        }
    }

    /// Whether F·n exceeds the model: [`Self::rigid_offset`], and a step that takes the offset out,
    /// then use [`LARGEST_SHARE`] · f_max instead; any other step lets the face escape.
    pub(crate) fn clamps(&self, force_n: f64) -> bool {
        matches!(*self, Self::Sigmoid(curve) if force_n > LARGEST_SHARE * curve.f_max)
    }

    /// Force for comparison with a rigid contact: F·n between f(0), below which the model cannot
    /// distinguish contact from none, and [`LARGEST_SHARE`] · f_max.
    pub(super) fn comparable(&self, force_n: f64, at_zero_n: f64) -> f64 {
        match *self {
            Self::Sigmoid(curve) => force_n.max(at_zero_n).min(LARGEST_SHARE * curve.f_max),
            Self::Spring { .. } => force_n,
        }
    }

    /// Rest position of a face on a rigid surface under the force F·n, relative to the tip:
    /// f⁻¹(F·n), m, ≤ 0.
    ///
    /// Zero below f(0), clamped above [`LARGEST_SHARE`] · f_max: always finite.
    pub fn rigid_offset(&self, force_n: f64) -> f64 {
        self.distance(self.comparable(force_n, self.force(0.0)))
    }

    /// Exact solution of ds/dt = α (F·n − f(h₀ + v t − (a·n) s)), s(0) = 0; not finite on overflow.
    #[inline]
    pub(super) fn flow(&self, hold: &Hold) -> Shift {
        match *self {
            Self::Sigmoid(curve) => sigmoid(hold, curve.f_max, curve.h_min, curve.delta),
            Self::Spring { stiffness_n_per_m } => spring(hold, stiffness_n_per_m),
        }
    }
}

/// a b c, even if a b underflows or overflows and a b c does not; none is negative.
#[inline]
fn product(a: f64, b: f64, c: f64) -> f64 {
    let first = a * b;
    if first.is_normal() {
        return first * c;
    }
    let mut factors = [a, b, c];
    factors.sort_by(f64::total_cmp);
    factors[0] * factors[2] * factors[1]
}

#[inline]
fn sigmoid(hold: &Hold, f_max: f64, h_min: f64, delta: f64) -> Shift {
    let u = hold.h / h_min + delta;
    let reach = product(hold.alpha, f_max, hold.dt);
    let t = reach * hold.cosine / h_min;
    let drift = if hold.drift == 0.0 {
        0.0
    } else {
        hold.drift / (hold.alpha * hold.cosine)
    };
    let c = (hold.force - drift) / f_max;
    if t.abs() < NO_TIME || !c.is_finite() {
        // no motion of the face along its own normal: only the drift changes h, taken at its middle
        let load = share(u + 0.5 * hold.drift * hold.dt / h_min);
        let impulse = load * f_max * hold.dt;
        return Shift {
            displacement: hold.alpha * (hold.force * hold.dt - impulse),
            impulse,
        };
    }
    if t.abs() > LONGEST {
        return Shift {
            displacement: f64::NAN,
            impulse: f64::NAN,
        };
    }
    let moved = advance(u, c, t);
    let impulse = moved.load / t.abs() * f_max * hold.dt;
    let along_h = -moved.delta_u / t * reach;
    if hold.drift == 0.0 {
        return Shift {
            displacement: along_h,
            impulse,
        };
    }
    // two formulas of the same number; the one with the smaller terms loses less
    let drifted = hold.drift * hold.dt / hold.cosine;
    let pushed = hold.alpha * hold.force * hold.dt;
    let displacement = if pushed.abs() < drifted.abs() {
        pushed - hold.alpha * impulse
    } else {
        drifted + along_h
    };
    Shift {
        displacement,
        impulse,
    }
}

/// s = α t ((F·n + k h₀) φ₁(z) + k v t φ₂(z)), z = −α (a·n) k t, and J = −k ∫ h dt likewise.
#[inline]
fn spring(hold: &Hold, stiffness: f64) -> Shift {
    let Hold {
        h,
        drift,
        cosine,
        force,
        alpha,
        dt,
    } = *hold;
    let (phi1, phi2) = phi(-alpha * cosine * stiffness * dt);
    let displacement =
        alpha * dt * ((force + stiffness * h) * phi1 + stiffness * drift * dt * phi2);
    let impulse = -stiffness * dt * (h * phi1 + (drift - alpha * cosine * force) * dt * phi2);
    Shift {
        displacement,
        impulse,
    }
}

/// φ₁(z) = (e^z − 1)/z and φ₂(z) = (e^z − 1 − z)/z².
#[inline]
fn phi(z: f64) -> (f64, f64) {
    if z.abs() < SERIES_UP_TO {
        let phi2 = INVERSE_FACTORIALS
            .iter()
            .rev()
            .fold(0.0, |sum, inverse| sum * z + inverse);
        return (1.0 + z * phi2, phi2);
    }
    let phi1 = z.exp_m1() / z;
    (phi1, (phi1 - 1.0) / z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_above_the_largest_share_are_clamped() {
        let curve = SigmoidParams {
            f_max: 10.0,
            ..SigmoidParams::default()
        };
        let model = ContactModel::Sigmoid(curve);
        assert!(!model.clamps(9.89) && model.clamps(9.91));
    }
}
