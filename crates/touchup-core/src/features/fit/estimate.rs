//! The result of a fit: a surface, and how well each of its numbers is known.

use nalgebra::{Matrix3, Point3, Vector3};

use super::solver::FreedomMatrix;
use super::{Freedom, Observation, Steps, Surface};

/// A direction is free of what is unknown when less than this share of it lies there; roundings of
/// the eigenvectors stay far below.
const KNOWN: f64 = 1e-6;

/// A fitted surface.
#[derive(Clone, Debug)]
pub struct Fit<M> {
    /// The surface of least squares, without the bias of curvature.
    pub surface: M,
    /// Covariance of its freedoms in their order, m and rad; without those that are undetermined.
    /// By the residuals in the directions in which they are larger than the stated deviations
    /// explain; where there are too few groups to ask them, by the stated ones, stretched by
    /// √(χ²/degrees) where that is above 1.
    pub covariance: FreedomMatrix,
    /// … of it without what all observations have in common: two surfaces touched alike differ by
    /// this alone.
    pub own_covariance: FreedomMatrix,
    /// For each observation whether it was kept.
    pub used: Vec<bool>,
    /// Σ w r² of what was kept, where groups count once.
    pub chi_squared: f64,
    /// Groups less unknowns: what χ² should be about.
    pub degrees: usize,
    /// Groups of which something was kept.
    pub groups: usize,
    /// projector onto what is not fixed, in units of `alone`
    pub(super) unknown: FreedomMatrix,
    /// the step of each freedom that changes the residuals by one standard deviation if taken alone
    pub(super) alone: Steps,
    /// columns: one standard deviation in each fixed direction, as steps; zero columns for what is
    /// not fixed
    pub(super) deviations: FreedomMatrix,
}

impl<M: Surface> Fit<M> {
    /// Root mean square distance of what was kept of the observations, m.
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

    /// Standard deviation of one freedom, m or rad; `None` where the observations do not fix it.
    pub fn std(&self, freedom: Freedom) -> Option<f64> {
        self.std_of(&Steps::ith(freedom as usize, 1.0))
    }

    /// Standard deviation of a number that changes with the freedoms as `by` says; `None` where it
    /// is not fixed.
    pub(crate) fn std_of(&self, by: &Steps) -> Option<f64> {
        self.std_in(&self.covariance, by)
    }

    /// As [`Self::std_of`], without what all observations have in common.
    pub(crate) fn own_std_of(&self, by: &Steps) -> Option<f64> {
        self.std_in(&self.own_covariance, by)
    }

    /// Standard deviation of the surface along its normal at a point of it given in O, m; `None`
    /// where it is not fixed.
    pub fn std_at(&self, point: &Point3<f64>) -> Option<f64> {
        let (_, by) = self.surface.derivatives(point);
        self.std_of(&by)
    }

    /// As [`Self::std_at`], without what all observations have in common.
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

    /// Standard deviation of a number, from its derivatives by some freedoms; `None` where it is
    /// not fixed.
    pub fn std_by(&self, by: &[(Freedom, f64)]) -> Option<f64> {
        let mut steps = Steps::zeros();
        by.iter()
            .for_each(|(freedom, x)| steps[*freedom as usize] += x);
        self.std_of(&steps)
    }

    /// Angle by which the axis may be off, rad: root of the sum of both variances.
    pub fn axis_std(&self) -> Option<f64> {
        Some(self.std(Freedom::TiltX)?.hypot(self.std(Freedom::TiltY)?))
    }

    /// Covariance in O of the place where the axis is `height` above the origin of F, m²; none
    /// along the axis. `None` where it is not fixed.
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
