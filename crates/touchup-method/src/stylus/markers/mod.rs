//! Pose of a stylus from any observed subset of its LED markers.
//!
//! A spring and a damper at each seen marker pull a rigid body, with its mass in the markers, to
//! the measured place; between two frames it flies on. Spring k and damper d for a mass m determine
//! the natural frequency √(k/m) and the damping d/(2 √(k m)). [`MarkerFilter`] finds the first pose
//! in closed form, follows it through occlusion, swapped labels and outliers, and gives poses at a
//! steady rate.

mod body;
mod filter;
mod motion;

pub use body::MarkerBody;
pub use filter::{MarkerCounts, MarkerFilter};
pub use motion::SpringParams;

use nalgebra::Point3;

use super::SettingError;
use super::stream::StampedMessage;
use crate::parameters;

/// Maximum number of markers of a body, and of a frame.
pub(crate) const MOST_MARKERS: usize = 16;

/// The measured position of one marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerObservation {
    /// label from the camera: index of the marker in the body; may be wrong, or none of the body
    pub label: u32,
    /// position, m, in O
    pub position: Point3<f64>,
}

/// Markers observed at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerFrame {
    /// Time of measurement, ns.
    pub stamp_ns: i64,
    seen: [MarkerObservation; MOST_MARKERS],
    count: usize,
}

impl MarkerFrame {
    /// A frame without markers.
    pub fn new(stamp_ns: i64) -> Self {
        let none = MarkerObservation {
            label: 0,
            position: Point3::origin(),
        };
        Self {
            stamp_ns,
            seen: [none; MOST_MARKERS],
            count: 0,
        }
    }

    /// Adds a marker; refuses with `false` one that is not finite, absurdly far or one too many.
    pub fn see(&mut self, marker: MarkerObservation) -> bool {
        let fits = marker
            .position
            .iter()
            .all(|x| x.abs() <= super::LARGEST_POSITION)
            && self.count < MOST_MARKERS;
        if fits {
            self.seen[self.count] = marker;
            self.count += 1;
        }
        fits
    }

    /// The markers, in order of insertion.
    pub fn seen(&self) -> &[MarkerObservation] {
        &self.seen[..self.count]
    }
}

impl StampedMessage for MarkerFrame {
    const IS_LOST_ALONE: bool = true;

    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }
}

parameters! {
    /// Settings of a [`MarkerFilter`].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MarkerParams in "markers" {
        /// Standard deviation of the noise of a marker along each axis.
        ///
        /// In m: markers much farther from the fit count little. An active LED system at 2 m.
        noise: f64 = 0.15, "noise_mm" [MM, 1e-6, 1000];
        /// Largest distance of a marker from its expected position; a farther one does not count as
        /// this marker. Less than half of the smallest distance between two markers.
        ///
        /// In m. A hand that accelerates with 5 m/s² strays by 2 mm in 30 ms, and the distance
        /// between markers is more than twice that.
        gate: f64 = 4.0, "gate_mm" [MM, 1e-6, 1000];
        /// Longest time for which the body continues its motion while its markers do not determine
        /// it; after that there is no pose.
        ///
        /// In ns. As long as [`super::SyncParams::largest_gap_ns`] and for the same reason.
        coast_ns: i64 = 30.0, "coast_ms" [MS, 0.001, 10000];
        /// Time between two poses.
        ///
        /// In ns.
        period_ns: i64 = 1.0, "period_ms" [MS, 0.05, 10000];
        /// Largest lag of a frame behind the newest one.
        ///
        /// In ns.
        reorder_ns: i64 = 20.0, "reorder_ms" [MS, 0, 60000];
    }
    with {
        /// Springs between the body and its markers.
        spring: SpringParams,
    }
}

impl MarkerParams {
    /// Refuses the first setting outside its range, and a gate that could confuse two markers of
    /// `body`.
    ///
    /// # Errors
    /// [`SettingError`]
    pub fn check_for(&self, body: &MarkerBody) -> Result<(), SettingError> {
        self.check()?;
        let apart = 2.0 * self.gate < body.smallest_distance;
        let allowed = "less than half of the smallest distance between two markers";
        SettingError::check("markers.gate_mm", self.gate * 1e3, apart, allowed)
    }
}
