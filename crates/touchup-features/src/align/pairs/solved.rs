//! Pairs, and the motion of least squares between them.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Rotation3, SVD, UnitQuaternion, Vector3};

/// Ratio of the residuals' standard deviation to a given one from which the residuals decide: with
/// three pairs once in 130.
const LARGEST_SIGMA_RATIO: f64 = 2.0;

/// One point seen twice, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPair {
    /// Its place before the motion: on the scan, in O.
    pub from: Point3<f64>,
    /// Its place after the motion: in space, in W.
    pub to: Point3<f64>,
    /// Standard deviation of the two together, per axis, m; `None`: as good as the others.
    pub sigma: Option<f64>,
}

/// Settings of [`super::fit_pairs`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairsParams {
    /// Standard deviation of pairs without their own, per axis, m; `None`: from the residuals.
    pub sigma: Option<f64>,
    /// Largest allowed rms residual, m; never more than a tenth of the points' scatter. Default 3
    /// mm: a pick on a scan of a consumer camera is good to one or two.
    pub largest_rms: f64,
    /// Offset below which a pair stays, however well the others agree, m. Default 0.2 mm: no one
    /// picks better. Four times a given sigma takes its place.
    pub least_misfit: f64,
}

impl Default for PairsParams {
    fn default() -> Self {
        Self {
            sigma: None,
            largest_rms: 3e-3,
            least_misfit: 0.2e-3,
        }
    }
}

/// A motion from pairs, and its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct PairsFit {
    /// Maps `from` to `to`.
    pub motion: Isometry3<f64>,
    /// `to` − motion · `from` of each pair, m.
    pub residuals: Vec<Vector3<f64>>,
    /// √(mean |residual|²), m.
    pub rms: f64,
    /// Standard deviation of a pair of unit weight, per axis, m: as given, or from the residuals
    /// with 3 n − 6 degrees of freedom if none is given or they say more than twice as much.
    pub sigma: f64,
    /// Middle of the pairs, in the frame of `to`, m.
    pub centroid: Point3<f64>,
    /// Covariance of (shift of the centroid, rotation vector about it), both in the frame of `to`;
    /// m², m·rad, rad².
    pub covariance: Matrix6<f64>,
}

/// A best motion with its measures of quality.
pub(super) struct SolvedMotion {
    pub motion: Isometry3<f64>,
    /// Weighted middle of `from`.
    pub middle: Point3<f64>,
    /// Σ w |residual|².
    pub squares: f64,
    /// The same for the best mirror image or motion.
    pub mirrored_squares: f64,
}

impl SolvedMotion {
    /// - `without`: index of a pair to leave out.
    pub(crate) fn of(pairs: &[PointPair], weights: &[f64], without: Option<usize>) -> Option<Self> {
        let kept = || {
            pairs
                .iter()
                .zip(weights)
                .enumerate()
                .filter(|(i, _)| Some(*i) != without)
                .map(|(_, pair)| pair)
        };
        let total: f64 = kept().map(|(_, w)| w).sum();
        let mean = |side: fn(&PointPair) -> Point3<f64>| {
            Point3::from(
                kept()
                    .map(|(pair, w)| side(pair).coords * *w)
                    .sum::<Vector3<f64>>()
                    / total,
            )
        };
        let (a, b) = (mean(|pair| pair.from), mean(|pair| pair.to));
        let cross: Matrix3<f64> = kept()
            .map(|(p, w)| (p.to - b) * (p.from - a).transpose() * *w)
            .sum();
        let svd = SVD::try_new(cross, true, true, f64::EPSILON, 1000)?;
        let (u, v_t) = (svd.u?, svd.v_t?);
        let smallest = svd.singular_values.imin();
        let mut signs = Vector3::repeat(1.0);
        signs[smallest] = (u.determinant() * v_t.determinant()).signum();
        let turn = u * Matrix3::from_diagonal(&signs) * v_t;
        let mut rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        rotation.renormalize();
        let motion = Isometry3::from_parts((b - rotation * a.coords).into(), rotation);
        let [squares, mirrored_squares] =
            [motion.rotation.to_rotation_matrix().into_inner(), u * v_t].map(|turn| {
                kept()
                    .map(|(p, w)| w * ((p.to - b) - turn * (p.from - a)).norm_squared())
                    .sum::<f64>()
            });
        squares.is_finite().then_some(Self {
            motion,
            middle: a,
            squares,
            mirrored_squares,
        })
    }

    pub(crate) fn fit(&self, pairs: &[PointPair], weights: &[f64], given: Option<f64>) -> PairsFit {
        let residuals: Vec<_> = pairs.iter().map(|p| p.to - self.motion * p.from).collect();
        let n = pairs.len() as f64;
        let rms = (residuals.iter().map(Vector3::norm_squared).sum::<f64>() / n).sqrt();
        let seen = (self.squares / (3.0 * n - 6.0)).sqrt();
        let sigma = given
            .filter(|given| seen <= LARGEST_SIGMA_RATIO * given)
            .unwrap_or(seen);
        let inertia: Matrix3<f64> = pairs
            .iter()
            .zip(weights)
            .map(|(pair, w)| {
                let q = self.motion.rotation * (pair.from - self.middle);
                (Matrix3::identity() * q.norm_squared() - q * q.transpose()) * *w
            })
            .sum();
        let mut covariance = Matrix6::zeros();
        let shift = Matrix3::identity() / weights.iter().sum::<f64>();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&shift);
        // not singular: the points are on no line
        covariance
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&inertia.try_inverse().unwrap_or_default());
        let centroid = self.motion * self.middle;
        PairsFit {
            motion: self.motion,
            residuals,
            rms,
            sigma,
            centroid,
            covariance: covariance * (sigma * sigma),
        }
    }
}
