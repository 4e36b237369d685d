//! The covariance of the freedoms of a fitted surface.

use nalgebra::SymmetricEigen;

use super::solver::{FitProblem, FreedomMatrix};
use super::{Fit, FitError, FitParams, Freedom, Steps, SurfaceModel};

/// Maximum deviation of a determined direction: the size of the touched area, or 1 rad (both are 1
/// in scaled steps).
const LARGEST_DEVIATION: f64 = 1.0;
/// Minimum share of the information of each freedom in a determined direction: below, the freedoms
/// in it make up for each other, up to rounding.
const LEAST_SHARE: f64 = 1e-12;
/// Number of groups beyond the unknowns from which on the residuals give the size of the errors.
pub(super) const SPARE_GROUPS: usize = 3;

impl<M: SurfaceModel> Fit<M> {
    /// Covariance around a surface of least squares over the kept observations.
    ///
    /// In steps y of one stated standard deviation along the fixed directions the stated covariance
    /// is I. The residuals give S = g/(g − k) Σ s sᵀ over the groups, s = Σ wᵢ rᵢ ∂dᵢ/∂y over one
    /// of them (g groups, k unknowns): the sandwich whose filling is independent of the correlation
    /// of errors inside a group \[Liang and Zeger 1986\]. Raising the eigenvalues of S below 1 to 1
    /// keeps the result above both.
    pub(super) fn around(
        problem: &FitProblem,
        surface: M,
        kept: &[f64],
        params: &FitParams,
    ) -> Self {
        let (units, weights) = (problem.units::<M>(), problem.weights(kept));
        let equations = problem.equations(&surface, &weights);
        let (scaled, unknown, alone) = directions(&equations.information);
        let fixed = scaled
            .column_iter()
            .filter(|c| c.norm_squared() > 0.0)
            .count();
        let mut scores = vec![Steps::zeros(); problem.groups];
        let (mut common, mut in_group) = (Steps::zeros(), vec![false; problem.groups]);
        for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let (_, by) = surface.derivatives(&problem.observations[i].point);
            let by = scaled.tr_mul(&by.component_mul(&units)) * w;
            scores[problem.group[i]] += by * problem.residual(&surface, i);
            common += by;
            in_group[problem.group[i]] = true;
        }
        let groups = in_group.iter().filter(|is| **is).count();
        let chi_squared = equations.square;
        let degrees =
            (groups + if problem.known_axis.is_some() { 2 } else { 0 }).saturating_sub(fixed);
        let spread = (chi_squared / degrees.max(1) as f64).max(1.0);
        let inner = if groups < fixed + SPARE_GROUPS {
            FreedomMatrix::identity() * spread
        } else {
            let correction = groups as f64 / (groups - fixed) as f64;
            let prior = scaled.tr_mul(&(problem.prior(&surface).information * scaled));
            let sandwich = scores
                .iter()
                .fold(prior, |sum, s| sum + s * s.transpose() * correction);
            at_least_one(sandwich)
        };
        let deviations = FreedomMatrix::from_diagonal(&units) * scaled;
        let common = deviations * common * params.common_sigma;
        // a common displacement of observations displaces their surface, whichever part of it they
        // cover
        let shift = Steps::from_fn(|i, _| {
            let is_place = i <= Freedom::Z as usize;
            if is_place && M::FREE[i] {
                params.shift_sigma * params.shift_sigma
            } else {
                0.0
            }
        });
        let own_covariance = deviations * inner * deviations.transpose();
        let covariance =
            own_covariance + common * common.transpose() + FreedomMatrix::from_diagonal(&shift);
        let alone = units.component_mul(&alone);
        let used: Vec<bool> = kept.iter().map(|k| *k > 0.0).collect();
        Self {
            surface,
            covariance,
            own_covariance,
            used,
            chi_squared,
            degrees,
            groups,
            unknown,
            alone,
            deviations,
        }
    }

    /// # Errors
    /// [`FitError::Undetermined`]: a needed freedom is not fixed; [`FitError::BadSize`].
    pub(super) fn checked(self) -> Result<Self, FitError> {
        let is_open =
            |freedom: &Freedom| M::NEEDED[*freedom as usize] && self.std(*freedom).is_none();
        let open = Freedom::ALL.into_iter().find(is_open);
        if let Some(what) = open.and_then(|freedom| M::NAMES[freedom as usize]) {
            return Err(FitError::Undetermined { what });
        }
        self.surface.check()?;
        Ok(self)
    }
}

/// In scaled steps: columns of one standard deviation along the fixed directions; and, in steps
/// that each alone change the residuals by one standard deviation, the projector onto the other
/// directions, and these steps.
fn directions(information: &FreedomMatrix) -> (FreedomMatrix, FreedomMatrix, Steps) {
    let alone = information
        .diagonal()
        .map(|x| if x > 0.0 { x.sqrt().recip() } else { 1.0 });
    let widths = FreedomMatrix::from_diagonal(&alone);
    let eigen = SymmetricEigen::new(widths * information * widths);
    let (mut fixed, mut unknown) = (FreedomMatrix::zeros(), FreedomMatrix::zeros());
    for (direction, &share) in eigen
        .eigenvectors
        .column_iter()
        .zip(eigen.eigenvalues.iter())
    {
        let deviation = widths * direction / share.max(LEAST_SHARE).sqrt();
        if share > LEAST_SHARE && deviation.norm() <= LARGEST_DEVIATION {
            fixed.set_column(
                fixed
                    .column_iter()
                    .filter(|c| c.norm_squared() > 0.0)
                    .count(),
                &deviation,
            );
        } else {
            unknown += direction * direction.transpose();
        }
    }
    (fixed, unknown, alone)
}

/// The matrix with its eigenvalues raised to at least 1.
fn at_least_one(matrix: FreedomMatrix) -> FreedomMatrix {
    let mut eigen = SymmetricEigen::new(matrix);
    eigen.eigenvalues.apply(|x| *x = x.max(1.0));
    eigen.recompose()
}
