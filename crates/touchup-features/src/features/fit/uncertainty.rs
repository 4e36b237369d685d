//! The covariance of the freedoms of a fitted surface.

use nalgebra::{SMatrix, SymmetricEigen};

use super::solver::{FitProblem, FreedomMatrix};
use super::{FREEDOMS, Fit, FitError, FitParams, Freedom, Steps, SurfaceModel, TouchNoise};

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
    /// is T = I + W, W of the wander. The residuals give S = g/(g − k) Σ s sᵀ over the groups, s =
    /// Σ wᵢ rᵢ ∂dᵢ/∂y over one of them (g groups, k unknowns): the sandwich whose filling is
    /// independent of the correlation of errors inside a group \[Liang and Zeger 1986\]. Raising S
    /// to T in the directions in which it is smaller keeps the result above both.
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
        let deviations = FreedomMatrix::from_diagonal(&units) * scaled;
        let sums = GroupSums::of(problem, &surface, &weights, &deviations, &params.noise);
        let groups = sums.groups;
        let degrees =
            (groups + if problem.known_axis.is_some() { 2 } else { 0 }).saturating_sub(fixed);
        let wander = sums.wander(&problem.group_numbers, &params.noise);
        let stated = FreedomMatrix::identity() + wander;
        let inner = if groups < fixed + SPARE_GROUPS {
            let of_wander =
                params.noise.wander.powi(2) * weights.iter().sum::<f64>() - wander.trace();
            let expected = (degrees as f64 + of_wander).max(1.0);
            stated * (equations.square / expected).max(1.0)
        } else {
            let correction = groups as f64 / (groups - fixed) as f64;
            let prior = scaled.tr_mul(&(problem.prior(&surface).information * scaled));
            let sandwich = sums
                .scores
                .iter()
                .fold(prior, |sum, s| sum + s * s.transpose() * correction);
            raised(sandwich, stated)
        };
        let own_covariance = deviations * inner * deviations.transpose();
        Self {
            surface,
            covariance: own_covariance
                + common_covariance::<M>(&(deviations * sums.common), params),
            own_covariance,
            used: kept.iter().map(|k| *k > 0.0).collect(),
            chi_squared: equations.square,
            degrees,
            groups,
            unknown,
            alone: units.component_mul(&alone),
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

/// Sums over the kept observations of each group, in steps y.
struct GroupSums {
    /// number of groups with kept observations
    groups: usize,
    /// Σ wᵢ rᵢ ∂dᵢ/∂y
    scores: Vec<Steps>,
    /// Σ wᵢ ∂dᵢ/∂y nᵢᵀ, nᵢ the normal in O; 0 without a wander
    turned: Vec<SMatrix<f64, FREEDOMS, 3>>,
    /// Σ wᵢ ∂dᵢ/∂y over all groups
    common: Steps,
}

impl GroupSums {
    fn of<M: SurfaceModel>(
        problem: &FitProblem,
        surface: &M,
        weights: &[f64],
        deviations: &FreedomMatrix,
        noise: &TouchNoise,
    ) -> Self {
        let count = problem.group_numbers.len();
        let mut is_used = vec![false; count];
        let mut sums = Self {
            groups: 0,
            scores: vec![Steps::zeros(); count],
            turned: vec![SMatrix::zeros(); count],
            common: Steps::zeros(),
        };
        for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let (point, group) = (&problem.observations[i].point, problem.group[i]);
            let by = deviations.tr_mul(&surface.derivatives(point).1) * w;
            sums.scores[group] += by * problem.residual(surface, i);
            if noise.wander > 0.0 {
                sums.turned[group] += by * surface.distance_and_normal(point).1.transpose();
            }
            sums.common += by;
            is_used[group] = true;
        }
        sums.groups = is_used.iter().filter(|is| **is).count();
        sums
    }

    /// Covariance by the wander: Σ w² exp(−|t − t′|/T) B B′ᵀ over all pairs of groups, B their
    /// `turned`. As the wander has no memory but its last value, one sum over all earlier groups
    /// goes along.
    fn wander(&self, group_numbers: &[u32], noise: &TouchNoise) -> FreedomMatrix {
        let mut sum = FreedomMatrix::zeros();
        if noise.wander <= 0.0 {
            return sum;
        }
        let (mut earlier, mut last) = (SMatrix::<f64, FREEDOMS, 3>::zeros(), 0);
        for (own, &number) in self.turned.iter().zip(group_numbers) {
            earlier *= (-f64::from(number - last) / noise.memory.max(f64::MIN_POSITIVE)).exp();
            let cross = own * earlier.transpose();
            sum += own * own.transpose() + cross + cross.transpose();
            earlier += own;
            last = number;
        }
        sum * noise.wander.powi(2)
    }
}

/// Covariance by the common errors of all observations.
///
/// - `common`: change of the freedoms by an error of 1 of all observations along their normals.
fn common_covariance<M: SurfaceModel>(common: &Steps, params: &FitParams) -> FreedomMatrix {
    let common = common * params.common_sigma;
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
    common * common.transpose() + FreedomMatrix::from_diagonal(&shift)
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

/// The matrix, raised to at least another, definite one in each direction.
fn raised(matrix: FreedomMatrix, least: FreedomMatrix) -> FreedomMatrix {
    let root = least.cholesky().map(|root| root.unpack());
    let Some((root, inverse)) = root.and_then(|root| Some((root, root.try_inverse()?))) else {
        return matrix + least;
    };
    let mut eigen = SymmetricEigen::new(inverse * matrix * inverse.transpose());
    eigen.eigenvalues.apply(|x| *x = x.max(1.0));
    root * eigen.recompose() * root.transpose()
}
