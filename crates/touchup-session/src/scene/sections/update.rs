//! The haptic update: how a face is moved, and what keeps the mesh sound.

use serde::Deserialize;

use super::in_range;
use crate::scene::SceneError;
use touchup_core::refine::{ContactModel, DynamicsParams, GuardParams};

/// `guard`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GuardSection {
    /// Smallest twice area over longest edge squared; nine tenths of what a thin triangle was scanned with.
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

impl GuardSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
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

impl RefineSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("refine.f_max_n", self.f_max_n, 1e-6, 1e6, "1e-6 to 1e6 N")?;
        in_range("refine.h_min_mm", self.h_min_mm, 1e-9, 1e6, "1e-9 to 1e6 mm")?;
        in_range("refine.delta", self.delta, -50.0, 50.0, "-50 to 50")?;
        in_range("refine.alpha_m_per_n_s", self.alpha_m_per_n_s.unwrap_or(0.0), 0.0, 1e6, "0 to 1e6 m/(N s)")?;
        in_range("refine.beta_per_n2_s", self.beta_per_n2_s.unwrap_or(0.0), 0.0, 1e9, "0 to 1e9 1/(N² s)")?;
        in_range("refine.turning_per_s", self.turning_per_s.unwrap_or(0.0), 0.0, 1e6, "0 to 1e6 1/s")?;
        in_range("refine.roi_mm", self.roi_mm.unwrap_or(0.0), 0.0, 1e3, "0 to 1000 mm")
    }
}
