//! Offset of the whole scan from the touches: a small rigid motion, and a surface offset.
//!
//! At a place x with the normal n touch − scan is b + n·s + ((x − c) × n)·θ; b, s and θ by least
//! squares with Tukey's weights, s and θ slightly regularised, so that undetermined parts go to b.
//! Correlated noise tilts a scan too: the motion is significant if it explains more than noise of n
//! independent places does once in a thousand times.

use std::f64::consts::TAU;

use nalgebra::{Matrix6, Point3, SMatrix, SVector, Vector3, Vector6};

use super::places::VertexProperties;
use super::scanner::Scanner;
use touchup_geometry::numeric::{
    NormalEquations, SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, centroid_and_spread, median,
    point_to_plane_row,
};

/// Motion of the scan to the touches, for small angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidOffset {
    /// shift that would bring the scan onto the touches, m, at `centre`
    pub shift: Vector3<f64>,
    /// and rotation vector, rad
    pub turn: Vector3<f64>,
    /// middle of the touched places, m
    pub centre: Point3<f64>,
    /// standard deviation of `shift` on each axis, m
    pub shift_sigma: Vector3<f64>,
    /// standard deviation of `turn` about each axis, rad
    pub turn_sigma: Vector3<f64>,
}

/// Rounds of weights.
const ROUNDS: usize = 10;
/// Regularisation of shift and turn, as a share of the weight of all places.
const HELD_BACK: f64 = 0.03;
/// Squares of one to six normal numbers sum up to more than this once in a thousand times.
const ONCE_IN_1000: [f64; 6] = [10.83, 13.82, 16.27, 18.47, 20.52, 22.46];
/// Correction for noise known from m places more than there are unknowns: the bound is 1 + 12/m
/// times as high, within 3 % of the F distribution from 13 on.
const FEW_PLACES: f64 = 12.0;
/// Unknowns: an offset, a shift, a turn.
const UNKNOWNS: f64 = 7.0;
/// Maximum relative variance of a direction that only the regularisation determines.
const HELD: f64 = 1e-9;

/// A fitted motion, perhaps of noise alone.
pub(super) struct OffsetFit {
    shift: Vector3<f64>,
    turn: Vector3<f64>,
    centre: Point3<f64>,
    lever: f64,
    /// covariance of shift and turn times `lever` for noise of 1 m that is independent from m² to
    /// m², m²·m²
    spread: Matrix6<f64>,
    /// m²
    area: f64,
}

impl OffsetFit {
    /// Fits the open places; `None` if they determine nothing.
    pub(crate) fn of(places: &VertexProperties) -> Option<Self> {
        let open = places.open();
        let (centre, lever) = centroid_and_spread(open.iter().map(|&at| &places.positions[at]));
        let row = |&at: &usize| {
            let arm = places.positions[at] - centre;
            (
                point_to_plane_row(&arm, &places.normals[at], lever).insert_row(0, 1.0),
                places.off[at],
            )
        };
        let mut x = SVector::<f64, 7>::zeros();
        let mut width = f64::INFINITY;
        let mut spread = SMatrix::<f64, 7, 7>::zeros();
        for _ in 0..ROUNDS {
            let (mut equations, mut sizes) =
                (NormalEquations::default(), Vec::with_capacity(open.len()));
            let weights = equations.add_reweighted(open.iter().map(row), &x, |at, left| {
                sizes.push(left.abs());
                biweight((left / width).powi(2)) * places.areas[open[at]]
            });
            let mut held = equations.information;
            (1..7).for_each(|i| held[(i, i)] += HELD_BACK * weights);
            let inverse = held.cholesky()?.inverse();
            x = inverse * equations.right;
            spread = inverse * equations.information * inverse;
            width = TUKEY_WIDTH * SIGMA_OF_MEDIAN * median(&mut sizes)?;
            if width <= 0.0 {
                break;
            }
        }
        let is_finite = x.iter().chain(&spread).all(|x| x.is_finite());
        let (shift, turn) = (
            Vector3::new(x[1], x[2], x[3]),
            Vector3::new(x[4], x[5], x[6]) / lever,
        );
        let area = open.iter().map(|&at| places.areas[at]).sum();
        let spread = spread.fixed_view::<6, 6>(1, 1).into_owned();
        is_finite.then_some(Self {
            shift,
            turn,
            centre,
            lever,
            spread,
            area,
        })
    }

    /// Part of touch − scan that it explains at a place, m.
    pub(crate) fn at(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        normal.dot(&(self.shift + self.turn.cross(&(p - self.centre))))
    }

    /// The motion, if it is significant against the noise.
    ///
    /// - `scanner`: without the motion.
    pub(crate) fn significant(&self, scanner: &Scanner) -> Option<RigidOffset> {
        let alike = TAU * scanner.correlation.powi(2);
        let more = self.area / alike - UNKNOWNS;
        if more <= 0.0 {
            return None;
        }
        // correction for the noise that the fit absorbed
        let variance = scanner.noise.powi(2) * (1.0 + UNKNOWNS / more);
        let covariance = self.spread * (variance * alike);
        let turn = self.turn * self.lever;
        let motion = Vector6::new(
            self.shift.x,
            self.shift.y,
            self.shift.z,
            turn.x,
            turn.y,
            turn.z,
        );
        let eigen = covariance.symmetric_eigen();
        let least = HELD * eigen.eigenvalues.max();
        let (mut square, mut directions) = (0.0, 0);
        for (value, direction) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *value > least {
                square += direction.dot(&motion).powi(2) / value;
                directions += 1;
            }
        }
        let bound = ONCE_IN_1000[usize::max(directions, 1) - 1] * (1.0 + FEW_PLACES / more);
        let sigmas = covariance.diagonal().map(f64::sqrt);
        (square > bound).then(|| RigidOffset {
            shift: self.shift,
            turn: self.turn,
            centre: self.centre,
            shift_sigma: sigmas.fixed_rows::<3>(0).into_owned(),
            turn_sigma: sigmas.fixed_rows::<3>(3) / self.lever,
        })
    }
}
