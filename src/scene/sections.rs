//! The sections of the YAML, each with its units in the keys, its defaults and its ranges.

use serde::{Deserialize, Deserializer};

use super::SceneError;
use crate::patch::{CalibrationParams, UncertaintyParams};
use crate::refine::{CarveParams, ContactModel, DynamicsParams, GuardParams, SlidingParams};
use crate::touch::{BiasParams, ContactGateParams, MarkerBody, MarkerParams, SyncParams, TipShape};

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

/// `compensation.payload`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PayloadSection {
    /// kg
    pub mass_kg: f64,
    /// Centre of mass from the sensor's origin, in the axes of the sensor, mm.
    pub centre_mm: [f64; 3],
    /// Acceleration of gravity in the axes of the object, m/s².
    pub gravity_m_per_s2: [f64; 3],
}

impl Default for PayloadSection {
    fn default() -> Self {
        Self { mass_kg: 0.0, centre_mm: [0.0; 3], gravity_m_per_s2: [0.0, 0.0, -9.81] }
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

/// `contact`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSection {
    /// A force above this begins a contact, N.
    pub on_n: f64,
    /// A force below this ends it, N.
    pub off_n: f64,
}

impl Default for ContactSection {
    fn default() -> Self {
        let ContactGateParams { on, off } = ContactGateParams::default();
        Self { on_n: on, off_n: off }
    }
}

/// Which tip touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeName {
    /// A ball.
    #[default]
    Ball,
    /// The end of a cylinder.
    Flat,
    /// A cone with a round nose.
    Cone,
}

/// `tip`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TipSection {
    /// Which tip it is.
    pub shape: ShapeName,
    /// Radius of the ball, of the flat end, or of the nose of the cone, mm.
    pub radius_mm: f64,
    /// Radius of the rounded edge of a flat tip, mm; none: sharp.
    pub edge_radius_mm: Option<f64>,
    /// Angle between axis and flank of a cone, degrees.
    pub half_angle_deg: Option<f64>,
    /// How far from the origin of the pose a flat or cone tip is known to reach, mm; none: two diameters.
    pub length_mm: Option<f64>,
    /// Stiffness of stylus and holder at the ball, N/mm; none: rigid.
    pub stiffness_n_per_mm: Option<f64>,
}

impl Default for TipSection {
    /// A 3 mm ruby ball on a usual stylus.
    fn default() -> Self {
        Self {
            shape: ShapeName::Ball,
            radius_mm: 1.5,
            edge_radius_mm: None,
            half_angle_deg: None,
            length_mm: None,
            stiffness_n_per_mm: Some(20.0),
        }
    }
}

/// `scan`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScanSection {
    /// Standard deviation of the scan from the true surface, mm.
    pub noise_mm: f64,
}

impl Default for ScanSection {
    /// A consumer depth camera at half a metre.
    fn default() -> Self {
        Self { noise_mm: 0.6 }
    }
}

/// `sliding`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SlidingSection {
    /// Time constant of the filter on position and force, ms.
    pub smoothing_ms: f64,
    /// Time constant of the velocity, ms.
    pub velocity_smoothing_ms: f64,
    /// Slower than this the ball counts as being at rest, mm/s.
    pub slowest_mm_per_s: f64,
    /// Cosine of the widest friction cone believed.
    pub cone_cosine: f64,
}

impl Default for SlidingSection {
    fn default() -> Self {
        let SlidingParams { smoothing, velocity_smoothing, slowest, cone_cosine } = SlidingParams::default();
        Self {
            smoothing_ms: smoothing * 1e3,
            velocity_smoothing_ms: velocity_smoothing * 1e3,
            slowest_mm_per_s: slowest * 1e3,
            cone_cosine,
        }
    }
}

/// `carve`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CarveSection {
    /// Share of the depth that goes in a second, 1/s.
    pub rate_per_s: f64,
    /// Depth that is left alone, mm.
    pub tolerance_mm: f64,
    /// While in contact only what is deeper than this is carved, mm.
    pub contact_tolerance_mm: f64,
}

impl Default for CarveSection {
    fn default() -> Self {
        let CarveParams { rate, tolerance, contact_tolerance } = CarveParams::default();
        Self { rate_per_s: rate, tolerance_mm: tolerance * 1e3, contact_tolerance_mm: contact_tolerance * 1e3 }
    }
}

