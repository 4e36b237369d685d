//! `known_surfaces.jsonl`, beside a recording: the surfaces that fits to its touches know, a line of
//! JSON each.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::file_error::{FileError, FilePlace, MAX_FILE_BYTES, read_up_to};
use crate::json_lines::JsonLineError;
use crate::probed_touches_file::whole_lines;
use touchup_geometry::brep::{AnalyticSurface, SurfaceShape};
use touchup_method::reconstruct::KnownSurface;

const NAME: &str = "known_surfaces.jsonl";

/// Path of the file beside a recording.
pub fn known_surfaces_beside(recording: &Path) -> PathBuf {
    recording.with_file_name(NAME)
}

/// One line; lengths in mm of O.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownSurfaceLine {
    shape: ShapeRecord,
    /// a place on the axis, of a plane on itself, of a cone the centre of its circle, of a sphere its
    /// centre
    origin_mm: [f64; 3],
    /// unit vector; of a plane out of the material
    axis: [f64; 3],
    /// whether the material is outside, as of a hole
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    is_concave: bool,
    /// largest standard uncertainty along the normal
    sigma_mm: f64,
    /// of the tip with which it was touched
    tip_radius_mm: f64,
    /// contacts on it
    contacts_mm: Vec<[f64; 3]>,
    /// further contacts of its fit, on other surfaces
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    other_contacts_mm: Vec<[f64; 3]>,
    /// untouched places up to which it goes on: of its edges
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    ends_mm: Vec<[f64; 3]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum ShapeRecord {
    Plane,
    Cylinder { radius_mm: f64 },
    Cone { radius_mm: f64, half_angle_deg: f64 },
    Sphere { radius_mm: f64 },
}

fn mm(places: &[Point3<f64>]) -> Vec<[f64; 3]> {
    places
        .iter()
        .map(|place| (place * 1e3).coords.into())
        .collect()
}

fn metres(places: &[[f64; 3]]) -> Vec<Point3<f64>> {
    places
        .iter()
        .map(|place| Point3::from(*place) / 1e3)
        .collect()
}

impl KnownSurfaceLine {
    /// - `tip_radius`: m
    pub fn of(known: &KnownSurface, tip_radius: f64) -> Self {
        let AnalyticSurface { placement, shape } = known.surface;
        Self {
            shape: match shape {
                SurfaceShape::Plane => ShapeRecord::Plane,
                SurfaceShape::Cylinder { radius } => ShapeRecord::Cylinder {
                    radius_mm: radius * 1e3,
                },
                SurfaceShape::Cone { radius, half_angle } => ShapeRecord::Cone {
                    radius_mm: radius * 1e3,
                    half_angle_deg: half_angle.to_degrees(),
                },
                SurfaceShape::Sphere { radius } => ShapeRecord::Sphere {
                    radius_mm: radius * 1e3,
                },
            },
            origin_mm: (placement.origin * 1e3).coords.into(),
            axis: placement.axis.into(),
            is_concave: known.is_concave,
            sigma_mm: known.sigma * 1e3,
            tip_radius_mm: tip_radius * 1e3,
            contacts_mm: mm(&known.contacts),
            other_contacts_mm: mm(&known.others),
            ends_mm: mm(&known.ends),
        }
    }

    /// The surface, m.
    pub fn surface(&self) -> KnownSurface {
        let shape = match self.shape {
            ShapeRecord::Plane => SurfaceShape::Plane,
            ShapeRecord::Cylinder { radius_mm } => SurfaceShape::Cylinder {
                radius: radius_mm / 1e3,
            },
            ShapeRecord::Cone {
                radius_mm,
                half_angle_deg,
            } => SurfaceShape::Cone {
                radius: radius_mm / 1e3,
                half_angle: half_angle_deg.to_radians(),
            },
            ShapeRecord::Sphere { radius_mm } => SurfaceShape::Sphere {
                radius: radius_mm / 1e3,
            },
        };
        let (origin, axis) = (Point3::from(self.origin_mm) / 1e3, Vector3::from(self.axis));
        KnownSurface {
            surface: AnalyticSurface::along(origin, axis, shape),
            is_concave: self.is_concave,
            sigma: self.sigma_mm / 1e3,
            contacts: metres(&self.contacts_mm),
            others: metres(&self.other_contacts_mm),
            ends: metres(&self.ends_mm),
        }
    }

    /// Radius of the tip with which it was touched, m.
    pub fn tip_radius(&self) -> f64 {
        self.tip_radius_mm / 1e3
    }
}

