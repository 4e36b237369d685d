//! What counts as evidence, in the haptic update and in the patch, and how the surface is meshed anew from it.

use serde::Deserialize;

use super::in_range;
use crate::scene::SceneError;
use touchup_core::patch::{CalibrationParams, UncertaintyParams};
use touchup_core::refine::{CarveParams, SlidingParams};

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

impl SlidingSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("sliding.smoothing_ms", self.smoothing_ms, 0.0, 1e4, "0 to 10000 ms")?;
        in_range("sliding.velocity_smoothing_ms", self.velocity_smoothing_ms, 0.0, 1e4, "0 to 10000 ms")?;
        in_range("sliding.slowest_mm_per_s", self.slowest_mm_per_s, 0.0, 1e6, "0 to 1e6 mm/s")?;
        in_range("sliding.cone_cosine", self.cone_cosine, 0.0, 1.0, "0 to 1")
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

impl CarveSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("carve.rate_per_s", self.rate_per_s, 0.0, 1e6, "0 to 1e6 1/s")?;
        in_range("carve.tolerance_mm", self.tolerance_mm, 0.0, 1e3, "0 to 1000 mm")?;
        in_range("carve.contact_tolerance_mm", self.contact_tolerance_mm, 0.0, 1e3, "0 to 1000 mm")
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

impl PatchSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("patch.pitch_mm", self.pitch_mm.unwrap_or(1.0), 1e-3, 1e3, "0.001 to 1000 mm")?;
        in_range("patch.most_faces", self.most_faces, 1.0, 1e6, "1 to 1000000 times the faces of the scan")
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
    /// A touch that contradicts its place by more than this many standard deviations is rejected.
    pub gate_sigmas: f64,
}

impl Default for UncertaintySection {
    fn default() -> Self {
        let CalibrationParams { position, stiffness_share } = CalibrationParams::default();
        let gate_sigmas = UncertaintyParams::new(0.0).gate_sigmas;
        Self { calibration_mm: position * 1e3, stiffness_percent: stiffness_share * 100.0, gate_sigmas }
    }
}

impl UncertaintySection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("uncertainty.calibration_mm", self.calibration_mm, 0.0, 1e3, "0 to 1000 mm")?;
        in_range("uncertainty.stiffness_percent", self.stiffness_percent, 0.0, 100.0, "0 to 100 %")?;
        in_range("uncertainty.gate_sigmas", self.gate_sigmas, 0.5, 1e6, "0.5 to 1000000 standard deviations")
    }
}