/// `guard`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GuardSection {
    /// Smallest twice area over longest edge squared.
    pub smallest_quality: f64,
    /// Smallest cosine between normals before and after one update.
    pub smallest_turn_cosine: f64,
    /// Smallest cosine between a normal and the last that was scanned or felt there.
    pub smallest_evidence_cosine: f64,
    /// Smallest cosine between neighbours.
    pub smallest_fold_cosine: f64,
    /// Faces nearer than this many mean edges count as touching.
    pub gap_edges: f64,
}

impl Default for GuardSection {
    fn default() -> Self {
        let guard = GuardParams::default();
        Self {
            smallest_quality: guard.smallest_quality,
            smallest_turn_cosine: guard.smallest_turn_cosine,
            smallest_evidence_cosine: guard.smallest_evidence_cosine,
            smallest_fold_cosine: guard.smallest_fold_cosine,
            gap_edges: guard.gap_share,
        }
    }
}

/// Which rule moves the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// What works on real scans.
    #[default]
    Robust,
    /// The published rule, taken literally: no gate, no friction, no carving, whatever the scene names.
    Paper,
}

/// What force the scan lets expect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelName {
    /// `f_max_n`, `h_min_mm`, `delta` (Eq 3).
    Sigmoid,
    /// The stiffness of the tip.
    Spring,
}

/// How the exact sub-flows of a step are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StepName {
    /// Position, then rotation.
    Lie,
    /// With the drift that the rotation causes.
    Corrected,
    /// Adaptive Runge–Kutta.
    Dp5,
}

/// In which direction a face moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AlongName {
    /// Its normal at the start of the sample (Eq 6).
    Normal0,
    /// The felt force.
    Force,
}

/// `refine`; a key that is left out is as the mode has it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RefineSection {
    /// Which rule moves the mesh.
    pub mode: Mode,
    /// What force the scan lets expect; left out: the spring of a tip whose stiffness is known, or else the sigmoid.
    pub contact_model: Option<ModelName>,
    /// Largest force of the sigmoid, N.
    pub f_max_n: f64,
    /// Width of the sigmoid, mm.
    pub h_min_mm: f64,
    /// Shift of the sigmoid.
    pub delta: f64,
    /// Speed of a face for each newton of mismatch, m/(N·s).
    pub alpha_m_per_n_s: Option<f64>,
    /// Turning speed of a face for each square newton of mismatch, 1/(N²·s).
    pub beta_per_n2_s: Option<f64>,
    /// Rate at which a face turns to the felt normal, whatever the mismatch, 1/s.
    pub turning_per_s: Option<f64>,
    /// How the sub-flows of a step are put together.
    pub step: Option<StepName>,
    /// In which direction a face moves.
    pub along: Option<AlongName>,
    /// Vertices within this distance of the touched face follow it, mm.
    pub roi_mm: Option<f64>,
}

impl Default for RefineSection {
    fn default() -> Self {
        let sigmoid = match DynamicsParams::default().model {
            ContactModel::Sigmoid { f_max_n, h_min_m, delta } => (f_max_n, h_min_m * 1e3, delta),
            ContactModel::Spring { .. } => (10.0, 0.5, 5.0),
        };
        let (f_max_n, h_min_mm, delta) = sigmoid;
        Self {
            mode: Mode::default(),
            contact_model: None,
            f_max_n,
            h_min_mm,
            delta,
            alpha_m_per_n_s: None,
            beta_per_n2_s: None,
            turning_per_s: None,
            step: None,
            along: None,
            roi_mm: None,
        }
    }
}

/// `patch`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PatchSection {
    /// Edge length of the new faces, mm; none: half the radius of the tip.
    pub pitch_mm: Option<f64>,
    /// The result has at most this many times the faces of the scan.
    pub most_faces: f64,
}

impl Default for PatchSection {
    fn default() -> Self {
        Self { pitch_mm: None, most_faces: 10.0 }
    }
}

/// `uncertainty`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct UncertaintySection {
    /// What is left after calibrating the tip's radius and the frame of the scan, along the normal, mm.
    pub calibration_mm: f64,
    /// … and the stiffness of the tip, %.
    pub stiffness_percent: f64,
    /// A touch that contradicts its place by more than this many standard deviations is held apart.
    pub gate_sigmas: f64,
}

