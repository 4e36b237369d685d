//! The contact model: the force expected from the scan, and the displacement of a face by it.

use super::error::DynamicsError;
use super::hold::{Hold, Shift};
use super::sigmoid_flow::{advance, share};
use super::spring_flow;

/// Share of f_max up to which a sigmoid is trusted: beyond it the depth runs off to infinity, and with it the offset.
pub const LARGEST_SHARE: f64 = 0.99;
/// Below this scaled time one rounding of u is more than what happens.
const NO_TIME: f64 = 1e-200;
/// Scaled times beyond it leave too little room below the largest number: they are divided by e^u, at u = −40 at least.
const LONGEST: f64 = 1e280;

/// The expected force f over the signed distance h of the tip from the face (positive outside).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactModel {
    /// f(h) = f_max / (1 + exp(h/h_min + δ)) \[paper, Eq 3\].
    Sigmoid {
        /// f_max, N, > 0
        f_max_n: f64,
        /// h_min, m, > 0
        h_min_m: f64,
        /// δ; the force at h = 0 is f_max / (1 + e^δ)
        delta: f64,
    },
    /// f(h) = −k h on both sides of h = 0: a probe of known stiffness.
    Spring {
        /// k, N/m, > 0
        stiffness_n_per_m: f64,
    },
}

impl ContactModel {
    /// # Errors
    /// [`DynamicsError::BadParameter`] for a value that is not finite, or not positive where it must be.
    pub fn check(&self) -> Result<(), DynamicsError> {
        let (positive, finite): (&[_], &[_]) = match *self {
            Self::Sigmoid { f_max_n, h_min_m, delta } => {
                (&[("f_max_n", f_max_n), ("h_min_m", h_min_m)], &[("delta", delta)])
            }
            Self::Spring { stiffness_n_per_m } => (&[("k_n_per_m", stiffness_n_per_m)], &[]),
        };
        let bad_positive = positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0));
        if let Some(&(name, value)) = bad_positive.or_else(|| finite.iter().find(|(_, value)| !value.is_finite())) {
            return Err(DynamicsError::BadParameter { name, value });
        }
        Ok(())
    }

    /// f(h), N.
    pub fn force(&self, h_m: f64) -> f64 {
        match *self {
            Self::Sigmoid { f_max_n, h_min_m, delta } => f_max_n * share(h_m / h_min_m + delta),
            Self::Spring { stiffness_n_per_m } => -stiffness_n_per_m * h_m,
        }
    }

    /// df/dh, N/m, ≤ 0.
    pub(super) fn slope(&self, h_m: f64) -> f64 {
        match *self {
            Self::Sigmoid { f_max_n, h_min_m, delta } => {
                let u = h_m / h_min_m + delta;
                -f_max_n / h_min_m * share(u) * share(-u)
            }
            Self::Spring { stiffness_n_per_m } => -stiffness_n_per_m,
        }
    }

    /// f⁻¹(F), m; infinite where the sigmoid never reaches F.
    pub fn distance(&self, force_n: f64) -> f64 {
        match *self {
            Self::Sigmoid { f_max_n, .. } if force_n <= 0.0 => f_max_n * f64::INFINITY,
            Self::Sigmoid { f_max_n, .. } if force_n >= f_max_n => f64::NEG_INFINITY,
            Self::Sigmoid { f_max_n, h_min_m, delta } => {
                let (rest, quotient) = (f_max_n - force_n, (f_max_n - force_n) / force_n);
                // a force so small that the quotient overflows is still reached
                let log = if quotient.is_finite() { quotient.ln() } else { rest.ln() - force_n.ln() };
                h_min_m * (log - delta)
            }
            Self::Spring { stiffness_n_per_m } => -force_n / stiffness_n_per_m,
        }
    }

    /// Whether F·n is more than the model can answer: [`Self::rigid_offset`], and a step that takes the offset out,
    /// then use [`LARGEST_SHARE`] · f_max instead; a step that does not lets the face escape.
    pub fn clamps(&self, force_n: f64) -> bool {
        matches!(*self, Self::Sigmoid { f_max_n, .. } if force_n > LARGEST_SHARE * f_max_n)
    }

    /// The force a rigid contact is compared with: F·n between f(0), below which the model cannot distinguish contact from
    /// none, and [`LARGEST_SHARE`] · f_max.
    pub(super) fn comparable(&self, force_n: f64, at_zero_n: f64) -> f64 {
        match *self {
            Self::Sigmoid { f_max_n, .. } => force_n.max(at_zero_n).min(LARGEST_SHARE * f_max_n),
            Self::Spring { .. } => force_n,
        }
    }

    /// Where a face on a rigid surface comes to rest under the force F·n, seen from the tip: f⁻¹(F·n), m, ≤ 0.
    ///
    /// Zero below f(0), clamped above [`LARGEST_SHARE`] · f_max: always finite.
    pub fn rigid_offset(&self, force_n: f64) -> f64 {
        self.distance(self.comparable(force_n, self.force(0.0)))
    }

    /// Exact solution of ds/dt = α (F·n − f(h₀ + v t − (a·n) s)), s(0) = 0; not finite where it overflows.
    #[inline]
    pub(super) fn flow(&self, hold: &Hold) -> Shift {
        match *self {
            Self::Sigmoid { f_max_n, h_min_m, delta } => sigmoid(hold, f_max_n, h_min_m, delta),
            Self::Spring { stiffness_n_per_m } => spring_flow::flow(hold, stiffness_n_per_m),
        }
    }
}

/// a b c, also where a b underflows or overflows and a b c does not; none is negative.
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
    let drift = if hold.drift == 0.0 { 0.0 } else { hold.drift / (hold.alpha * hold.cosine) };
    let c = (hold.force - drift) / f_max;
    if t.abs() < NO_TIME || !c.is_finite() {
        // the face does not move along its own normal: only the drift changes h, seen at its middle
        let load = share(u + 0.5 * hold.drift * hold.dt / h_min);
        let impulse = load * f_max * hold.dt;
        return Shift { displacement: hold.alpha * (hold.force * hold.dt - impulse), impulse };
    }
    if t.abs() > LONGEST {
        return Shift { displacement: f64::NAN, impulse: f64::NAN };
    }
    let moved = advance(u, c, t);
    let impulse = moved.load / t.abs() * f_max * hold.dt;
    let along_h = -moved.delta_u / t * reach;
    if hold.drift == 0.0 {
        return Shift { displacement: along_h, impulse };
    }
    // two formulas of the same number; the one with the smaller terms loses less
    let drifted = hold.drift * hold.dt / hold.cosine;
    let pushed = hold.alpha * hold.force * hold.dt;
    let displacement = if pushed.abs() < drifted.abs() { pushed - hold.alpha * impulse } else { drifted + along_h };
    Shift { displacement, impulse }
}
