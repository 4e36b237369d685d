//! Contacts that are touched again: whether tip, part and arm are still where they were.
//!
//! Touches agree with each other wherever they are off together, so a bent tip, a part that slipped
//! and an arm that drifted show in none of them alone. A contact says where the part is along its
//! search; so the earliest contacts of up to three independent directions are kept, over all
//! features that are probed one after the other, and touched again after each feature and after
//! each collision.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::ending::ProbedTouch;
use crate::probing::arm::{OnsetVerdict, TouchOutcome};
use crate::probing::plan::TouchPlan;

/// The contacts that the arm touches again, and when the last of them was where it had been.
#[derive(Clone, Debug, Default)]
pub struct References {
    pub(super) kept: Vec<ReferenceContact>,
    /// number of the feature, and its touches until then
    pub(super) good: Option<(u32, usize)>,
}

/// A contact that the arm touches again.
#[derive(Clone, Debug)]
pub(super) struct ReferenceContact {
    /// number of the feature, and of the touch in it from 0 on
    pub flag: u32,
    pub index: usize,
    /// in O
    pub planned: TouchPlan,
    /// of the tip in B
    pub rotation: UnitQuaternion<f64>,
    /// of the ball, m in O
    pub centre: Point3<f64>,
    /// of its curve, m
    pub sigma: f64,
    /// the part of its direction that those before it do not have, unit vector in O
    pub axis: Vector3<f64>,
}

/// A contact is kept if this share of its direction is none of those that are kept.
const INDEPENDENT: f64 = 0.5;
/// The part pushes back along the search within 18° (cosine): on a slope the ball may slip.
const SQUARE: f64 = 0.95;

impl References {
    /// Keeps the contacts of a feature whose direction is new.
    ///
    /// - `rotation`: that it is touched with, of the tip in B.
    pub(super) fn keep(
        &mut self,
        flag: u32,
        rotation: &UnitQuaternion<f64>,
        touches: &[ProbedTouch],
    ) {
        for (index, touch) in touches.iter().enumerate() {
            let Some((centre, sigma)) = square_contact(touch) else {
                continue;
            };
            let direction = touch.planned.direction.into_inner();
            // after Gram and Schmidt, so that there are three at most
            let new = self
                .kept
                .iter()
                .fold(direction, |new, one| new - one.axis * new.dot(&one.axis));
            if new.norm() > INDEPENDENT {
                self.kept.push(ReferenceContact {
                    flag,
                    index,
                    planned: touch.planned,
                    rotation: *rotation,
                    centre,
                    sigma,
                    axis: new.normalize(),
                });
            }
        }
    }
}

/// The ball's centre at a contact that repeats, m in O, and the uncertainty of its curve, m.
fn square_contact(touch: &ProbedTouch) -> Option<(Point3<f64>, f64)> {
    let record = touch.record.as_ref()?;
    let TouchOutcome::Contact { onset, force_b, .. } = &record.outcome else {
        return None;
    };
    let is_square = -force_b.dot(&record.target.direction) > SQUARE * force_b.norm();
    (is_square && onset.verdict == OnsetVerdict::Clean)
        .then_some(onset.sigma)
        .and_then(|sigma| Some((touch.centre?, sigma)))
}
