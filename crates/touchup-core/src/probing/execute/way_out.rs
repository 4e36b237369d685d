//! From where an arm was stopped in or at the part back into free air.

use nalgebra::{Isometry3, Point3};

use super::cell::Cell;
use super::route::ToolState;
use crate::probing::arm::ArmState;

/// The way that the ball came, back into free air: no way but that is known to be clear where an
/// arm was stopped inside of a feature.
#[derive(Clone, Debug, PartialEq)]
pub struct WayOut {
    /// the tip where it was stopped, in B
    pub(super) stopped_bt: Isometry3<f64>,
    /// where the search began, and where the feature was entered, as far as the ball was there; m
    /// in O
    pub(super) from: Option<Point3<f64>>,
    pub(super) entry: Option<Point3<f64>>,
    /// its end
    pub(super) out: ToolState,
}

/// An arm stands where it was stopped while its tip is no farther from there, m …
const STANDS: f64 = 0.5e-3;
/// … and not turned by more, rad.
const STANDS_TURNED: f64 = 0.01;

impl WayOut {
    /// Whether the arm still stands where it was stopped; else somebody has moved it, and the way
    /// is another.
    pub(super) fn begins_at(&self, now: &ArmState) -> bool {
        let (stopped, here) = (&self.stopped_bt, &now.pose_bt);
        let off = (stopped.translation.vector - here.translation.vector).norm();
        off < STANDS && stopped.rotation.angle_to(&here.rotation) < STANDS_TURNED
    }

    /// The places that the ball's centre goes through, the last in free air; m in O.
    pub(super) fn places(&self) -> impl Iterator<Item = Point3<f64>> {
        [self.from, self.entry, Some(self.out.place)]
            .into_iter()
            .flatten()
    }

    /// The arm at its end.
    pub(super) fn end(&self, cell: &Cell, now: &ArmState) -> ArmState {
        ArmState {
            pose_bt: cell.pose(&self.out.rotation, &self.out.place),
            joints: self.out.joints,
            ..*now
        }
    }
}