/// Surfaces of a file, in its order; none without a file.
///
/// # Errors
/// [`JsonLineError`], also for a whole line that is no surface.
pub fn read_known_surfaces(path: &Path) -> Result<Vec<KnownSurfaceLine>, JsonLineError> {
    let text = match read_up_to(path, MAX_FILE_BYTES) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        text => text.map_err(|source| FileError::Read {
            path: path.to_owned(),
            source,
        })?,
    };
    let lines = whole_lines(&text).split_inclusive(|byte| *byte == b'\n');
    let line = |(at, line)| {
        serde_json::from_slice(line).map_err(|error| bad_surface_line(path, at, &error))
    };
    (0..).zip(lines).map(line).collect()
}

/// Error of a line of the file.
///
/// - `at`: its number, from 0 on.
pub fn bad_surface_line(path: &Path, at: usize, why: &dyn std::fmt::Display) -> JsonLineError {
    let why = why.to_string();
    JsonLineError::Line {
        path: path.to_owned(),
        place: FilePlace::Line(at + 1),
        why: why
            .rsplit_once(" at line ")
            .map_or(&*why, |(why, _)| why)
            .to_owned(),
    }
}

/// Appends surfaces, which are on the disk when this returns, as another reader finds them there.
///
/// - `tip_radius`: of the touches, m.
///
/// # Errors
/// Any error of the file.
pub fn append_known_surfaces(
    path: &Path,
    surfaces: &[KnownSurface],
    tip_radius: f64,
) -> io::Result<Vec<KnownSurface>> {
    let lines: Vec<_> = surfaces
        .iter()
        .map(|known| KnownSurfaceLine::of(known, tip_radius))
        .collect();
    let mut text = Vec::new();
    for line in &lines {
        serde_json::to_writer(&mut text, line)?;
        text.push(b'\n');
    }
    let mut file = OpenOptions::new().create(true).append(true).open(path)?;
    file.write_all(&text)?;
    file.sync_data()?;
    Ok(lines.iter().map(KnownSurfaceLine::surface).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hole() -> KnownSurface {
        let (origin, axis) = (
            Point3::new(0.016, 0.036, 0.012),
            Vector3::new(0.1, 0.0, 1.0),
        );
        let shape = SurfaceShape::Cylinder { radius: 0.004 };
        KnownSurface {
            surface: AnalyticSurface::along(origin, axis, shape),
            is_concave: true,
            sigma: 7e-6,
            contacts: vec![Point3::new(0.0201, 0.036, 0.01)],
            others: Vec::new(),
            ends: vec![Point3::new(0.02, 0.036, 0.012)],
        }
    }

    #[test]
    fn what_is_appended_is_read_as_it_was_given_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = known_surfaces_beside(&folder.path().join("recording"));
        assert_eq!(read_known_surfaces(&path).unwrap(), []);
        let cone = SurfaceShape::Cone {
            radius: 0.003,
            half_angle: 0.7,
        };
        let cone = KnownSurface {
            surface: AnalyticSurface {
                shape: cone,
                ..hole().surface
            },
            ..hole()
        };
        let mut written = Vec::new();
        for known in [hole(), cone] {
            written.extend(append_known_surfaces(&path, &[known], 1.5e-3).unwrap());
        }
        // a line that a crash cut off
        OpenOptions::new()
            .append(true)
            .open(&path)
            .unwrap()
            .write_all(b"{\"shape\":\"pla")
            .unwrap();
        let read = read_known_surfaces(&path).unwrap();
        let surfaces: Vec<_> = read.iter().map(KnownSurfaceLine::surface).collect();
        assert_eq!(surfaces, written);
        assert!((read[0].tip_radius() - 1.5e-3).abs() < 1e-18);
        let (given, known) = (hole(), &surfaces[0]);
        assert!((given.contacts[0] - known.contacts[0]).norm() < 1e-15);
        assert!((given.surface.placement.axis - known.surface.placement.axis).norm() < 1e-15);
    }

    #[test]
    fn a_bad_line_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        append_known_surfaces(&path, &[hole()], 1.5e-3).unwrap();
        let good = std::fs::read_to_string(&path).unwrap();
        for bad in [
            "{}",
            "",
            "null",
            &good.trim().replace("cylinder", "torus"),
            &good.trim().replace("axis", "axes"),
        ] {
            std::fs::write(&path, format!("{good}{bad}\n")).unwrap();
            let why = read_known_surfaces(&path).unwrap_err().to_string();
            assert!(why.contains("known_surfaces.jsonl: line 2: "), "{why}");
        }
    }
}
