//! Presses as recorded, and the numbers of a session that place them.

use nalgebra::{Point3, UnitQuaternion, Vector3};

/// A press of the ball on the part, as recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordedPress {
    /// recorded centre of the ball, m, in O
    pub centre: Point3<f64>,
    /// turn of the stylus: T to O
    pub rotation: UnitQuaternion<f64>,
    /// force of the part on the ball, N, in O
    pub force: Vector3<f64>,
    /// number of its stroke: presses of one share their errors
    pub stroke: u32,
}

impl RecordedPress {
    /// Centre of the ball, m, in O, with these numbers of the session.
    pub(super) fn placed(&self, session: &SessionNumbers) -> Point3<f64> {
        self.centre + self.rotation * session.offset_t + self.force * session.compliance
    }
}

/// What a session is made with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SessionNumbers {
    /// sink of the ball, m/N
    pub compliance: f64,
    /// place of the ball from its assumed one, m, in T
    pub offset_t: Vector3<f64>,
}
