//! A stylus drawn to a face and pressing on it \[paper, Eq 8–11\].
//!
//! dp/dt = γ (F + K (b* − p) − F_c n*): F is the force of the real surface, K (b* − p) draws the
//! tip to the face, and −F_c n* presses. Together with the face dynamics of `refine` it is the
//! coupled system of Eq 11.

use nalgebra::{Point3, Vector3};

/// The stylus of the paper's one-face experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidedStylus {
    /// γ, m/(N·s)
    pub mobility_m_per_n_s: f64,
    /// K, N/m
    pub stiffness_n_per_m: f64,
    /// F_c, N
    pub contact_force_n: f64,
}

impl Default for GuidedStylus {
    /// The paper gives no values; with these one face comes to rest within 40 s.
    fn default() -> Self {
        Self {
            mobility_m_per_n_s: 0.01,
            stiffness_n_per_m: 100.0,
            contact_force_n: 2.0,
        }
    }
}

impl GuidedStylus {
    /// dp/dt, m/s, of the tip `p` under `force` (N, on the stylus) beside the face with barycentre
    /// `b` and normal `n`.
    pub fn velocity(
        &self,
        p: &Point3<f64>,
        force: &Vector3<f64>,
        b: &Point3<f64>,
        n: &Vector3<f64>,
    ) -> Vector3<f64> {
        self.mobility_m_per_n_s
            * (force + self.stiffness_n_per_m * (b - p) - self.contact_force_n * n)
    }

    /// The tip after `dt` (s) with the face held, by the classical Runge–Kutta method.
    ///
    /// `surface_force`: force of the real surface on a tip, N. Stable while γ (K + its stiffness)
    /// dt < 2.7.
    pub fn step(
        &self,
        p: &Point3<f64>,
        b: &Point3<f64>,
        n: &Vector3<f64>,
        surface_force: impl Fn(&Point3<f64>) -> Vector3<f64>,
        dt: f64,
    ) -> Point3<f64> {
        let velocity = |p: Point3<f64>| self.velocity(&p, &surface_force(&p), b, n);
        let k1 = velocity(*p);
        let k2 = velocity(p + 0.5 * dt * k1);
        let k3 = velocity(p + 0.5 * dt * k2);
        let k4 = velocity(p + dt * k3);
        p + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    }
}