impl Default for UncertaintySection {
    fn default() -> Self {
        let CalibrationParams { position, stiffness_share } = CalibrationParams::default();
        let gate_sigmas = UncertaintyParams::new(0.0).gate_sigmas;
        Self { calibration_mm: position * 1e3, stiffness_percent: stiffness_share * 100.0, gate_sigmas }
    }
}

impl SyncSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("sync.reorder_ms", self.reorder_ms, 0.0, 6e4, "0 to 60000 ms")?;
        in_range("sync.largest_gap_ms", self.largest_gap_ms, 0.0, 6e4, "0 to 60000 ms")?;
        in_range("sync.largest_jump_s", self.largest_jump_s, 0.0, 1e6, "0 to 1e6 s")?;
        in_range("sync.wrench_offset_ms", self.wrench_offset_ms, -6e4, 6e4, "-60000 to 60000 ms")?;
        in_range("sync.capacity", self.capacity as f64, 2.0, 1e6, "2 to 1000000 messages")
    }
}

impl CompensationSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        let all = |key, values: &[f64], largest: f64, allowed| {
            values.iter().try_for_each(|&value| in_range(key, value, -largest, largest, allowed))
        };
        all("compensation.sensor_position_mm", &self.sensor_position_mm, 1e5, "-100000 to 100000 mm")?;
        if let Some(xyzw) = self.sensor_orientation_xyzw {
            let norm = xyzw.iter().map(|c| c * c).sum::<f64>().sqrt();
            let allowed = "a quaternion of length 1 within 0.001 (this is its length)";
            in_range("compensation.sensor_orientation_xyzw", norm, 0.999, 1.001, allowed)?;
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

impl MarkersSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
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

impl BiasTrackingSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("bias_tracking.free_n", self.free_n, 1e-6, 1e3, "1e-6 to 1000 N")?;
        in_range("bias_tracking.settle_ms", self.settle_ms, 1e-3, 6e4, "0.001 to 60000 ms")?;
        in_range("bias_tracking.time_s", self.time_s, 1e-6, 1e6, "1e-6 to 1e6 s")
    }
}

impl ContactSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("contact.off_n", self.off_n, 0.0, 1e3, "0 to 1000 N")?;
        in_range("contact.on_n", self.on_n, self.off_n, 1e3, "contact.off_n to 1000 N")
    }
}

/// Length of a tip that the scene does not name, in diameters, and for a sharp cone no less than this, mm.
const USUAL_LENGTH: (f64, f64) = (2.0, 5.0);

impl TipSection {
    /// The shape in SI; the keys were checked before.
    pub(super) fn tip_shape(&self) -> TipShape {
        let (diameters, least) = USUAL_LENGTH;
        let length = self.length_mm.unwrap_or((diameters * 2.0 * self.radius_mm).max(least)) / 1e3;
        match self.shape {
            ShapeName::Ball => TipShape::Ball,
            ShapeName::Flat => TipShape::Flat { edge_radius: self.edge_radius_mm.unwrap_or(0.0) / 1e3, length },
            ShapeName::Cone => {
                TipShape::Cone { half_angle: self.half_angle_deg.unwrap_or_default().to_radians(), length }
            }
        }
    }

    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("tip.radius_mm", self.radius_mm, 0.0, 1e3, "0 to 1000 mm")?;
        self.check_shape()?;
        let stiffness = self.stiffness_n_per_mm.unwrap_or(1.0);
        in_range("tip.stiffness_n_per_mm", stiffness, 1e-3, 1e9, "0.001 to 1e9 N/mm; leave it out for rigid")
    }

    /// Keys that another shape needs are not looked at.
    fn check_shape(&self) -> Result<(), SceneError> {
        match self.shape {
            ShapeName::Ball => return Ok(()),
            ShapeName::Flat => {
                in_range("tip.radius_mm", self.radius_mm, 1e-3, 1e3, "0.001 to 1000 mm for a flat tip")?;
                let edge = self.edge_radius_mm.unwrap_or(0.0);
                in_range("tip.edge_radius_mm", edge, 0.0, self.radius_mm, "0 mm to tip.radius_mm")?;
            }
            ShapeName::Cone => {
                let Some(half_angle) = self.half_angle_deg else {
                    return Err(SceneError::Incomplete { key: "tip.shape: cone", needs: "tip.half_angle_deg" });
                };
                let allowed = "1 to 80 degrees; take shape: flat for a blunter one";
                in_range("tip.half_angle_deg", half_angle, 1.0, 80.0, allowed)?;
            }
        }
        // the rounded edge is a part of the length
        let least = if self.shape == ShapeName::Flat { self.edge_radius_mm.unwrap_or(0.0) } else { 0.0 } + 1e-3;
        in_range("tip.length_mm", self.length_mm.unwrap_or(least), least, 1e3, "more than the edge radius, to 1000 mm")
    }
}

