//! The result of a fit: a surface, and the uncertainty of each of its freedoms.

use nalgebra::{Matrix3, Point3, Vector3};

use super::solver::FreedomMatrix;
use super::{Freedom, Observation, Steps, SurfaceModel};

/// Maximum share of a direction in undetermined ones if it is determined; roundings of the
/// eigenvectors stay far below.
const KNOWN: f64 = 1e-6;

/// A fitted surface.
#[derive(Clone, Debug)]
pub struct Fit<M> {
    /// The surface of least squares, without the bias of curvature.
    pub surface: M,
    /// Covariance of the freedoms in their order, m and rad; without undetermined ones. From the
    /// residuals in directions in which they exceed the stated deviations; with too few groups from
    /// the stated ones, stretched by √(χ²/degrees) if above 1.
    pub covariance: FreedomMatrix,
    /// Covariance without the common errors of all observations: the difference of two surfaces
    /// with the same touches has this part alone.
    pub own_covariance: FreedomMatrix,
    /// For each observation whether it was kept.
    pub used: Vec<bool>,
    /// Σ w r² of the kept observations; a group counts once.
    pub chi_squared: f64,
    /// Groups less unknowns: the expectation of χ².
    pub degrees: usize,
    /// Number of groups with kept observations.
    pub groups: usize,
    /// projector onto undetermined directions, in units of `alone`
    pub(super) unknown: FreedomMatrix,
    /// step of each freedom that alone changes the residuals by one standard deviation
    pub(super) alone: Steps,
    /// columns: one standard deviation in each fixed direction, as steps; zero columns for
    /// undetermined directions
    pub(super) deviations: FreedomMatrix,
}

impl<M: SurfaceModel> Fit<M> {
    /// Root mean square residual of the kept observations, m.
    pub(crate) fn unevenness(&self, observations: &[Observation]) -> f64 {
        let used = observations
            .iter()
            .zip(&self.used)
            .filter(|(_, used)| **used);
        let (squares, count) = used.fold((0.0, 0.0), |(squares, count), (o, _)| {
            let off = self.surface.distance(&o.point) - o.offset;
            (squares + off * off, count + 1.0)
        });
        f64::sqrt(squares / f64::max(count, 1.0))
    }

    /// Standard deviation of one freedom, m or rad; `None` if undetermined.
    pub fn std(&self, freedom: Freedom) -> Option<f64> {
        self.std_of(&Steps::ith(freedom as usize, 1.0))
    }

    /// Standard deviation of a number with the derivatives `by`; `None` if undetermined.
    pub fn std_of(&self, by: &Steps) -> Option<f64> {
        self.std_in(&self.covariance, by)
    }

    /// As [`Self::std_of`], without the common errors of all observations.
    pub(crate) fn own_std_of(&self, by: &Steps) -> Option<f64> {
        self.std_in(&self.own_covariance, by)
    }

    /// Standard deviation of the surface along its normal at a point on it, m, in O; `None` if
    /// undetermined.
    pub fn std_at(&self, point: &Point3<f64>) -> Option<f64> {
        let (_, by) = self.surface.derivatives(point);
        self.std_of(&by)
    }

    /// As [`Self::std_at`], without the common errors of all observations.
    pub(crate) fn own_std_at(&self, point: &Point3<f64>) -> Option<f64> {
        let (_, by) = self.surface.derivatives(point);
        self.own_std_of(&by)
    }

    fn std_in(&self, covariance: &FreedomMatrix, by: &Steps) -> Option<f64> {
        let has_all = (0..by.len()).all(|i| by[i] == 0.0 || M::FREE[i]);
        let scaled = by.component_mul(&self.alone);
        let is_fixed = (self.unknown * scaled).norm() <= KNOWN * scaled.norm();
        (has_all && is_fixed).then(|| by.dot(&(covariance * by)).max(0.0).sqrt())
    }

    /// Standard deviation of a number, from its derivatives by some freedoms; `None` if
    /// undetermined.
    pub fn std_by(&self, by: &[(Freedom, f64)]) -> Option<f64> {
        let mut steps = Steps::zeros();
        by.iter()
            .for_each(|(freedom, x)| steps[*freedom as usize] += x);
        self.std_of(&steps)
    }

    /// Angular uncertainty of the axis, rad: root of the sum of both variances.
    pub fn axis_std(&self) -> Option<f64> {
        Some(self.std(Freedom::TiltX)?.hypot(self.std(Freedom::TiltY)?))
    }

    /// Covariance in O of the point on the axis at `height` above the origin of F, m²; 0 along the
    /// axis. `None` if undetermined.
    pub fn center_covariance(&self, height: f64) -> Option<Matrix3<f64>> {
        let lever = |shift: Freedom, tilt: Freedom| {
            let mut by = Steps::ith(shift as usize, 1.0);
            if height != 0.0 {
                by[tilt as usize] = height;
            }
            by
        };
        let by = [
            lever(Freedom::X, Freedom::TiltX),
            lever(Freedom::Y, Freedom::TiltY),
        ];
        by.iter().try_for_each(|by| self.std_of(by).map(|_| ()))?;
        let r = self.surface.pose_of().rotation;
        let axes = [r * Vector3::x(), r * Vector3::y()];
        let entry = |i: usize, j: usize| {
            axes[i] * axes[j].transpose() * by[i].dot(&(self.covariance * by[j]))
        };
        Some(entry(0, 0) + entry(0, 1) + entry(1, 0) + entry(1, 1))
    }
}
