//! What may change while a session lasts.

use nalgebra::{Point3, UnitQuaternion, Vector3, Vector6};

use super::recorded_press::RecordedPress;

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

/// When it changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChangeCourse {
    /// All at once.
    At(i64),
    /// Evenly from one stamp to another.
    Between(i64, i64),
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

    /// Whether both move the same thing.
    pub(super) fn is_like(self, other: Self) -> bool {
        let is_of_part = |cause| matches!(cause, Self::PartShifted | Self::PartMoved);
        self == other || is_of_part(self) && is_of_part(other)
    }
}

impl ChangeCourse {
    /// Share of the change that has happened.
    pub(super) fn share(self, stamp_ns: i64) -> f64 {
        match self {
            Self::At(at) => f64::from(stamp_ns >= at),
            Self::Between(from, to) => {
                let since = stamp_ns.saturating_sub(from) as f64;
                (since / to.saturating_sub(from).max(1) as f64).clamp(0.0, 1.0)
            }
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
        match self.cause {
            ChangeCause::PartShifted => (centre - shift, UnitQuaternion::identity()),
            ChangeCause::PartMoved => {
                let turn = UnitQuaternion::from_scaled_axis(-turn);
                let moved = centre - self.about - shift;
                (self.about + turn * moved, turn)
            }
            ChangeCause::TipBent => (centre + press.rotation * shift, UnitQuaternion::identity()),
            ChangeCause::StiffnessChanged => {
                (centre + press.force * shift.x, UnitQuaternion::identity())
            }
        }
    }

    /// Derivatives of a distance by the size of the change.
    ///
    /// - `centre`: where the press was placed. `normal`: gradient of the distance there, and
    ///   `recorded`, in the axes of the recording.
    pub(super) fn by_size(
        &self,
        press: &RecordedPress,
        centre: &Point3<f64>,
        [normal, recorded]: [&Vector3<f64>; 2],
    ) -> Vector6<f64> {
        let share = self.course.share(press.stamp_ns);
        let (by_shift, by_turn) = match self.cause {
            ChangeCause::PartShifted => (-recorded, Vector3::zeros()),
            ChangeCause::PartMoved => (-recorded, -(centre - self.about).cross(normal)),
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
