//! The rigid motion that takes measured features into the frame of a drawing: as a best fit of all
//! of them, or step by step by datums.
//!
//! Each pair of a measured feature and its nominal one gives equations: two for the place of an
//! axis, across it, one for the place of a plane, along its normal, and two more for the direction
//! of either, if the drawing has it. With small motions (shift t, turn ω about the middle c)
//!
//! y + A x = 0,  x = (t, L ω)
//!
//! by least squares, weighted by the standard uncertainties of the measurement. A best fit solves
//! all at once. Datums are solved one after the other, each within the freedoms left by those
//! before it, as in the datum system of ISO 5459: 3-2-1 for three planes. With x = −G y the
//! uncertainty of the motion is G Σ Gᵀ, and that of the places of the features in the fit (I − A G)
//! Σ (I − A G)ᵀ: evidence of a feature for the frame is none for its own place.

mod equations;
mod error;
mod pair;
mod solution;

use nalgebra::{DMatrix, Isometry3, Matrix6, Point3, Vector3, Vector6};

use self::equations::Equations;
pub use self::error::DatumFitError;
pub use self::pair::DatumPair;
use self::solution::Solution;
use crate::features::FeatureKind;
use touchup_geometry::numeric::{mean, moved_by_twist};

/// A motion into the frame of a drawing, and its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct DatumFit {
    /// Moves measurements in O into the frame of the drawing.
    pub motion: Isometry3<f64>,
    /// Middle of the measured features, in the frame of the drawing, m.
    pub centre: Point3<f64>,
    /// Covariance of (shift of the centre, rotation vector about it), in the frame of the drawing;
    /// m², m·rad, rad².
    pub covariance: Matrix6<f64>,
    /// Offset of each pair from nominal across its axis, for a plane along its normal, m.
    pub residuals: Vec<f64>,
    /// Standard uncertainty of the place of each pair about the frame of the drawing, as
    /// [`DatumPair::place_std`], m.
    pub place_stds: Vec<f64>,
}

/// Maximum number of steps; the search is Newton's, and begins near.
const MOST_STEPS: usize = 50;
/// Distance up to which features are in one place, m.
const LEAST_LEVER: f64 = 1e-9;
/// Motion of the features below which the search ends, m.
const STILL: f64 = 1e-10;

/// Fits the motion.
///
/// - `start`: from O into the frame of the drawing, good to some degrees.
/// - `stages`: indices of the pairs fitted together, in the order of the datums; a best fit has one
///   stage of all.
///
/// # Errors
/// [`DatumFitError`]
///
/// # Example
/// ```
/// # use nalgebra::{Isometry3, Point3, Vector3};
/// # use touchup_features::align::{DatumPair, fit_datums};
/// # use touchup_features::features::FeatureKind;
/// let pair = |kind, x: f64, y: f64| DatumPair {
///     kind,
///     nominal: Point3::new(x, y, 0.0),
///     nominal_axis: Some(Vector3::z()),
///     measured: Point3::new(x + 0.001, y, 0.0),
///     measured_axis: Vector3::z(),
///     place_std: 1e-5,
///     axis_std: Some(1e-3),
/// };
/// let pairs = [pair(FeatureKind::Plane, 0.0, 0.0), pair(FeatureKind::Hole, 0.01, 0.0), pair(FeatureKind::Hole, 0.05, 0.03)];
/// let fit = fit_datums(&pairs, &[vec![0], vec![1], vec![2]], &Isometry3::identity())?;
/// assert!((fit.motion.translation.vector - Vector3::new(-0.001, 0.0, 0.0)).norm() < 1e-9);
/// # Ok::<(), touchup_features::align::DatumFitError>(())
/// ```
pub fn fit_datums(
    pairs: &[DatumPair],
    stages: &[Vec<usize>],
    start: &Isometry3<f64>,
) -> Result<DatumFit, DatumFitError> {
    let middle = Point3::from(mean(pairs.iter().map(|pair| pair.measured.coords)));
    let lever = pairs
        .iter()
        .map(|pair| (pair.measured - middle).norm())
        .fold(0.0, f64::max);
    // for features in one place, which leave a turn open, any lever will do
    let lever = if lever > LEAST_LEVER { lever } else { 1.0 };
    if pairs.is_empty() {
        return Err(DatumFitError::Free {
            turns: Vec::new(),
            shifts: Vec::new(),
        });
    }
    let mut motion = *start;
    for _ in 0..MOST_STEPS {
        let centre = motion * middle;
        let equations = Equations::of(pairs, &motion, &centre, lever);
        let solution = Solution::of(&equations, stages).ok_or(DatumFitError::NotConverged)?;
        let step = solution.step(&equations);
        motion = moved(&motion, &centre, &step, lever);
        if !step.iter().all(|x| x.is_finite()) {
            break;
        }
        if step.norm() <= STILL {
            return fit_of(pairs, motion, &middle, stages, lever);
        }
    }
    Err(DatumFitError::NotConverged)
}

