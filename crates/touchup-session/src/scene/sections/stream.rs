//! Where samples come from: two streams paired, the stylus from its markers, weight, bias and drift off the wrench.

use serde::Deserialize;

use super::{in_range, named};
use crate::scene::SceneError;
use touchup_core::touch::{BiasParams, MarkerBody, MarkerParams, SyncParams};

/// `sync`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SyncSection {
    /// How far a message may lag behind the newest stamp of its stream, ms.
    pub reorder_ms: f64,
    /// Largest distance between the two poses around a wrench, ms.
    pub largest_gap_ms: f64,
    /// A stamp this far ahead is believed only when the next one agrees, s.
    pub largest_jump_s: f64,
    /// What the clock of the wrench reads beyond the clock of the pose, ms.
    pub wrench_offset_ms: f64,
    /// How many messages of each stream are held.
    pub capacity: usize,
}

impl Default for SyncSection {
    fn default() -> Self {
        let SyncParams { reorder_ns, largest_gap_ns, largest_jump_ns, wrench_offset_ns, capacity } =
            SyncParams::default();
        Self {
            reorder_ms: reorder_ns as f64 * 1e-6,
            largest_gap_ms: largest_gap_ns as f64 * 1e-6,
            largest_jump_s: largest_jump_ns as f64 * 1e-9,
            wrench_offset_ms: wrench_offset_ns as f64 * 1e-6,
            capacity,
        }
    }
}

impl SyncSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("sync.reorder_ms", self.reorder_ms, 0.0, 6e4, "0 to 60000 ms")?;
        in_range("sync.largest_gap_ms", self.largest_gap_ms, 0.0, 6e4, "0 to 60000 ms")?;
        in_range("sync.largest_jump_s", self.largest_jump_s, 0.0, 1e6, "0 to 1e6 s")?;
        in_range("sync.wrench_offset_ms", self.wrench_offset_ms, -6e4, 6e4, "-60000 to 60000 ms")?;
        in_range("sync.capacity", self.capacity as f64, 2.0, 1e6, "2 to 1000000 messages")
    }
}

/// `clock`; it has no keys.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockSection {}

/// `markers`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MarkersSection {
    /// Each marker from the centre of the ball, in the axes of the tip, by label from 0 on, mm.
    pub positions_mm: Vec<[f64; 3]>,
    /// Natural frequency √(k/m) / 2π of the springs between the body and its markers, Hz.
    pub spring_hz: f64,
    /// Damping d / (2 √(k m)).
    pub damping: f64,
    /// Noise of a marker per axis, mm.
    pub noise_mm: f64,
    /// A marker farther than this from where it is expected is another one, or none, mm.
    pub gate_mm: f64,
    /// How long the body flies on when its markers do not determine it, ms.
    pub coast_ms: f64,
    /// Time between two poses, ms.
    pub period_ms: f64,
    /// How far a frame may lag behind the newest one, ms.
    pub reorder_ms: f64,
}

impl Default for MarkersSection {
    /// The stylus of the simulation.
    fn default() -> Self {
        let MarkerParams { spring, noise, gate, coast_ns, period_ns, reorder_ns } = MarkerParams::default();
        let millimetres = |p: &nalgebra::Point3<f64>| [p.x, p.y, p.z].map(|x| (x * 1e6).round() * 1e-3);
        Self {
            positions_mm: MarkerBody::default().markers_t().iter().map(millimetres).collect(),
            spring_hz: spring.frequency,
            damping: spring.damping,
            noise_mm: noise * 1e3,
            gate_mm: gate * 1e3,
            coast_ms: coast_ns as f64 * 1e-6,
            period_ms: period_ns as f64 * 1e-6,
            reorder_ms: reorder_ns as f64 * 1e-6,
        }
    }
}

impl MarkersSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("the number of markers.positions_mm", self.positions_mm.len() as f64, 3.0, 16.0, "3 to 16")?;
        for &x in self.positions_mm.iter().flatten() {
            in_range("markers.positions_mm", x, -1e4, 1e4, "-10000 to 10000 mm")?;
        }
        in_range("markers.spring_hz", self.spring_hz, 1e-3, 1e6, "0.001 to 1e6 Hz")?;
        in_range("markers.damping", self.damping, 0.5, 100.0, "0.5 to 100")?;
        in_range("markers.noise_mm", self.noise_mm, 1e-6, 1e3, "1e-6 to 1000 mm")?;
        in_range("markers.gate_mm", self.gate_mm, 1e-6, 1e3, "1e-6 to 1000 mm")?;
        in_range("markers.coast_ms", self.coast_ms, 1e-3, 1e4, "0.001 to 10000 ms")?;
        in_range("markers.period_ms", self.period_ms, 0.05, 1e4, "0.05 to 10000 ms")?;
        in_range("markers.reorder_ms", self.reorder_ms, 0.0, 6e4, "0 to 60000 ms")
    }
}

