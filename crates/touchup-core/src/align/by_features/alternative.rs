//! What an alignment by features is given, and one motion that it finds.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::align::icp::IcpFit;
use crate::mesh::{FaceTree, TriMesh};

/// Settings of [`super::align_features`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeaturesParams {
    /// By how much features may be out of place beyond three standard uncertainties, over the size
    /// of the target. Default 0.01: 1 mm on a part of 100 mm, as a poor scan has them.
    pub tolerance: f64,
    /// By how much diameters and widths may differ beyond three standard uncertainties, over their
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

/// What is known beside the features.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<'a> {
    /// spread evenly over the source; 20 000 do
    pub points: &'a [OrientedSample],
    /// what they are brought onto
    pub target: &'a TriMesh,
    /// over its faces
    pub tree: &'a FaceTree,
}

/// One motion, and the evidence for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// Moves the source onto the target.
    pub source_to_target: Isometry3<f64>,
    /// Matched features: numbers in the lists of source and target.
    pub explained: Vec<[usize; 2]>,
    /// Share of the points that lie on the target, within three times the tolerance, with normals
    /// alike; `None` without surfaces.
    pub agreeing: Option<f64>,
    /// How the surfaces fit; `None` without surfaces, or where the fit did not converge.
    pub icp: Option<IcpFit>,
    /// Against the first alternative: rotation vector, rad, and shift of the middle of the
    /// features, m; in the frame of the target.
    pub differs: [Vector3<f64>; 2],
}

/// Two motions are one when they move features no farther apart than so many tolerances.
pub(super) const SAME: f64 = 2.0;
