//! The rigid motion that takes picked points onto the same points picked elsewhere.
//!
//! R, t minimise Σ wᵢ |bᵢ − (R aᵢ + t)|²: relative to the weighted centroids, R = U diag(1, 1, det
//! U Vᵀ) Vᵀ of the singular value decomposition Σ wᵢ b′ᵢ a′ᵢᵀ = U S Vᵀ [Kabsch 1976, Umeyama 1991].
//! About the centroid shift and turn are independent: cov = σ² diag(I / Σ wᵢ, (Σ wᵢ (|qᵢ|² I − qᵢ
//! qᵢᵀ))⁻¹), qᵢ = R a′ᵢ.
//!
//! People pick wrong points, in wrong units and wrong axes. The pairs alone reveal: one pair
//! against all the others (leave one out, with an F test), distances that differ by a known factor,
//! a mirror image that fits better.

mod error;
mod misfit;
mod solved;

use std::ops::RangeInclusive;

pub use error::{PairSide, PairsError};
use nalgebra::{Isometry3, Point3};
pub use solved::{PairsFit, PairsParams, PointPair};

use self::solved::SolvedMotion;
use touchup_geometry::numeric::{median, spreads};

/// Largest distance of a point from the origin, m; beyond it is a fault.
const LARGEST_COORDINATE: f64 = 1e6;
/// Range of plausible standard deviations of a pick, m: far outside, their squares are no numbers.
const BELIEVABLE_SIGMA: RangeInclusive<f64> = 1e-12..=1e3;
/// Scatter across a line, as a share of the scatter along it, below which points count as on it:
/// 1°.
const LINE_SHARE: f64 = 0.02;
/// The same limit in standard deviations of a pick: the turn about the line is then undetermined.
const LINE_SIGMAS: f64 = 3.0;
/// Share of their scatter below which two picks are one point.
const SAME_SHARE: f64 = 1e-6;

/// The motion, or the reason why there is none.
///
/// # Errors
/// [`PairsError`]: too few, coincident or collinear points, points that are no numbers, another
/// unit, a mirror image, a pair that does not fit the others (named with 5 pairs or more), pairs
/// that disagree.
///
/// # Example
/// ```
/// # use touchup_features::align::{PairsParams, PointPair, fit_pairs};
/// # use nalgebra::{Point3, Vector3};
/// let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]].map(Point3::from);
/// let pairs = corners.map(|from| PointPair { from, to: from + Vector3::new(0.0, 0.0, 0.5), sigma: None });
/// let fit = fit_pairs(&pairs, &PairsParams::default())?;
/// assert!((fit.motion.translation.z - 0.5).abs() < 1e-12 && fit.motion.rotation.angle() < 1e-12);
/// # Ok::<(), touchup_features::align::PairsError>(())
/// ```
pub fn fit_pairs(pairs: &[PointPair], params: &PairsParams) -> Result<PairsFit, PairsError> {
    if let Some(sigma) = params
        .sigma
        .filter(|sigma| !BELIEVABLE_SIGMA.contains(sigma))
    {
        return Err(PairsError::BadGivenSigma {
            sigma_mm: sigma * 1e3,
        });
    }
    check(pairs)?;
    check_extent(pairs, params)?;
    let weights = weights(pairs, params);
    let solved = SolvedMotion::of(pairs, &weights, None).ok_or(PairsError::NoRotation)?;
    misfit::check(pairs, &weights, params, &solved)?;
    let fit = solved.fit(pairs, &weights, given_sigma(pairs, params));
    check_lines(pairs, fit.sigma)?;
    Ok(fit)
}

/// The motion of least squares between corresponding pairs, all of the same weight; if they lie on
/// one line, one of the motions that fit equally well. `None` for no pairs, or if one is no number.
pub(crate) fn closest_motion(pairs: &[PointPair]) -> Option<Isometry3<f64>> {
    SolvedMotion::of(pairs, &vec![1.0; pairs.len()], None).map(|solved| solved.motion)
}

/// σ of a pair of unit weight, if given beforehand.
fn given_sigma(pairs: &[PointPair], params: &PairsParams) -> Option<f64> {
    params.sigma.or_else(|| {
        pairs
            .iter()
            .all(|pair| pair.sigma.is_some())
            .then(|| pairs[0].sigma)
            .flatten()
    })
}

/// (σ₀ / σᵢ)², which gives a pair of σ₀ weight 1. A pair without a sigma has the median weight of
/// those with one.
fn weights(pairs: &[PointPair], params: &PairsParams) -> Vec<f64> {
    let mut named: Vec<f64> = pairs.iter().filter_map(|pair| pair.sigma).collect();
    let usual = params.sigma.or(median(&mut named)).unwrap_or(1.0);
    let unit = given_sigma(pairs, params).unwrap_or(usual);
    pairs
        .iter()
        .map(|pair| (unit / pair.sigma.unwrap_or(usual)).powi(2))
        .collect()
}

fn check(pairs: &[PointPair]) -> Result<(), PairsError> {
    if pairs.len() < 3 {
        return Err(PairsError::TooFew { count: pairs.len() });
    }
    for (i, pair) in pairs.iter().enumerate() {
        for (side, point) in [(PairSide::From, &pair.from), (PairSide::To, &pair.to)] {
            if !point.iter().all(|x| x.abs() <= LARGEST_COORDINATE) {
                return Err(PairsError::BadPoint { pair: i + 1, side });
            }
        }
        if let Some(sigma) = pair.sigma.filter(|sigma| !BELIEVABLE_SIGMA.contains(sigma)) {
            return Err(PairsError::BadSigma {
                pair: i + 1,
                sigma_mm: sigma * 1e3,
            });
        }
    }
    Ok(())
}

/// Refuses points that are too few or too close together on either side.
fn check_extent(pairs: &[PointPair], params: &PairsParams) -> Result<(), PairsError> {
    for side in [PairSide::From, PairSide::To] {
        let points: Vec<_> = pairs.iter().map(|pair| pair.on(side)).collect();
        let [.., along] = spreads(points.iter().map(|p| p.coords));
        let apart = SAME_SHARE * along;
        let mut distinct: Vec<usize> = Vec::new();
        let mut same = None;
        for (i, point) in points.iter().enumerate() {
            match distinct
                .iter()
                .find(|&&j| (points[j] - point).norm() <= apart)
            {
                Some(&j) => same = same.or(Some((j, i, (points[j] - point).norm()))),
                None if distinct.len() < 3 => distinct.push(i),
                None => {}
            }
        }
        if let (Some((first, second, distance)), 0..3) = (same, distinct.len()) {
            let (first, second) = (first + 1, second + 1);
            return Err(PairsError::Coincident {
                first,
                second,
                side,
                distance_mm: distance * 1e3,
            });
        }
    }
    check_lines(pairs, params.sigma.unwrap_or(0.0))
}

/// - `sigma`: of a pick, m.
fn check_lines(pairs: &[PointPair], sigma: f64) -> Result<(), PairsError> {
    for side in [PairSide::From, PairSide::To] {
        let [_, across, along] = spreads(pairs.iter().map(|pair| pair.on(side).coords));
        if across <= (LINE_SHARE * along).max(LINE_SIGMAS * sigma) {
            return Err(PairsError::Collinear {
                side,
                along_mm: along * 1e3,
                across_mm: across * 1e3,
            });
        }
    }
    Ok(())
}

impl PointPair {
    fn on(&self, side: PairSide) -> Point3<f64> {
        match side {
            PairSide::From => self.from,
            PairSide::To => self.to,
        }
    }
}
