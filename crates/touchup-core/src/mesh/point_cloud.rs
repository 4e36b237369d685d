//! Points of a scan, before there is a surface.

use nalgebra::{Point3, Vector3};

/// Points of a scan in the order of their file.
#[derive(Clone, Debug, Default)]
pub struct PointCloud {
    /// N, m, in the file's own frame, which becomes O; NaN and infinity are allowed
    pub positions: Vec<Point3<f64>>,
    /// N, of any length, out of the object; or none at all
    pub normals: Vec<Vector3<f64>>,
    /// whose points follow one another; N points in all
    pub stations: Vec<ScanStation>,
}

/// Points that were scanned from one place.
#[derive(Clone, Copy, Debug)]
pub struct ScanStation {
    /// how many of the points are of it
    pub points: usize,
    /// where the scanner stood, m; `None`: the file does not say
    pub eye: Option<Point3<f64>>,
    /// whether it saw every point from there, as the points are a grid of its rays; else the place
    /// may be a mere default, or that of a file in which scans were merged
    pub is_sure: bool,
}

impl ScanStation {
    /// Points from a place that is not known.
    pub fn unknown(points: usize) -> Self {
        Self {
            points,
            eye: None,
            is_sure: false,
        }
    }
}
