//! References: contacts that the arm touches again, to check that tip, part and arm have not moved.
//!
//! Touches with a common error agree with each other, so a bent tip, a part that slipped and an arm
//! that drifted show in none of them alone. A contact shows the position of the part along its
//! search; so the earliest contacts of up to three independent directions are kept, over all
//! features in sequence, and touched again after each feature and after each collision.

use std::f64::consts::SQRT_2;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::ending::ProbedTouch;
use crate::arm::{Onset, OnsetVerdict, TouchOutcome};
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
    /// distance from the start of its search, m
    pub travel: f64,
    /// part of its direction that is new among the earlier ones, unit vector in O
    pub axis: Vector3<f64>,
}

/// Minimum share of a contact's direction that is new, for a reference.
const INDEPENDENT: f64 = 0.5;
/// Standard deviations beyond which a contact has moved. Normal errors exceed them once in a million
/// contacts, so a sound probing that repeats a hundred contacts ends by chance once in ten thousand.
pub(super) const MOVED: f64 = 4.9;
/// Cosine of 18°: the part pushes back along the search within this; on a slope the ball may slip.
const SQUARE: f64 = 0.95;

impl References {
    /// Keeps the contacts of a feature with a new direction.
    ///
    /// - `rotation`: of the tip in B for its touches; `touch_sigma`: repeatability of a touch, m.
    pub(super) fn keep(
        &mut self,
        flag: u32,
        rotation: &UnitQuaternion<f64>,
        touches: &[ProbedTouch],
        touch_sigma: f64,
    ) {
        for (index, touch) in touches.iter().enumerate() {
            let Some((centre, onset)) = square_contact(touch) else {
                continue;
            };
            let (sigma, travel) = (onset.sigma, onset.travel);
            // half of the travel is more than two touches of a sound arm differ by
            if travel < 2.0 * MOVED * SQRT_2 * sigma.hypot(touch_sigma) {
                continue;
            }
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
                    travel,
                    axis: new.normalize(),
                });
            }
        }
    }
}

impl ReferenceContact {
    /// Plans that touch the contact again, one after the other.
    ///
    /// A wall behind the start of a search, such as the other one of a slot, is at an unknown
    /// distance, but the ball has passed the middle of its travel freely. The way down to that
    /// middle may be narrower, so the first plan comes second.
    pub(super) fn plans(&self) -> [TouchPlan; 2] {
        // a search from above begins in free air
        let is_inside = self.planned.entry != self.planned.from;
        let ahead = if is_inside { self.travel / 2.0 } else { 0.0 };
        [self.planned.begun_ahead(ahead), self.planned]
    }
}

/// Centre of the ball at a repeatable contact, m in O, and its onset.
fn square_contact(touch: &ProbedTouch) -> Option<(Point3<f64>, Onset)> {
    let record = touch.record.as_ref()?;
    let TouchOutcome::Contact { onset, force_b, .. } = &record.outcome else {
        return None;
    };
    let is_square = -force_b.dot(&record.target.direction) > SQUARE * force_b.norm();
    (is_square && onset.verdict == OnsetVerdict::Clean)
        .then_some(*onset)
        .and_then(|onset| Some((touch.centre?, onset)))
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;
    use touchup_geometry::numeric::normal_cdf;

    use super::*;
    use crate::plan::ExpectedTravel;

    #[test]
    fn a_hundred_sound_contacts_are_accused_once_in_ten_thousand_probings() {
        let by_chance = 100.0 * 2.0 * normal_cdf(-MOVED);
        assert!((5e-5..1e-4).contains(&by_chance), "{by_chance}");
    }

    /// A slot of 3 mm between centres of the ball, entered 0.1 mm beyond its left wall.
    #[test]
    fn a_contact_across_a_slot_is_touched_again_from_its_middle() {
        let from = Point3::new(-1.6e-3, 0.0, -2e-3);
        let planned = TouchPlan {
            entry: from + Vector3::z() * 7e-3,
            from,
            direction: Vector3::x_axis(),
            search: 12e-3,
            expected: Some(ExpectedTravel {
                travel: 3.2e-3,
                sigma: 1e-5,
            }),
        };
        let reference = ReferenceContact {
            flag: 1,
            index: 3,
            planned,
            rotation: UnitQuaternion::identity(),
            centre: Point3::new(1.5e-3, 0.0, -2e-3),
            sigma: 3e-6,
            travel: 3.1e-3,
            axis: Vector3::x(),
        };
        let [middle, first] = reference.plans();
        assert_eq!(first, planned);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(middle.from.x, -0.05e-3) && near(middle.entry.x, -0.05e-3));
        assert!(near(
            middle.from.x + middle.expected.unwrap().travel,
            1.6e-3
        ));
        assert!((middle.end() - planned.end()).norm() < 1e-12);
        // from above there is no wall behind
        let above = TouchPlan {
            entry: from,
            direction: Unit::new_unchecked(-Vector3::z()),
            ..planned
        };
        let down = ReferenceContact {
            planned: above,
            ..reference
        };
        assert_eq!(down.plans(), [above, above]);
    }
}
