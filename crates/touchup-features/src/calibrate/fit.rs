//! Robust least squares of zᵢ = Aᵢ x + y for vectors x and y of three, with Aᵢ a known 3 × 3
//! matrix.
//!
//! Relative to the means, N = Σ (Aᵢ − Ā)ᵀ (Aᵢ − Ā) and N x = Σ (Aᵢ − Ā)ᵀ (zᵢ − z̄), y = z̄ − Ā x;
//! cov x = σ² N⁻¹, cov y = σ² (I / n + Ā N⁻¹ Āᵀ), σ² = Σ |r|² / (3 n − 6). N leaves a direction
//! undetermined if Aᵢ x along it is the same for all i.
//!
//! Outliers come from the fit of least Σ |r| (by reweighting), with the median of |r| as its scale;
//! the rest is fitted by least squares, until the choice no longer changes.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use touchup_geometry::numeric::median;

/// One observation of three equations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Equation {
    pub a: Matrix3<f64>,
    pub z: Vector3<f64>,
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub(super) struct CalibrationFit {
    pub x: Vector3<f64>,
    pub y: Vector3<f64>,
    pub covariance_x: Matrix3<f64>,
    pub covariance_y: Matrix3<f64>,
    /// standard deviation of one component of z
    pub sigma: f64,
    /// √(mean |r|²) of the kept observations
    pub rms: f64,
    /// whether each observation was kept
    pub kept: Vec<bool>,
}

impl CalibrationFit {
    pub(crate) fn residual(&self, equation: &Equation) -> Vector3<f64> {
        equation.z - equation.a * self.x - self.y
    }

    pub(crate) fn rejected(&self) -> usize {
        self.kept.iter().filter(|kept| !**kept).count()
    }
}

/// Smallest number of observations that determine an outlier among them.
const FEWEST_TO_REJECT: usize = 8;
/// |r| of three normal components exceeds 5 σ once in 65 000.
const GATE_SIGMAS: f64 = 5.0;
/// The median of |r| of three normal components, in σ.
const MEDIAN_NORM: f64 = 1.5382;
/// Rounds to convergence of a reweighted fit; more would not change the kept observations.
const ROBUST_ROUNDS: usize = 30;
/// Maximum number of choices; if they still change, they alternate between two equally good ones.
const CHOICE_ROUNDS: usize = 30;
/// Share of the largest z below which residuals are rounding, and no reason to leave anything out.
const ROUNDING: f64 = 1e-12;

/// A direction of x that the equations do not determine.
#[derive(Clone, Copy, Debug)]
pub(super) struct UndeterminedDirection {
    /// how well it is observed, by [`spread`]
    pub spread: f64,
    pub axis: Vector3<f64>,
}

impl UndeterminedDirection {
    /// Rotation of the poses to either side across the axis, if A is a rotation, rad.
    pub(crate) fn angle(&self) -> f64 {
        self.spread.clamp(0.0, 1.0).sqrt().asin()
    }
}

/// The least determined direction, over the kept observations.
pub(super) fn least_determined(equations: &[Equation], kept: &[bool]) -> UndeterminedDirection {
    let weights: Vec<f64> = kept.iter().map(|&kept| f64::from(u8::from(kept))).collect();
    let (n, mean, _) = means(equations, &weights);
    let eigen = SymmetricEigen::new(normal(equations, &weights, &mean) / n);
    let i = eigen.eigenvalues.imin();
    UndeterminedDirection {
        spread: eigen.eigenvalues[i],
        axis: eigen.eigenvectors.column(i).into_owned(),
    }
}

