//! A feature that is being probed: the position of the ball, its path back into free air, and its touches.

use nalgebra::{Point3, UnitQuaternion};

use super::ending::{ProbedSlide, ProbedTouch};
use super::route::ToolState;
use crate::probing::arm::Watched;

/// A feature that is being probed.
pub(super) struct FeatureProbing {
    pub flag: u32,
    /// that it is touched with, of the tip in B
    pub rotation: UnitQuaternion<f64>,
    /// where the tool was last in free air
    pub out: ToolState,
    /// whether it is there now
    pub is_out: bool,
    /// below that, where the touch is entered from, m in O; `None` where it is the same, or the ball was not there yet
    pub entry: Option<Point3<f64>>,
    /// where the last search began, m in O; `None` where the ball was not there yet
    pub from: Option<Point3<f64>>,
    pub begun_ns: i64,
    pub ended_ns: i64,
    pub touches: Vec<ProbedTouch>,
    pub slides: Vec<ProbedSlide>,
    pub peak_force: f64,
}

impl FeatureProbing {
    /// The next place that the ball goes back through into free air, where it has been before; `None` when it is there.
    pub fn next_out(&self) -> Option<Point3<f64>> {
        (!self.is_out).then(|| self.from.or(self.entry).unwrap_or(self.out.place))
    }

    /// It has reached that place, and does not go back behind it, whatever breaks off the remaining path.
    pub fn is_at_next_out(&mut self) {
        if self.from.take().is_none() && self.entry.take().is_none() {
            self.is_out = true;
        }
    }

    /// The ball is inside of the feature, and leaves it by these places.
    pub fn is_inside(&mut self, from: Point3<f64>, entry: Point3<f64>) {
        (self.from, self.entry) = (Some(from), Some(entry));
    }

    /// Keeps what was seen while the arm moved, also where that was broken off.
    pub fn keep(&mut self, watched: &Watched<'_>) {
        self.peak_force = self.peak_force.max(watched.peak_force());
        self.ended_ns = watched.seen_ns().unwrap_or(self.ended_ns).max(self.ended_ns);
    }

    pub fn seconds(&self) -> f64 {
        (self.ended_ns - self.begun_ns) as f64 * 1e-9
    }
}
