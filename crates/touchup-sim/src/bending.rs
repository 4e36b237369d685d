//! Bending of the tip under a force: a stiffness for each of three perpendicular directions.

use nalgebra::{UnitQuaternion, Vector3};

/// Stiffness of stylus and holder at the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipBending {
    /// N/m
    pub stiffness: f64,
    /// Stiffness along each principal direction over `stiffness`.
    pub shares: Vector3<f64>,
    /// Turns the principal directions to the axes of T.
    pub axes: UnitQuaternion<f64>,
}

impl TipBending {
    /// Deflection of the tip under a force, m, in O: R K⁻¹ Rᵀ F, K = A diag(k s) Aᵀ.
    ///
    /// - `r_ot`: orientation of the stylus; `force_o`: N, in O.
    pub fn bend(&self, r_ot: &UnitQuaternion<f64>, force_o: &Vector3<f64>) -> Vector3<f64> {
        let principal = r_ot * self.axes;
        // additional compliance of each direction beyond the common part: zero for equal directions
        let extra = (principal.inverse() * force_o)
            .component_mul(&self.shares.map(|share| share.recip() - 1.0));
        (force_o + principal * extra) / self.stiffness
    }
}
