//! Scan points without a surface.

use nalgebra::{Point3, Vector3};

/// Points of a scan in the order of their file.
#[derive(Clone, Debug, Default)]
pub struct PointCloud {
    /// N, m, in the file's own frame, which becomes O; NaN and infinity are allowed
    pub positions: Vec<Point3<f64>>,
    /// N outward normals of any length, or none at all
    pub normals: Vec<Vector3<f64>>,
    /// in the order of their points; N points in all
    pub stations: Vec<ScanStation>,
}

/// Points scanned from one place.
#[derive(Clone, Copy, Debug)]
pub struct ScanStation {
    /// number of its points
    pub points: usize,
    /// position of the scanner, m; `None`: not in the file
    pub eye: Option<Point3<f64>>,
    /// whether the scanner saw every point from there, as the points are a grid of its rays; else
    /// the position may be a mere default, or that of a file of merged scans
    pub is_sure: bool,
}

impl ScanStation {
    /// Points from an unknown place.
    pub fn unknown(points: usize) -> Self {
        Self {
            points,
            eye: None,
            is_sure: false,
        }
    }
}
