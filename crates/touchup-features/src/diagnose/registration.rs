//! Checks the registration of the scan: presses on a slightly turned or shifted scan all lie within
//! the scan's error, but a rigid motion explains their offsets.
//!
//! A press straight on the scan has its centre one radius off it. Least squares find the small
//! motion of all centres that brings them there, and another radius. The variation of the motion
//! from place to place, along the normals, stands against the scan's noise; the jackknife over
//! places gives its uncertainty.

use std::collections::BTreeMap;

use nalgebra::SVector;

use super::finding::{InputCause, InputFinding};
use super::judge::{
    DOUBTED_NOISES, InputJudge, LARGEST_SCAN_NOISE, LEAST_BALL, PLACE_EDGES, Presses, SURE_NOISES,
    StraightPress,
};
use super::placed::{FRAME_REMEDY, SHIFTED_SHARE};
use super::places::LEAST_TOLERANCE;
use touchup_geometry::numeric::{
    NormalEquations, SIGMA_OF_MEDIAN, VoxelKey, jackknife_variance, mean, median,
    point_to_plane_row, voxel_of,
};

/// Shift, turn, and radius.
const NUMBERS: usize = 7;
/// Minimum number of places: two for each unknown.
const FEWEST_PLACES: usize = 2 * NUMBERS;
/// Damping that keeps undetermined unknowns at zero.
const DAMPING: f64 = 1e-3;
/// Minimum size of a motion in its standard uncertainties.
const CLEAR_ERRORS: f64 = 3.0;

/// Shift, turn and radius as one vector.
type RegistrationUnknowns = SVector<f64, NUMBERS>;

/// The motion, and its variation along the normals: root mean square about its mean, m.
///
/// - `all`: equations of all places; `some`: of the fitted places.
fn motion(
    all: &NormalEquations<NUMBERS>,
    some: NormalEquations<NUMBERS>,
) -> Option<(RegistrationUnknowns, f64)> {
    let found = some.damped(DAMPING).solution()?;
    let mut moved = found;
    moved[6] = 0.0;
    let means = all.information * moved / all.information[(6, 6)];
    Some((
        found,
        (moved.dot(&means) - means[6].powi(2)).max(0.0).sqrt(),
    ))
}

/// Standard deviation of the residuals about their median, m.
fn deviation(left: impl Iterator<Item = f64>) -> f64 {
    let mut left: Vec<f64> = left.collect();
    let middle = median(&mut left).unwrap_or(0.0);
    left.iter_mut().for_each(|x| *x = (*x - middle).abs());
    SIGMA_OF_MEDIAN * median(&mut left).unwrap_or(0.0)
}

impl InputJudge<'_> {
    /// A scan turned or shifted from its stated pose.
    pub(crate) fn judge_registration(&self, presses: &Presses) -> Option<InputFinding> {
        let straight = self.straight_presses(presses);
        let radius = self.params.tip.radius;
        let middle = mean(straight.iter().map(|press| press.centre.coords));
        let row = |press: &StraightPress| {
            let arm = press.centre.coords - middle;
            point_to_plane_row(&arm, &press.normal, 1.0).push(1.0)
        };
        let rows: Vec<(RegistrationUnknowns, f64)> = straight
            .iter()
            .map(|press| (row(press), radius - press.distance))
            .collect();
        let width = PLACE_EDGES * presses.scale.edge.max(LEAST_BALL);
        let mut places: BTreeMap<VoxelKey, NormalEquations<NUMBERS>> = BTreeMap::new();
        for (press, (row, off)) in straight.iter().zip(&rows) {
            let place = places.entry(voxel_of(&press.centre, width)).or_default();
            place.add(row, *off, 1.0);
        }
        if places.len() < FEWEST_PLACES {
            return None;
        }
        let all = NormalEquations::of(rows.iter().copied());
        let (found, moved) = motion(&all, all)?;
        let without: Vec<f64> = places
            .values()
            .map(|place| Some(motion(&all, all.without(place))?.1))
            .collect::<Option<_>>()?;
        let error = jackknife_variance(&without).sqrt();
        let before = deviation(rows.iter().map(|(_, off)| *off));
        let left = || rows.iter().map(|(row, off)| off - row.dot(&found));
        let after = deviation(left());
        // a motion that follows a few outliers brings most centres no nearer
        let explained = (before.powi(2) - after.powi(2)).max(0.0).sqrt();
        let off = explained.min(moved - CLEAR_ERRORS * error);
        let noise = presses.scale.noise.max(self.params.scan_noise);
        let noise = noise.min(LARGEST_SCAN_NOISE);
        let near = presses.tolerance + presses.sunk;
        let on_scan = left().filter(|left| left.abs() <= near).count();
        let is_one = on_scan as f64 >= SHIFTED_SHARE * rows.len() as f64
            && off > (DOUBTED_NOISES * noise).max(LEAST_TOLERANCE);
        let is_sure = off > (SURE_NOISES * noise).max(2.0 * LEAST_TOLERANCE);
        let measured = format!(
            "where the ball presses, its distances from the scan deviate by {:.2} mm, and by {:.2} mm once a turn and a shift of all contacts are taken off",
            before * 1e3,
            after * 1e3
        );
        is_one.then(|| InputFinding::new(InputCause::Frame, is_sure, measured, FRAME_REMEDY))
    }
}
