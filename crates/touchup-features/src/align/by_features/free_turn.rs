//! Parts of revolution: features about one axis do not fix the turn about it.

use nalgebra::{Isometry3, Point3, Vector3};

use super::alternative::Alternative;
use super::judge::{Judge, JudgedMotion};
use super::landmark::{ALIKE, Landmark};
use crate::features::FeatureKind;
use touchup_geometry::numeric::{moved_by_twist, without_repeats};

/// An undetermined turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeTurn {
    /// unit direction, in the frame of the target
    pub axis: Vector3<f64>,
    /// a point of the axis, m
    pub through: Point3<f64>,
}

/// Number of trial turns, [`STEP`] apart: 16 match the symmetry of no part with fewer holes.
const TURNS: u32 = 16;
/// The golden angle, rad: no multiple of it comes near an earlier one.
const STEP: f64 = 2.399_963_229_728_653;

impl Judge<'_> {
    /// The axis about which the motion may turn and explain as much: the axis of all its explained
    /// features, and of the surface if given.
    pub(super) fn free_turn(&self, best: &JudgedMotion) -> Option<FreeTurn> {
        let explained: Vec<&Landmark> = best
            .explained()
            .map(|[_, theirs]| &self.matching.target[theirs])
            .collect();
        let turn = axis_of(&explained, self.matching.tolerance)?;
        let is_alike = |step: u32| self.stays(best, &turn.by(f64::from(step) * STEP));
        (1..=TURNS).all(is_alike).then_some(turn)
    }
}

impl FreeTurn {
    /// The motions that are not such a turn of an earlier one.
    ///
    /// - `near`: largest shift of the axis by such a turn, m
    pub(super) fn distinct(&self, alternatives: Vec<Alternative>, near: f64) -> Vec<Alternative> {
        without_repeats(alternatives, |before, alternative| {
            let between = alternative.source_to_target * before.source_to_target.inverse();
            let is_along = (between * self.axis).dot(&self.axis) >= ALIKE;
            is_along && (between * self.through - self.through).norm() <= near
        })
    }

    fn by(&self, angle: f64) -> Isometry3<f64> {
        moved_by_twist(
            &Isometry3::identity(),
            &self.through,
            &Vector3::zeros(),
            &(self.axis * angle),
        )
    }
}

/// The common axis of revolution.
///
/// - `near`: largest offset of a landmark from it, m
fn axis_of(landmarks: &[&Landmark], near: f64) -> Option<FreeTurn> {
    let first = landmarks.iter().find(|landmark| landmark.is_located())?;
    let (axis, through) = (first.axis?, first.place);
    let is_about = |landmark: &&Landmark| {
        let is_along = landmark
            .axis
            .is_some_and(|own| own.dot(&axis).abs() >= ALIKE);
        let is_on = (landmark.place - through).cross(&axis).norm() <= near;
        match landmark.kind {
            FeatureKind::Plane => is_along,
            FeatureKind::Hole | FeatureKind::Boss | FeatureKind::Cylinder => is_along && is_on,
            FeatureKind::Sphere => is_on,
            FeatureKind::Slot
            | FeatureKind::Pocket
            | FeatureKind::Edge
            | FeatureKind::Corner
            | FeatureKind::Notch => false,
        }
    };
    landmarks
        .iter()
        .all(is_about)
        .then_some(FreeTurn { axis, through })
}
