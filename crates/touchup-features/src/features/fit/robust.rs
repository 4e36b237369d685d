//! Robust fit: three rounds of regression that reject observations off the surface.

use super::solver::FitProblem;
use super::{Fit, FitError, FitParams, Observation, SurfaceModel};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, median};

/// Maximum number of weight updates in one round; the weights converge long before.
const MOST_UPDATES: usize = 50;
/// Weight change at convergence; the later rounds need no more.
const SETTLED_WEIGHT: f64 = 1e-2;
/// Maximum number of rejections; the kept set repeats after two or three.
const MOST_REJECTIONS: usize = 10;
/// Efficiency of 95 % on normal errors, as [`TUKEY_WIDTH`].
const HUBER: f64 = 1.345;
/// Number of corrections of the curvature bias; the second one is of fourth order.
const DEBIASINGS: usize = 2;

/// Fits a surface to observations, from a first guess.
///
/// Huber's weights bring the guess near despite outliers, Tukey's biweights drop them; then the fit
/// rejects observations beyond `rejection` scaled standard deviations and takes plain least squares
/// of the rest, corrected for the bias by curvature. The scale is the median of the normalised
/// residuals, and never below 1: groups share errors, so residuals may look smaller than the errors
/// are. No observation is better than the white noise of its session.
///
/// # Errors
/// [`FitError`]; on NaN, too few observations, and an undetermined needed freedom.
pub fn fit<M: SurfaceModel>(
    guess: &M,
    observations: &[Observation],
    params: &FitParams,
) -> Result<Fit<M>, FitError> {
    params.check()?;
    guess.check()?;
    Observation::check_all(observations)?;
    let with_white = |o: &Observation| Observation {
        sigma: o.sigma.max(params.noise.white),
        ..*o
    };
    let observations: Vec<_> = observations.iter().map(with_white).collect();
    let mut problem = FitProblem::new(&observations, guess.axis(), params);
    let all = vec![1.0; observations.len()];
    enough::<M>(&problem, &all)?;
    let near = reweighted(&problem, problem.described(guess, &all), huber);
    let near = reweighted(&problem, near, tukey);
    let (surface, kept) = rejected(&problem, near, params.rejection)?;
    let weights = problem.weights(&kept);
    let mut fit = Fit::around(&problem, surface, &kept, params);
    for _ in 0..DEBIASINGS {
        problem.shift = fit.bias(&problem);
        fit = Fit::around(
            &problem,
            problem.solve(fit.surface, &weights)?,
            &kept,
            params,
        );
    }
    fit.checked()
}

/// As [`fit`], to a mesh alone: neighbours have like errors, so the surface may be off as a whole
/// by the unevenness of the mesh, which no residual shows.
///
/// - `uneven`: unevenness of the surroundings, m; a larger unevenness of the surface itself
///   replaces it.
/// - `facets`: distance of flat faces from the surface, m.
///
/// # Errors
/// As [`fit`].
pub(crate) fn fit_mesh<M: SurfaceModel>(
    guess: &M,
    observations: &[Observation],
    params: &FitParams,
    uneven: f64,
    facets: f64,
) -> Result<Fit<M>, FitError> {
    let found = fit(guess, observations, params)?;
    let off = found.unevenness(observations).max(uneven).hypot(facets);
    let params = FitParams {
        common_sigma: params.common_sigma.hypot(off),
        shift_sigma: params.shift_sigma.hypot(off),
        ..*params
    };
    fit(&found.surface, observations, &params)
}

/// Refuses fewer observations than unknowns, and observations of one group alone.
fn enough<M: SurfaceModel>(problem: &FitProblem, kept: &[f64]) -> Result<(), FitError> {
    let have = kept.iter().filter(|k| **k > 0.0).count();
    let known = if problem.known_axis.is_some() { 2 } else { 0 };
    let unknowns = M::freedom_count() - known;
    if have < unknowns {
        return Err(FitError::TooFewObservations {
            have,
            given: kept.len(),
            need: unknowns,
        });
    }
    let mut groups = (0..kept.len())
        .filter(|&i| kept[i] > 0.0)
        .map(|i| problem.group[i]);
    let first = groups.next();
    if groups.all(|group| Some(group) == first) {
        Err(FitError::OneGroup)
    } else {
        Ok(())
    }
}

fn huber(z: f64) -> f64 {
    (HUBER / z.abs().max(HUBER)).min(1.0)
}

fn tukey(z: f64) -> f64 {
    biweight((z / TUKEY_WIDTH).powi(2))
}

/// Scale of normalised residuals, at least 1: from the median of all, as half of them are good.
fn scale<M: SurfaceModel>(z: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = z.iter().map(|z| z.abs()).collect();
    let freedom = z.len() as f64 / (z.len().saturating_sub(M::freedom_count())).max(1) as f64;
    (SIGMA_OF_MEDIAN * median(&mut sizes).unwrap_or(0.0) * freedom.sqrt()).max(1.0)
}

/// Alternates steps and weights until both converge. No convergence is no error: the next round
/// goes on from there.
fn reweighted<M: SurfaceModel>(problem: &FitProblem, mut surface: M, weight: fn(f64) -> f64) -> M {
    let mut before = vec![0.0; problem.observations.len()];
    for _ in 0..MOST_UPDATES {
        let z = problem.normalised(&surface);
        let scale = scale::<M>(&z);
        let kept: Vec<f64> = z.iter().map(|z| weight(z / scale)).collect();
        let change = kept
            .iter()
            .zip(&before)
            .map(|(a, b): (&f64, &f64)| (a - b).abs())
            .fold(0.0, f64::max);
        surface = problem.step(surface, &problem.weights(&kept));
        if change < SETTLED_WEIGHT {
            break;
        }
        before = kept;
    }
    surface
}

/// Least squares with rejection of outliers, until the kept set repeats; also returns that set (1,
/// others 0).
fn rejected<M: SurfaceModel>(
    problem: &FitProblem,
    mut surface: M,
    rejection: f64,
) -> Result<(M, Vec<f64>), FitError> {
    let mut kept = Vec::new();
    for _ in 0..MOST_REJECTIONS {
        let z = problem.normalised(&surface);
        let limit = rejection * scale::<M>(&z);
        let now: Vec<f64> = z
            .iter()
            .map(|z| if z.abs() <= limit { 1.0 } else { 0.0 })
            .collect();
        if now == kept {
            break;
        }
        enough::<M>(problem, &now)?;
        surface = problem.solve(problem.described(&surface, &now), &problem.weights(&now))?;
        kept = now;
    }
    Ok((surface, kept))
}