impl ScanSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("scan.noise_mm", self.noise_mm, 0.0, 1e3, "0 to 1000 mm")
    }
}

impl SlidingSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("sliding.smoothing_ms", self.smoothing_ms, 0.0, 1e4, "0 to 10000 ms")?;
        in_range("sliding.velocity_smoothing_ms", self.velocity_smoothing_ms, 0.0, 1e4, "0 to 10000 ms")?;
        in_range("sliding.slowest_mm_per_s", self.slowest_mm_per_s, 0.0, 1e6, "0 to 1e6 mm/s")?;
        in_range("sliding.cone_cosine", self.cone_cosine, 0.0, 1.0, "0 to 1")
    }
}

impl GuardSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("guard.smallest_quality", self.smallest_quality, 0.0, 0.87, "0 to 0.87")?;
        for (key, value) in [
            ("guard.smallest_turn_cosine", self.smallest_turn_cosine),
            ("guard.smallest_evidence_cosine", self.smallest_evidence_cosine),
            ("guard.smallest_fold_cosine", self.smallest_fold_cosine),
        ] {
            in_range(key, value, -1.0, 1.0, "-1 to 1")?;
        }
        in_range("guard.gap_edges", self.gap_edges, 0.0, 1.0, "0 to 1")
    }
}

impl CarveSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("carve.rate_per_s", self.rate_per_s, 0.0, 1e6, "0 to 1e6 1/s")?;
        in_range("carve.tolerance_mm", self.tolerance_mm, 0.0, 1e3, "0 to 1000 mm")?;
        in_range("carve.contact_tolerance_mm", self.contact_tolerance_mm, 0.0, 1e3, "0 to 1000 mm")
    }
}

impl PatchSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("patch.pitch_mm", self.pitch_mm.unwrap_or(1.0), 1e-3, 1e3, "0.001 to 1000 mm")?;
        in_range("patch.most_faces", self.most_faces, 1.0, 1e6, "1 to 1000000 times the faces of the scan")
    }
}

impl UncertaintySection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("uncertainty.calibration_mm", self.calibration_mm, 0.0, 1e3, "0 to 1000 mm")?;
        in_range("uncertainty.stiffness_percent", self.stiffness_percent, 0.0, 100.0, "0 to 100 %")?;
        in_range("uncertainty.gate_sigmas", self.gate_sigmas, 0.5, 1e6, "0.5 to 1000000 standard deviations")
    }
}

impl RefineSection {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        in_range("refine.f_max_n", self.f_max_n, 1e-6, 1e6, "1e-6 to 1e6 N")?;
        in_range("refine.h_min_mm", self.h_min_mm, 1e-9, 1e6, "1e-9 to 1e6 mm")?;
        in_range("refine.delta", self.delta, -50.0, 50.0, "-50 to 50")?;
        in_range("refine.alpha_m_per_n_s", self.alpha_m_per_n_s.unwrap_or(0.0), 0.0, 1e6, "0 to 1e6 m/(N s)")?;
        in_range("refine.beta_per_n2_s", self.beta_per_n2_s.unwrap_or(0.0), 0.0, 1e9, "0 to 1e9 1/(N² s)")?;
        in_range("refine.turning_per_s", self.turning_per_s.unwrap_or(0.0), 0.0, 1e6, "0 to 1e6 1/s")?;
        in_range("refine.roi_mm", self.roi_mm.unwrap_or(0.0), 0.0, 1e3, "0 to 1000 mm")
    }
}

/// A key that is there names its part, also without a value.
pub(super) fn named<'de, D: Deserializer<'de>, T: Deserialize<'de> + Default>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    Option::<T>::deserialize(deserializer).map(|part| Some(part.unwrap_or_default()))
}

fn in_range(key: &'static str, value: f64, low: f64, high: f64, allowed: &'static str) -> Result<(), SceneError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(SceneError::OutOfRange { key, value, allowed }) }
}
