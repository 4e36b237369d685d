//! Bias of a fit by curvature, and its removal.
//!
//! Expand the residual of one point to second order in its error ε (isotropic, variance σ²) and in
//! the error δ of the fitted freedoms: f = n·ε + J·δ + ½ εᵀHε + εᵀMδ + ½ δᵀGδ. To first order δ is
//! linear in the n·ε alone, with covariance C. Take the mean of the normal equations Σ w (∂f/∂δ) f
//! = 0 to second order: nᵀM = 0, since the derivative of a distance is constant along the normal,
//! and tangential errors do not reach δ, so all terms with M vanish; the terms with Gδ times the
//! residual cancel, since residuals and estimates of least squares are uncorrelated. There remains
//!
//! E δ = −(Σ w JᵀJ)⁻¹ Σ w Jᵀ b, b = ½ (σ² tr H + tr G C):
//!
//! the same as if every distance were too large by b. The fit therefore subtracts b. For a circle
//! of radius r, σ² tr H / 2 is σ²/(2r): the essential bias of the geometric fit \[Al-Sharadqah and
//! Chernov 2009\], which does not fall with the number of points; the second term falls with it and
//! matters on short arcs. Second differences over one standard deviation give both without second
//! derivatives.

use nalgebra::Vector3;

use super::solver::FitProblem;
use super::uncertainty::SPARE_GROUPS;
use super::{Fit, SurfaceModel};

impl<M: SurfaceModel> Fit<M> {
    /// b of each observation, m, for the error level of the residuals.
    pub(super) fn bias(&self, problem: &FitProblem) -> Vec<f64> {
        let surface = &self.surface;
        let fixed = self.groups.saturating_sub(self.degrees);
        // ratio to the stated errors; 1 with too few groups for an estimate
        let excess = if self.degrees > fixed + SPARE_GROUPS {
            self.chi_squared / self.degrees as f64
        } else {
            1.0
        };
        let step = excess.sqrt();
        let moved: Vec<M> = self
            .deviations
            .column_iter()
            .filter(|c| c.norm_squared() > 0.0)
            .flat_map(|c| [surface.moved(&(c * step)), surface.moved(&(c * -step))])
            .collect();
        let of_point = |i: usize| {
            let o = &problem.observations[i];
            let here = surface.distance(&o.point);
            let axes =
                [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * (o.sigma * step));
            let around = axes.into_iter().flat_map(|e| [o.point + e, o.point - e]);
            let by_point: f64 = around.map(|p| surface.distance(&p) - here).sum();
            let by_surface: f64 = moved.iter().map(|m| m.distance(&o.point) - here).sum();
            0.5 * (by_point + by_surface)
        };
        (0..problem.observations.len()).map(of_point).collect()
    }
}
