//! What a session is made with, as unknowns.

use nalgebra::{SMatrix, SVector, Vector3, Vector6};

/// Number of unknowns of a session.
pub(super) const NUMBERS: usize = 10;

/// Unknowns of a session as one vector, and their information.
pub(super) type NumberVector = SVector<f64, NUMBERS>;
pub(super) type NumberMatrix = SMatrix<f64, NUMBERS, NUMBERS>;

/// What a session is made with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SessionNumbers {
    /// sink of the ball, m/N
    pub compliance: f64,
    /// place of the ball from its assumed one, m, in T
    pub offset_t: Vector3<f64>,
    /// size of what changes while it lasts: a shift, m, and a turn, rad
    pub change: Vector6<f64>,
}

impl SessionNumbers {
    pub(super) fn as_vector(&self) -> NumberVector {
        let mut x = NumberVector::zeros();
        x[0] = self.compliance;
        x.fixed_rows_mut::<3>(1).copy_from(&self.offset_t);
        x.fixed_rows_mut::<6>(4).copy_from(&self.change);
        x
    }

    pub(super) fn from_vector(x: &NumberVector) -> Self {
        Self {
            compliance: x[0],
            offset_t: x.fixed_rows::<3>(1).into(),
            change: x.fixed_rows::<6>(4).into(),
        }
    }
}