/// `compensation`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CompensationSection {
    /// Origin of the sensor from the centre of the ball, in the axes of the tip, mm.
    pub sensor_position_mm: [f64; 3],
    /// Orientation of the sensor in the tip's frame, quaternion x, y, z, w; none: the same axes.
    pub sensor_orientation_xyzw: Option<[f64; 4]>,
    /// What hangs on the sensor.
    #[serde(deserialize_with = "named")]
    pub payload: Option<PayloadSection>,
    /// What the sensor reads when nothing touches and nothing hangs on it.
    #[serde(deserialize_with = "named")]
    pub bias: Option<BiasSection>,
}

impl CompensationSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        let all = |key, values: &[f64], largest: f64, allowed| {
            values.iter().try_for_each(|&value| in_range(key, value, -largest, largest, allowed))
        };
        all("compensation.sensor_position_mm", &self.sensor_position_mm, 1e5, "-100000 to 100000 mm")?;
        if let Some(xyzw) = self.sensor_orientation_xyzw {
            is_unit("compensation.sensor_orientation_xyzw", &xyzw)?;
        }
        if let Some(payload) = &self.payload {
            in_range("compensation.payload.mass_kg", payload.mass_kg, 0.0, 1e3, "0 to 1000 kg")?;
            all("compensation.payload.centre_mm", &payload.centre_mm, 1e4, "-10000 to 10000 mm")?;
            all("compensation.payload.gravity_m_per_s2", &payload.gravity_m_per_s2, 100.0, "-100 to 100 m/s²")?;
        }
        if let Some(bias) = &self.bias {
            all("compensation.bias.force_n", &bias.force_n, 1e4, "-10000 to 10000 N")?;
            all("compensation.bias.torque_nm", &bias.torque_nm, 1e4, "-10000 to 10000 N·m")?;
        }
        Ok(())
    }
}

/// `compensation.payload`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PayloadSection {
    /// kg
    pub mass_kg: f64,
    /// Centre of mass from the sensor's origin, in the axes of the sensor, mm.
    pub centre_mm: [f64; 3],
    /// Acceleration of gravity in the axes that `gravity_axes` names, m/s².
    pub gravity_m_per_s2: [f64; 3],
    /// Whose axes those are.
    pub gravity_axes: GravityAxes,
}

/// In which axes gravity is named.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GravityAxes {
    /// Those of the scan: it must be named anew when the part is laid down otherwise.
    #[default]
    Object,
    /// Those of the recorded poses: `scan_to_space` turns it.
    Space,
}

impl Default for PayloadSection {
    fn default() -> Self {
        Self {
            mass_kg: 0.0,
            centre_mm: [0.0; 3],
            gravity_m_per_s2: [0.0, 0.0, -9.81],
            gravity_axes: GravityAxes::Object,
        }
    }
}

/// `compensation.bias`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BiasSection {
    /// In the axes of the sensor, N.
    pub force_n: [f64; 3],
    /// In the axes of the sensor, N·m.
    pub torque_nm: [f64; 3],
}

/// `scan_to_space`: p_space = R p_scan + t
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScanToSpaceSection {
    /// Origin of the scan in the frame of the recorded poses, mm.
    pub position_mm: [f64; 3],
    /// Orientation of the scan's axes in that frame, quaternion x, y, z, w.
    pub orientation_xyzw: [f64; 4],
}

impl Default for ScanToSpaceSection {
    /// The recorded poses are in the frame of the scan.
    fn default() -> Self {
        Self { position_mm: [0.0; 3], orientation_xyzw: [0.0, 0.0, 0.0, 1.0] }
    }
}

impl ScanToSpaceSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        for &x in &self.position_mm {
            in_range("scan_to_space.position_mm", x, -1e6, 1e6, "-1000000 to 1000000 mm")?;
        }
        is_unit("scan_to_space.orientation_xyzw", &self.orientation_xyzw)
    }
}

/// Refuses a quaternion that is no rotation.
pub(super) fn is_unit(key: &'static str, xyzw: &[f64; 4]) -> Result<(), SceneError> {
    let norm = xyzw.iter().map(|c| c * c).sum::<f64>().sqrt();
    in_range(key, norm, 0.999, 1.001, "a quaternion of length 1 within 0.001 (this is its length)")
}

/// `bias_tracking`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BiasTrackingSection {
    /// A force within this of the bias is free air, N.
    pub free_n: f64,
    /// … once it has lasted so long, ms.
    pub settle_ms: f64,
    /// Time constant of the running mean, s.
    pub time_s: f64,
}

impl Default for BiasTrackingSection {
    fn default() -> Self {
        let BiasParams { free, settle_ns, time } = BiasParams::default();
        Self { free_n: free, settle_ms: settle_ns as f64 * 1e-6, time_s: time }
    }
}

impl BiasTrackingSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("bias_tracking.free_n", self.free_n, 1e-6, 1e3, "1e-6 to 1000 N")?;
        in_range("bias_tracking.settle_ms", self.settle_ms, 1e-3, 6e4, "0.001 to 60000 ms")?;
        in_range("bias_tracking.time_s", self.time_s, 1e-6, 1e6, "1e-6 to 1e6 s")
    }
}