/// The fit, or the direction left undetermined.
///
/// - `equations`: at least three.
/// - `smallest_spread`: [`spread`] below which a direction is undetermined.
pub(super) fn fit(
    equations: &[Equation],
    smallest_spread: f64,
) -> Result<CalibrationFit, UndeterminedDirection> {
    let fitted = |kept: Vec<bool>| {
        let least = least_determined(equations, &kept);
        if least.spread < smallest_spread {
            None
        } else {
            least_squares(equations, kept)
        }
        .ok_or(least)
    };
    let mut found = fitted(vec![true; equations.len()])?;
    if equations.len() < FEWEST_TO_REJECT {
        return Ok(found);
    }
    let Some(mut norms) = robust_norms(equations) else {
        return Ok(found);
    };
    let largest = equations
        .iter()
        .map(|equation| equation.z.amax())
        .fold(0.0, f64::max);
    let mut sigma = median(&mut norms.clone()).unwrap_or(0.0) / MEDIAN_NORM;
    for _ in 0..CHOICE_ROUNDS {
        let gate = GATE_SIGMAS * sigma.max(ROUNDING * largest);
        let kept: Vec<bool> = norms.iter().map(|norm| *norm <= gate).collect();
        if kept == found.kept {
            break;
        }
        found = fitted(kept)?;
        sigma = found.sigma;
        norms = equations
            .iter()
            .map(|equation| found.residual(equation).norm())
            .collect();
    }
    Ok(found)
}

/// |r| of each observation at the x and y of least Σ |r|.
fn robust_norms(equations: &[Equation]) -> Option<Vec<f64>> {
    let mut weights = vec![1.0; equations.len()];
    let mut norms = Vec::new();
    for _ in 0..ROBUST_ROUNDS {
        let (x, y) = solve(equations, &weights)?;
        norms = equations
            .iter()
            .map(|e| (e.z - e.a * x - y).norm())
            .collect();
        let mean = norms.iter().sum::<f64>() / norms.len() as f64;
        if mean <= 0.0 {
            break;
        }
        // a residual of 0 would have infinite weight
        weights = norms
            .iter()
            .map(|norm| 1.0 / norm.max(1e-3 * mean))
            .collect();
    }
    Some(norms)
}

fn least_squares(equations: &[Equation], kept: Vec<bool>) -> Option<CalibrationFit> {
    let weights: Vec<f64> = kept.iter().map(|&kept| f64::from(u8::from(kept))).collect();
    let (x, y) = solve(equations, &weights)?;
    let (n, mean, _) = means(equations, &weights);
    let inverse = normal(equations, &weights, &mean).try_inverse()?;
    let mut found = CalibrationFit {
        x,
        y,
        covariance_x: inverse,
        covariance_y: inverse,
        sigma: 0.0,
        rms: 0.0,
        kept,
    };
    let kept = equations.iter().zip(&found.kept).filter(|(_, kept)| **kept);
    let squares: f64 = kept
        .map(|(equation, _)| found.residual(equation).norm_squared())
        .sum();
    found.rms = (squares / n).sqrt();
    found.sigma = (squares / (3.0 * n - 6.0).max(1.0)).sqrt();
    let variance = found.sigma * found.sigma;
    found.covariance_x = inverse * variance;
    found.covariance_y = (Matrix3::identity() / n + mean * inverse * mean.transpose()) * variance;
    (x.iter().chain(&y).all(|c| c.is_finite()) && variance.is_finite()).then_some(found)
}

fn solve(equations: &[Equation], weights: &[f64]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let (_, a, z) = means(equations, weights);
    let right: Vector3<f64> = equations
        .iter()
        .zip(weights)
        .map(|(e, w)| (e.a - a).transpose() * (e.z - z) * *w)
        .sum();
    let x = normal(equations, weights, &a).cholesky()?.solve(&right);
    Some((x, z - a * x))
}

/// Σ w, and the weighted means of A and z.
fn means(equations: &[Equation], weights: &[f64]) -> (f64, Matrix3<f64>, Vector3<f64>) {
    let total: f64 = weights.iter().sum();
    let a: Matrix3<f64> = equations.iter().zip(weights).map(|(e, w)| e.a * *w).sum();
    let z: Vector3<f64> = equations.iter().zip(weights).map(|(e, w)| e.z * *w).sum();
    (total, a / total, z / total)
}

/// Σ w (A − Ā)ᵀ (A − Ā)
fn normal(equations: &[Equation], weights: &[f64], mean: &Matrix3<f64>) -> Matrix3<f64> {
    equations
        .iter()
        .zip(weights)
        .map(|(e, w)| (e.a - mean).transpose() * (e.a - mean) * *w)
        .sum()
}
