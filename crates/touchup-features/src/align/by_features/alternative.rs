//! Inputs of an alignment by features, and one resulting motion.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::align::icp::IcpFit;
use touchup_geometry::mesh::{FaceTree, TriMesh};

/// Settings of [`super::align_features`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeaturesParams {
    /// Largest offset of features beyond three standard uncertainties, over the size of the target.
    /// Default 0.01: 1 mm on a part of 100 mm, as in a poor scan.
    pub tolerance: f64,
    /// Largest difference of diameters and widths beyond three standard uncertainties, over their
    /// size. Default 0.05: the flats of a hole of 12 sides lie 3.4 % inside.
    pub size_tolerance: f64,
}

impl Default for FeaturesParams {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            size_tolerance: 0.05,
        }
    }
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedSample {
    /// m
    pub point: Point3<f64>,
    /// outward unit normal
    pub normal: Vector3<f64>,
}

/// Surfaces as evidence beside the features.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<'a> {
    /// points spread evenly over the source; 20 000 suffice
    pub points: &'a [OrientedSample],
    /// surface onto which the points move
    pub target: &'a TriMesh,
    /// tree over the faces of `target`
    pub tree: &'a FaceTree,
}

/// One motion, and the evidence for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// Moves the source onto the target.
    pub source_to_target: Isometry3<f64>,
    /// Matched features: indices into the lists of source and target.
    pub explained: Vec<[usize; 2]>,
    /// Share of the points on the target, within three times the tolerance and with similar
    /// normals; `None` without surfaces.
    pub agreeing: Option<f64>,
    /// Fit of the surfaces; `None` without surfaces, or if the fit did not converge.
    pub icp: Option<IcpFit>,
    /// Difference from the first alternative: rotation vector, rad, and shift of the middle of the
    /// features, m; in the frame of the target.
    pub differs: [Vector3<f64>; 2],
}

/// Largest distance between features, in tolerances, at which two motions count as one.
pub(super) const SAME: f64 = 2.0;
