//! What may change while a session lasts.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3, Vector6};

use super::recorded_press::RecordedPress;
use touchup_method::stylus::{ChangeCourse, ChangedThing, motion_about};

/// What changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChangeCause {
    /// The place of the part, or of the frame of the poses, by a shift in O.
    PartShifted,
    /// The same by a shift and a turn.
    PartMoved,
    /// The place of the ball on the stylus, by a shift in T.
    TipBent,
    /// The sink of the ball under a force, by a compliance.
    StiffnessChanged,
}

/// A change, but for its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SessionChange {
    pub cause: ChangeCause,
    pub course: ChangeCourse,
    /// centre of turns, m, in O
    pub about: Point3<f64>,
}

impl ChangeCause {
    /// Number of freedoms of its size: the first ones.
    pub(crate) fn freedoms(self) -> usize {
        match self {
            Self::PartMoved => 6,
            Self::PartShifted | Self::TipBent => 3,
            Self::StiffnessChanged => 1,
        }
    }

    /// What changes its place; `None`: only how the ball sinks changes.
    pub(crate) fn changed(self) -> Option<ChangedThing> {
        match self {
            Self::PartShifted | Self::PartMoved => Some(ChangedThing::Part),
            Self::TipBent => Some(ChangedThing::Tip),
            Self::StiffnessChanged => None,
        }
    }
}

impl SessionChange {
    /// A centre with the change taken off, and the turn of directions that goes with it.
    ///
    /// - `size`: shift, m, and turn, rad; of a stiffness the compliance, m/N, in place of the first.
    pub(super) fn undone(
        &self,
        press: &RecordedPress,
        centre: &Point3<f64>,
        size: &Vector6<f64>,
    ) -> (Point3<f64>, UnitQuaternion<f64>) {
        let size = size * self.course.share(press.stamp_ns);
        let [shift, turn]: [Vector3<f64>; 2] =
            [0, 3].map(|from| size.fixed_rows::<3>(from).into_owned());
        let Some(changed) = self.cause.changed() else {
            let sunk = centre + press.force * shift.x;
            return (sunk, UnitQuaternion::identity());
        };
        let turn = match self.cause {
            ChangeCause::PartMoved => turn,
            _ => Vector3::zeros(),
        };
        let motion = motion_about(&self.about, &shift, &turn);
        let recorded = Isometry3::from_parts(centre.coords.into(), press.rotation);
        let undone = changed.undone(&motion, &recorded);
        let turned = undone.rotation * press.rotation.inverse();
        (undone.translation.vector.into(), turned)
    }

    /// Derivatives of a distance by the size of the change.
    ///
    /// - `centre`: where the press was placed with this size. `normal`: gradient of the distance
    ///   there, and `recorded`, in the axes of the recording.
    pub(super) fn by_size(
        &self,
        press: &RecordedPress,
        (centre, size): (&Point3<f64>, &Vector6<f64>),
        [normal, recorded]: [&Vector3<f64>; 2],
    ) -> Vector6<f64> {
        let share = self.course.share(press.stamp_ns);
        let (by_shift, by_turn) = match self.cause {
            ChangeCause::PartShifted => (-normal, Vector3::zeros()),
            ChangeCause::PartMoved => {
                let lever = centre + size.fixed_rows::<3>(0) * share - self.about;
                (-normal, -lever.cross(normal))
            }
            ChangeCause::TipBent => (
                press.rotation.inverse_transform_vector(recorded),
                Vector3::zeros(),
            ),
            ChangeCause::StiffnessChanged => {
                (Vector3::x() * press.force.dot(recorded), Vector3::zeros())
            }
        };
        Vector6::from_iterator(by_shift.iter().chain(&by_turn).copied()) * share
    }
}