fn moved(
    motion: &Isometry3<f64>,
    centre: &Point3<f64>,
    step: &Vector6<f64>,
    lever: f64,
) -> Isometry3<f64> {
    let (shift, turn) = (
        step.fixed_rows::<3>(0).into_owned(),
        step.fixed_rows::<3>(3) / lever,
    );
    moved_by_twist(motion, centre, &shift, &turn)
}

fn fit_of(
    pairs: &[DatumPair],
    motion: Isometry3<f64>,
    middle: &Point3<f64>,
    stages: &[Vec<usize>],
    lever: f64,
) -> Result<DatumFit, DatumFitError> {
    let centre = motion * middle;
    let equations = Equations::of(pairs, &motion, &centre, lever);
    let solution = Solution::of(&equations, stages).ok_or(DatumFitError::NotConverged)?;
    solution.check_open()?;
    let gain = &solution.gain;
    let observed = DMatrix::from_diagonal(&equations.stds.map(|std| std * std));
    let scaled = gain * &observed * gain.transpose();
    let unscaled = Matrix6::from_diagonal(&Vector6::from_fn(
        |i, _| if i < 3 { 1.0 } else { 1.0 / lever },
    ));
    let covariance = unscaled * Matrix6::from_fn(|i, j| scaled[(i, j)]) * unscaled;
    let left = DMatrix::identity(equations.len(), equations.len()) - &equations.rows * gain;
    let left = &left * &observed * left.transpose();
    let places = |at: usize| equations.places(at);
    let root = |squares: f64| squares.max(0.0).sqrt();
    let residual = |at: usize| root(places(at).map(|row| equations.misfits[row].powi(2)).sum());
    let std = |at: usize| root(places(at).map(|row| left[(row, row)]).sum());
    Ok(DatumFit {
        motion,
        centre,
        covariance,
        residuals: (0..pairs.len()).map(residual).collect(),
        place_stds: (0..pairs.len()).map(std).collect(),
    })
}

impl DatumFit {
    /// Standard uncertainty of the place of a feature outside the fit, about the frame of the
    /// drawing: its own uncertainty and that of the frame there. As [`DatumPair::place_std`], m.
    ///
    /// - `place`, `axis`: in the frame of the drawing; the place in m.
    /// - `std`: own uncertainty of the feature.
    pub fn place_std(
        &self,
        kind: FeatureKind,
        place: &Point3<f64>,
        axis: &Vector3<f64>,
        std: f64,
    ) -> f64 {
        let rows = equations::place_rows(kind, axis, &(place - self.centre), 1.0);
        let of_frame: f64 = rows
            .iter()
            .map(|row| (row.transpose() * self.covariance * row)[0].max(0.0))
            .sum();
        std.hypot(of_frame.sqrt())
    }
}

#[cfg(test)]
mod tests;
