//! The pose of a stylus from the LED markers on it, whichever of them are seen.
//!
//! A rigid body with its mass in the markers is pulled by a spring and a damper at each marker that is seen to where it
//! is measured; between two frames it flies on. Spring k and damper d for a mass m say how: by the natural frequency
//! √(k/m) and the damping d/(2 √(k m)). [`MarkerFilter`] finds the first pose in closed form, follows it through
//! occlusion, swapped labels and outliers, and gives poses at a steady rate.

mod body;
mod filter;
mod motion;

pub use body::MarkerBody;
pub use filter::{MarkerCounts, MarkerFilter, Tracking};
pub use motion::SpringParams;

use nalgebra::Point3;

use super::SettingError;
use super::stream::Stamped;

/// Markers that a body, and a frame, may have.
pub const MOST_MARKERS: usize = 16;

/// One marker as it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenMarker {
    /// which marker of the body the camera takes it for; it may be wrong, or none of the body
    pub label: u32,
    /// where, m, in O
    pub position: Point3<f64>,
}

/// The markers that were seen at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerFrame {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    seen: [SeenMarker; MOST_MARKERS],
    count: usize,
}

impl MarkerFrame {
    /// A frame in which nothing is seen.
    pub fn new(stamp_ns: i64) -> Self {
        let none = SeenMarker { label: 0, position: Point3::origin() };
        Self { stamp_ns, seen: [none; MOST_MARKERS], count: 0 }
    }

    /// Adds a marker; `false` when it is not finite, absurdly far or one too many, and not added.
    pub fn see(&mut self, marker: SeenMarker) -> bool {
        let fits = marker.position.iter().all(|x| x.abs() <= super::LARGEST_POSITION) && self.count < MOST_MARKERS;
        if fits {
            self.seen[self.count] = marker;
            self.count += 1;
        }
        fits
    }

    /// The markers, in the order in which they came.
    pub fn seen(&self) -> &[SeenMarker] {
        &self.seen[..self.count]
    }
}

impl Stamped for MarkerFrame {
    const IS_LOST_ALONE: bool = true;

    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }
}

/// Settings of a [`MarkerFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerParams {
    /// How the body follows its markers.
    pub spring: SpringParams,
    /// Noise of a seen marker per axis, m: what lies much farther from the fit counts little. Default 0.15 mm, an active
    /// LED system at 2 m.
    pub noise: f64,
    /// A marker farther than this from where it is expected is another one, or none, m. Default 4 mm: a hand that
    /// accelerates with 5 m/s² strays by 2 mm in 30 ms, and markers stand farther apart than twice as much.
    pub gate: f64,
    /// How long the body flies on when its markers do not determine it, ns. Default 30 ms, as long as
    /// [`super::SyncParams::largest_gap_ns`] and for the same reason.
    pub coast_ns: i64,
    /// Time between two poses, ns. Default 1 ms.
    pub period_ns: i64,
    /// How far a frame may lag behind the newest one, ns. Default 20 ms.
    pub reorder_ns: i64,
}

impl Default for MarkerParams {
    fn default() -> Self {
        Self {
            spring: SpringParams::default(),
            noise: 0.15e-3,
            gate: 4e-3,
            coast_ns: 30_000_000,
            period_ns: 1_000_000,
            reorder_ns: 20_000_000,
        }
    }
}

impl MarkerParams {
    fn check(&self, body: &MarkerBody) -> Result<(), SettingError> {
        self.spring.check()?;
        SettingError::check("marker noise (m)", self.noise, self.noise > 0.0, "more than 0")?;
        let apart = self.gate > 0.0 && 2.0 * self.gate < body.smallest_distance();
        SettingError::check(
            "marker gate (m)",
            self.gate,
            apart,
            "more than 0 and less than half of the smallest distance between two markers",
        )?;
        for (name, ns) in [("coasting (ns)", self.coast_ns), ("period of poses (ns)", self.period_ns)] {
            SettingError::check(name, ns as f64, ns > 0, "more than 0")?;
        }
        SettingError::check("reorder window (ns)", self.reorder_ns as f64, self.reorder_ns >= 0, "0 or more")
    }
}
