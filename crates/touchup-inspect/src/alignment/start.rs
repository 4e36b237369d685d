//! Coarse pose of the part relative to the drawing, from any initial pose.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::error::AlignmentError;
use crate::drawn_feature::DrawnFeature;
use touchup_features::align::{DatumFit, DatumPair, FeaturesParams, align_features, fit_datums};
use touchup_features::features::{Feature, FeatureKind};

/// Two motions are equal if their rotations differ by at most this angle, rad.
const SAME_TURN: f64 = 0.05;
/// Cosine of the largest angle between a measured axis and its nominal one: 10°.
const ALONG: f64 = 0.985;

/// Kinds whose axis serves the alignment.
pub(super) fn is_aligned_by(kind: FeatureKind) -> bool {
    matches!(
        kind,
        FeatureKind::Hole
            | FeatureKind::Slot
            | FeatureKind::Pocket
            | FeatureKind::Boss
            | FeatureKind::Cylinder
            | FeatureKind::Plane
    )
}

/// Motion of the measured features onto the drawing, from the pattern of all features.
///
/// # Errors
/// [`AlignmentError::NotFound`]
pub(super) fn start_of_pattern(
    drawn: &[DrawnFeature],
    measured: &[Feature],
) -> Result<Isometry3<f64>, AlignmentError> {
    let is_used = |feature: &&Feature| is_aligned_by(feature.kind);
    let own: Vec<Feature> = measured.iter().filter(is_used).cloned().collect();
    let placed = drawn
        .iter()
        .filter(|one| one.has_place)
        .map(|one| &one.shape);
    let theirs: Vec<Feature> = placed.filter(is_used).cloned().collect();
    let found = align_features(&own, &theirs, None, &FeaturesParams::default());
    found
        .map(|found| found.source_to_target)
        .map_err(AlignmentError::NotFound)
}

/// Motion from features that the drawing names: tries the fit from all quarter turns and takes the
/// one solution.
///
/// - `reach`: largest distance of a feature from its nominal place, m.
///
/// # Errors
/// [`AlignmentError::Named`], and errors of [`fit_datums`].
pub(super) fn start_of_named(
    pairs: &[DatumPair],
    reach: f64,
    open: impl Fn(touchup_features::align::DatumFitError) -> AlignmentError,
) -> Result<Isometry3<f64>, AlignmentError> {
    let mut fits: Vec<DatumFit> = Vec::new();
    let mut why = None;
    for turn in quarter_turns() {
        match fit_datums(
            pairs,
            &[(0..pairs.len()).collect()],
            &over_one_another(pairs, turn),
        ) {
            Ok(fit) => {
                let fits_drawing = fit.residuals.iter().all(|residual| *residual <= reach)
                    && keeps_axes(pairs, &fit);
                let is_new = |other: &DatumFit| {
                    fit.motion.rotation.angle_to(&other.motion.rotation) > SAME_TURN
                };
                if fits_drawing && fits.iter().all(is_new) {
                    fits.push(fit);
                }
            }
            Err(error) => why = Some(error),
        }
    }
    match (&*fits, why) {
        ([fit], _) => Ok(fit.motion),
        ([], Some(error)) => Err(open(error)),
        (fits, _) => Err(AlignmentError::Named { count: fits.len() }),
    }
}

/// Whether axes and plane normals agree with the drawing.
fn keeps_axes(pairs: &[DatumPair], fit: &DatumFit) -> bool {
    let is_kept = |pair: &DatumPair| {
        let cosine = pair
            .nominal_axis
            .map(|axis| (fit.motion * pair.measured_axis).dot(&axis));
        cosine.is_none_or(|cosine| {
            if pair.kind == FeatureKind::Plane {
                cosine > ALONG
            } else {
                cosine.abs() > ALONG
            }
        })
    };
    pairs.iter().all(is_kept)
}

/// A turn about the middle of the measured places, moved onto the middle of the nominal ones.
fn over_one_another(pairs: &[DatumPair], turn: UnitQuaternion<f64>) -> Isometry3<f64> {
    let middle = |place: fn(&DatumPair) -> Point3<f64>| {
        pairs
            .iter()
            .map(|pair| place(pair).coords)
            .sum::<Vector3<f64>>()
            / pairs.len().max(1) as f64
    };
    let (from, to) = (middle(|pair| pair.measured), middle(|pair| pair.nominal));
    Isometry3::from_parts(Translation3::from(to - turn * from), turn)
}

/// The 24 rotations of a cube.
fn quarter_turns() -> Vec<UnitQuaternion<f64>> {
    let about = |axis: Vector3<f64>, quarters: u32| {
        UnitQuaternion::from_scaled_axis(axis * (FRAC_PI_2 * f64::from(quarters)))
    };
    let tops = (0..4)
        .map(|quarters| about(Vector3::x(), quarters))
        .chain([1, 3].map(|quarters| about(Vector3::y(), quarters)));
    tops.flat_map(|top| (0..4).map(move |quarters| top * about(Vector3::z(), quarters)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_has_24_turns_and_none_twice() {
        let turns = quarter_turns();
        assert_eq!(turns.len(), 24);
        for (at, turn) in turns.iter().enumerate() {
            assert!(
                turns[..at].iter().all(|other| other.angle_to(turn) > 1.0),
                "turn {at}"
            );
        }
    }
}
