//! Linear equations of a small motion from pairs of features.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{DMatrix, DVector, Isometry3, Point3, UnitQuaternion, Vector3, Vector6};

use super::pair::DatumPair;
use crate::features::FeatureKind;
use touchup_geometry::numeric::{point_to_plane_row, tangent_basis};

/// Lower bound of standard uncertainties, m.
const LEAST_STD: f64 = 1e-9;

/// Equations of all pairs: misfit + rows · step = 0, in m, with turns as the shift at the lever.
pub(super) struct Equations {
    /// A
    pub rows: DMatrix<f64>,
    /// y
    pub misfits: DVector<f64>,
    /// standard uncertainties of the misfits
    pub stds: DVector<f64>,
    /// rows of each pair, and the number of them for its place
    of_pair: Vec<(Range<usize>, usize)>,
}

/// Change of a place across its axis, or of a plane along its normal, with a small motion.
///
/// - `arm`: from the centre of the turn.
pub(super) fn place_rows(
    kind: FeatureKind,
    axis: &Vector3<f64>,
    arm: &Vector3<f64>,
    lever: f64,
) -> Vec<Vector6<f64>> {
    place_directions(kind, axis)
        .iter()
        .map(|along| point_to_plane_row(arm, along, lever))
        .collect()
}

fn place_directions(kind: FeatureKind, axis: &Vector3<f64>) -> Vec<Vector3<f64>> {
    if kind == FeatureKind::Plane {
        vec![*axis]
    } else {
        tangent_basis(axis).to_vec()
    }
}

/// The rotation vector of the shortest turn from one unit vector onto another; its length is the
/// remaining angle, of any size.
fn turn_between(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let half_a_turn = || tangent_basis(from)[0] * PI;
    UnitQuaternion::rotation_between(from, to).map_or_else(half_a_turn, |turn| turn.scaled_axis())
}

impl Equations {
    pub(crate) fn of(
        pairs: &[DatumPair],
        motion: &Isometry3<f64>,
        centre: &Point3<f64>,
        lever: f64,
    ) -> Self {
        let mut all: Vec<(Vector6<f64>, f64, f64)> = Vec::new();
        let mut of_pair = Vec::new();
        for pair in pairs {
            let first = all.len();
            let (place, axis) = (motion * pair.measured, motion * pair.measured_axis);
            let (arm, off) = (place - centre, place - pair.nominal);
            let across = pair.nominal_axis.unwrap_or(axis);
            let along = place_directions(pair.kind, &across);
            // these coordinates share the uncertainty
            let std = pair.place_std / (along.len() as f64).sqrt();
            all.extend(
                along
                    .iter()
                    .map(|along| (point_to_plane_row(&arm, along, lever), along.dot(&off), std)),
            );
            let places = all.len() - first;
            if let Some((nominal, std)) = pair.nominal_axis.zip(pair.axis_std) {
                // the sign of an axis does not matter, the side of a plane does
                let is_turned = pair.kind != FeatureKind::Plane && axis.dot(&nominal) < 0.0;
                let axis = if is_turned { -axis } else { axis };
                let needed = turn_between(&axis, &nominal);
                all.extend(tangent_basis(&axis).iter().map(|about| {
                    let row = Vector6::new(0.0, 0.0, 0.0, about.x, about.y, about.z);
                    (row, -lever * about.dot(&needed), lever * std / 2f64.sqrt())
                }));
            }
            of_pair.push((first..all.len(), places));
        }
        Self {
            // no measurement is better, and no weight is infinite
            stds: DVector::from_iterator(all.len(), all.iter().map(|(.., std)| std.max(LEAST_STD))),
            rows: DMatrix::from_fn(all.len(), 6, |i, j| all[i].0[j]),
            misfits: DVector::from_iterator(all.len(), all.iter().map(|(_, misfit, _)| *misfit)),
            of_pair,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.nrows()
    }

    /// Rows of a pair.
    pub(crate) fn all(&self, pair: usize) -> Range<usize> {
        self.of_pair[pair].0.clone()
    }

    /// Rows of the place of a pair.
    pub(crate) fn places(&self, pair: usize) -> Range<usize> {
        let (rows, places) = &self.of_pair[pair];
        rows.start..rows.start + places
    }
}
