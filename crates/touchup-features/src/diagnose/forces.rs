//! Findings from forces alone: rest, noise, and pressing samples.

use nalgebra::{SMatrix, Vector3, Vector6};

use super::input_record::InputRecord;
use touchup_geometry::numeric::{NormalEquations, quantile};

/// Samples tried as the rest.
const REST_CANDIDATES: usize = 64;
/// Minimum share of all samples around the rest.
const REST_SHARE: f64 = 0.05;
/// Minimum force of a press above the rest, in noise deviations.
pub(super) const NOISES: f64 = 8.0;
/// Minimum force of a press above the rest, as a share of the largest.
const SHARE_OF_LARGEST: f64 = 0.25;

/// Force levels in the axes of T, N.
#[derive(Clone, Copy, Debug)]
pub(super) struct ForceLevels {
    /// most frequent force: that of free motion, if there is any
    pub rest_t: Vector3<f64>,
    /// standard deviation of one axis
    pub noise: f64,
    /// 95th percentile of the distance from the rest
    pub largest: f64,
}

impl ForceLevels {
    /// The rest is the densest force: presses scatter wider than free motion.
    pub(crate) fn of(records: &[InputRecord], noise: f64) -> Self {
        let forces: Vec<Vector3<f64>> = records.iter().map(InputRecord::force_t).collect();
        let step = (forces.len() / REST_CANDIDATES).max(1);
        let distances = |from: &Vector3<f64>| {
            let mut distances: Vec<f64> =
                forces.iter().map(|force| (force - from).norm()).collect();
            distances.sort_unstable_by(f64::total_cmp);
            distances
        };
        let width = |from: &Vector3<f64>| quantile(&distances(from), REST_SHARE);
        let candidates = forces
            .iter()
            .step_by(step)
            .map(|force| (width(force), *force));
        let peak = candidates
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or_else(Vector3::zeros, |(_, force)| force);
        let reach = (4.0 * noise).max(1.5 * width(&peak));
        let around: Vec<&Vector3<f64>> = forces
            .iter()
            .filter(|force| (*force - peak).norm() <= reach)
            .collect();
        let rest_t = around.iter().copied().sum::<Vector3<f64>>() / around.len().max(1) as f64;
        Self {
            largest: quantile(&distances(&rest_t), 0.95),
            rest_t,
            noise,
        }
    }

    /// The same with a rest of zero.
    pub(crate) fn without_rest(self, records: &[InputRecord]) -> Self {
        let mut sizes: Vec<f64> = records.iter().map(|record| record.force_o.norm()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        Self {
            rest_t: Vector3::zeros(),
            largest: quantile(&sizes, 0.95),
            ..self
        }
    }

    /// |F − rest|, N.
    pub(crate) fn off_rest(&self, record: &InputRecord) -> f64 {
        (record.force_t() - self.rest_t).norm()
    }

    /// F − rest in O, N.
    pub(crate) fn force_o(&self, record: &InputRecord) -> Vector3<f64> {
        record.force_o - record.rotation * self.rest_t
    }

    pub(crate) fn is_pressing(&self, record: &InputRecord) -> bool {
        self.off_rest(record) > (NOISES * self.noise).max(SHARE_OF_LARGEST * self.largest)
    }

    pub(crate) fn is_resting(&self, record: &InputRecord) -> bool {
        self.off_rest(record) <= (4.0 * self.noise).max(0.05 * self.largest)
    }
}

/// Force of a sensor in free motion: its zero b and its weight w, F_T = b + Rᵀ w.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorWeight {
    /// mean of zero and weight together, N
    pub mean_t: Vector3<f64>,
    /// mean of their length, N
    pub size: f64,
    /// 95th percentile of the residual force, N
    pub left: f64,
}

/// Damping that chooses the smallest zero and weight if the stylus hardly turns.
const DAMPING: f64 = 1e-6;

impl SensorWeight {
    pub(crate) fn of(records: &[InputRecord]) -> Option<Self> {
        let turned = |record: &InputRecord| {
            let back = record.rotation.inverse().to_rotation_matrix();
            let mut rows = SMatrix::<f64, 3, 6>::zeros();
            rows.fixed_columns_mut::<3>(0).fill_with_identity();
            rows.fixed_columns_mut::<3>(3).copy_from(back.matrix());
            rows
        };
        let rows = records.iter().flat_map(|record| {
            let (rows, force) = (turned(record), record.force_t());
            (0..3).map(move |axis| (Vector6::from(rows.row(axis).transpose()), force[axis]))
        });
        let both = NormalEquations::of(rows).damped(DAMPING).solution()?;
        let predicted: Vec<Vector3<f64>> =
            records.iter().map(|record| turned(record) * both).collect();
        let mut left: Vec<f64> = records
            .iter()
            .zip(&predicted)
            .map(|(record, predicted)| (record.force_t() - predicted).norm())
            .collect();
        left.sort_unstable_by(f64::total_cmp);
        let count = records.len() as f64;
        Some(Self {
            mean_t: predicted.iter().sum::<Vector3<f64>>() / count,
            size: predicted.iter().map(Vector3::norm).sum::<f64>() / count,
            left: quantile(&left, 0.95),
        })
    }
}

/// The 48 signed permutations of three axes, the identity first.
pub(super) fn signed_permutations() -> impl Iterator<Item = nalgebra::Matrix3<f64>> {
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [1, 0, 2],
        [0, 2, 1],
        [2, 1, 0],
    ];
    ORDERS.into_iter().flat_map(|order| {
        (0..8u8).map(move |signs| {
            nalgebra::Matrix3::from_fn(|row, column| {
                let sign = if signs >> row & 1 == 1 { -1.0 } else { 1.0 };
                if order[row] == column { sign } else { 0.0 }
            })
        })
    })
}

/// Axes in words, as a wrench or position reads them: (x, −z, y).
pub(super) fn axes_in_words(axes: &nalgebra::Matrix3<f64>) -> String {
    let name = |row: usize| {
        let column = (0..3)
            .find(|&column| axes[(row, column)] != 0.0)
            .unwrap_or(0);
        format!(
            "{}{}",
            if axes[(row, column)] < 0.0 { "−" } else { "" },
            ["x", "y", "z"][column]
        )
    };
    format!("({}, {}, {})", name(0), name(1), name(2))
}
