//! Presses where the part lay at first.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::numbers::SessionNumbers;
use super::recorded_press::RecordedPress;
use super::session_change::SessionChange;

/// A press where the part lay at first.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedPress {
    /// of the ball, m
    pub centre: Point3<f64>,
    /// of the part on the ball: unit vector
    pub force: Vector3<f64>,
    /// turn of directions that was taken off
    pub turn: UnitQuaternion<f64>,
}

impl RecordedPress {
    /// Where it was with these numbers of the session.
    pub(super) fn placed(
        &self,
        session: &SessionNumbers,
        change: Option<&SessionChange>,
    ) -> PlacedPress {
        let offset = self.rotation * session.offset_t + self.force * session.compliance;
        let centre = self.centre + offset;
        let force = self.force.normalize();
        let Some(change) = change else {
            return PlacedPress {
                centre,
                force,
                turn: UnitQuaternion::identity(),
            };
        };
        let (centre, turn) = change.undone(self, &centre, &session.change);
        PlacedPress {
            centre,
            force: turn * force,
            turn,
        }
    }

    /// Derivatives of a distance by the numbers of the session.
    ///
    /// - `normal`: its gradient where the press was placed with these numbers.
    pub(super) fn by_numbers(
        &self,
        placed: &PlacedPress,
        normal: &Vector3<f64>,
        session: &SessionNumbers,
        change: Option<&SessionChange>,
    ) -> SessionNumbers {
        let recorded = placed.turn.inverse_transform_vector(normal);
        SessionNumbers {
            compliance: self.force.dot(&recorded),
            offset_t: self.rotation.inverse_transform_vector(&recorded),
            change: change
                .map(|change| {
                    let placed = (&placed.centre, &session.change);
                    change.by_size(self, placed, [normal, &recorded])
                })
                .unwrap_or_default(),
        }
    }
}
