//! Presses as recorded.

use nalgebra::{Point3, UnitQuaternion, Vector3};

/// A press of the ball on the part, as recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordedPress {
    pub stamp_ns: i64,
    /// recorded centre of the ball, m, in O
    pub centre: Point3<f64>,
    /// turn of the stylus: T to O
    pub rotation: UnitQuaternion<f64>,
    /// force of the part on the ball, N, in O
    pub force: Vector3<f64>,
    /// way of the ball around it, m, in O; 0 if unknown
    pub course: Vector3<f64>,
    /// number of its stroke: presses of one share their errors
    pub stroke: u32,
}
