//! What touches and what is touched: the gate, the tip, the scan.

use std::path::PathBuf;

use serde::Deserialize;

use super::in_range;
use crate::scene::SceneError;
use touchup_core::touch::{ContactGateParams, TipShape};
use touchup_io::mesh_file::MeshUnit;

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

impl ContactSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("contact.off_n", self.off_n, 0.0, 1e3, "0 to 1000 N")?;
        in_range("contact.on_n", self.on_n, self.off_n, 1e3, "contact.off_n to 1000 N")
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
    /// Centre of the ball from the origin of the recorded pose, in its axes, mm; none: it is that origin.
    pub offset_mm: Option<[f64; 3]>,
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
            offset_mm: None,
        }
    }
}

/// Length of a tip that the scene does not name, in diameters, and for a sharp cone no less than this, mm.
const USUAL_LENGTH: (f64, f64) = (2.0, 5.0);

impl TipSection {
    /// The shape in SI; the keys were checked before.
    pub(in crate::scene) fn tip_shape(&self) -> TipShape {
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

    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("tip.radius_mm", self.radius_mm, 0.0, 1e3, "0 to 1000 mm")?;
        self.check_shape()?;
        for &x in self.offset_mm.iter().flatten() {
            in_range("tip.offset_mm", x, -1e4, 1e4, "-10000 to 10000 mm")?;
        }
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

/// `scan`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScanSection {
    /// The scan itself, where none is named otherwise; relative to the folder of the scene.
    pub file: Option<PathBuf>,
    /// Unit of the coordinates in that file.
    pub unit: MeshUnit,
    /// Standard deviation of the scan from the true surface, mm.
    pub noise_mm: f64,
    /// Lowest corner of the box that the ball's centre is in when it touches, in the frame of the scan, mm; none: anywhere.
    pub region_low_mm: Option<[f64; 3]>,
    /// … and its highest corner, mm.
    pub region_high_mm: Option<[f64; 3]>,
}

impl Default for ScanSection {
    /// A consumer depth camera at half a metre.
    fn default() -> Self {
        Self { file: None, unit: MeshUnit::Millimetre, noise_mm: 0.6, region_low_mm: None, region_high_mm: None }
    }
}

impl ScanSection {
    pub(in crate::scene) fn check(&self) -> Result<(), SceneError> {
        in_range("scan.noise_mm", self.noise_mm, 0.0, 1e3, "0 to 1000 mm")?;
        let (low, high) = match (self.region_low_mm, self.region_high_mm) {
            (None, None) => return Ok(()),
            (Some(low), Some(high)) => (low, high),
            (Some(_), None) => {
                return Err(SceneError::Incomplete { key: "scan.region_low_mm", needs: "scan.region_high_mm" });
            }
            (None, Some(_)) => {
                return Err(SceneError::Incomplete { key: "scan.region_high_mm", needs: "scan.region_low_mm" });
            }
        };
        for (low, high) in low.into_iter().zip(high) {
            in_range("scan.region_low_mm", low, -1e6, 1e6, "-1e6 to 1e6 mm")?;
            in_range("scan.region_high_mm", high, -1e6, 1e6, "-1e6 to 1e6 mm")?;
            if low >= high {
                let allowed = "more than scan.region_low_mm along each axis";
                return Err(SceneError::OutOfRange { key: "scan.region_high_mm", value: high, allowed });
            }
        }
        Ok(())
    }
}
