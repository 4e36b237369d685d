//! References: contacts that the arm touches again, to check that tip, part and arm have not moved.
//!
//! Touches with a common error agree with each other, so a bent tip, a part that slipped and an arm
//! that drifted show in none of them alone. A contact shows the position of the part along its
//! search; so the earliest contacts of up to three independent directions are kept, over all
//! features in sequence, and touched again after each feature and after each collision.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::ending::ProbedTouch;
use crate::arm::{OnsetVerdict, TouchOutcome};
use crate::plan::TouchPlan;

/// Contacts that the arm touches again, and their last confirmation.
#[derive(Clone, Debug, Default)]
pub struct References {
    pub(super) kept: Vec<ReferenceContact>,
    /// number of the feature then, and of its touches
    pub(super) good: Option<(u32, usize)>,
}

/// A contact that the arm touches again.
#[derive(Clone, Debug)]
pub(super) struct ReferenceContact {
    /// number of the feature, and of its touch from 0 on
    pub flag: u32,
    pub index: usize,
    /// plan of the touch, in O
    pub planned: TouchPlan,
    /// orientation of the tip in B
    pub rotation: UnitQuaternion<f64>,
    /// centre of the ball, m in O
    pub centre: Point3<f64>,
    /// uncertainty of its curve, m
    pub sigma: f64,
    /// part of its direction that is new among the earlier ones, unit vector in O
    pub axis: Vector3<f64>,
}

/// Minimum share of a contact's direction that is new, for a reference.
const INDEPENDENT: f64 = 0.5;
/// Cosine of 18°: the part pushes back along the search within this; on a slope the ball may slip.
const SQUARE: f64 = 0.95;

impl References {
    /// Keeps the contacts of a feature with a new direction.
    ///
    /// - `rotation`: of the tip in B for its touches.
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
            // after Gram and Schmidt, so that there are at most three
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

/// Centre of the ball at a repeatable contact, m in O, and the uncertainty of its curve, m.
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
