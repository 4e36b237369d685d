//! The fit itself: three rounds of robust regression that reject what does not belong to the
//! surface.

use super::solver::FitProblem;
use super::{Fit, FitError, FitParams, Observation, Surface};
use crate::numeric::{SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, median};

/// Weight updates in one round; the weights converge long before.
const MOST_UPDATES: usize = 50;
/// Weights that change by less than this have converged; the rounds after them need no more.
const SETTLED_WEIGHT: f64 = 1e-2;
/// Rounds of rejection; what is kept repeats after two or three.
const MOST_REJECTIONS: usize = 10;
/// Efficiency of 95 % on normal errors, as [`TUKEY_WIDTH`].
const HUBER: f64 = 1.345;
/// Corrections of the bias by curvature; the second one changes it in the fourth order.
const DEBIASINGS: usize = 2;

/// Fits a surface to observations, from a first guess.
///
/// Huber's weights bring the guess near without being held by outliers, Tukey's biweights drop
/// them; then what lies beyond `rejection` scaled standard deviations is taken out and the
/// remainder is fitted by plain least squares, corrected for the bias that curvature brings. The
/// scale is the median of the normalised residuals, and never below 1: groups share errors, so
/// residuals may look smaller than the errors are.
///
/// # Errors
/// [`FitError`]; on NaN, too few observations, and where a needed number is not fixed by them.
pub fn fit<M: Surface>(
    guess: &M,
    observations: &[Observation],
    params: &FitParams,
) -> Result<Fit<M>, FitError> {
    params.check()?;
    guess.check()?;
    Observation::check_all(observations)?;
    let mut problem = FitProblem::new(observations, guess.axis(), params);
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

/// As [`fit`], to a mesh alone: neighbours are off alike, so its surface may be off as a whole by
/// as much as the mesh is uneven, which no residual shows.
///
/// - `uneven`: how uneven it is around, m; what is more so itself counts as it is.
/// - `facets`: how far flat faces are off the surface, m.
///
/// # Errors
/// As [`fit`].
pub(crate) fn fit_mesh<M: Surface>(
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

/// Refuses fewer observations than unknowns, and those of one group alone.
fn enough<M: Surface>(problem: &FitProblem, kept: &[f64]) -> Result<(), FitError> {
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
fn scale<M: Surface>(z: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = z.iter().map(|z| z.abs()).collect();
    let freedom = z.len() as f64 / (z.len().saturating_sub(M::freedom_count())).max(1) as f64;
    (SIGMA_OF_MEDIAN * median(&mut sizes).unwrap_or(0.0) * freedom.sqrt()).max(1.0)
}

/// Steps and weights by turns until both converge. A round that does not is no error: the next one
/// goes on from there.
fn reweighted<M: Surface>(problem: &FitProblem, mut surface: M, weight: fn(f64) -> f64) -> M {
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

/// Least squares without what lies too far, until the same are kept twice; and which those are (1,
/// others 0).
fn rejected<M: Surface>(
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
