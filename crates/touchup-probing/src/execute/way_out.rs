//! Path back into free air from a stop of the arm in or at the part.

use nalgebra::{Isometry3, Point3};

use super::cell::RobotCell;
use super::route::ToolState;
use crate::arm::ArmState;

/// Path of the ball back into free air, the reverse of its entry: for an arm that stopped inside a
/// feature, no other path is known to be clear.
#[derive(Clone, Debug, PartialEq)]
pub struct WayOut {
    /// the tip at its stop, in B
    pub(super) stopped_bt: Isometry3<f64>,
    /// start of the search, and entry of the feature, if the ball was there; m in O
    pub(super) from: Option<Point3<f64>>,
    pub(super) entry: Option<Point3<f64>>,
    /// end of the path
    pub(super) out: ToolState,
}

/// Maximum distance of a standing tip from its stop, m.
const STANDS: f64 = 0.5e-3;
/// Maximum turn of a standing tip from its stop, rad.
const STANDS_TURNED: f64 = 0.01;

impl WayOut {
    /// Whether the arm still stands at its stop; otherwise somebody has moved it, and the path is
    /// another.
    pub(super) fn begins_at(&self, now: &ArmState) -> bool {
        let (stopped, here) = (&self.stopped_bt, &now.pose_bt);
        let off = (stopped.translation.vector - here.translation.vector).norm();
        off < STANDS && stopped.rotation.angle_to(&here.rotation) < STANDS_TURNED
    }

    /// Places of the ball's centre on the path, the last in free air; m in O.
    pub(super) fn places(&self) -> impl Iterator<Item = Point3<f64>> {
        [self.from, self.entry, Some(self.out.place)]
            .into_iter()
            .flatten()
    }

    /// State of the arm at the end of the path.
    pub(super) fn end(&self, cell: &RobotCell, now: &ArmState) -> ArmState {
        ArmState {
            pose_bt: cell.pose(&self.out.rotation, &self.out.place),
            joints: self.out.joints,
            ..*now
        }
    }
}
