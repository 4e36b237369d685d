//! A feature of the drawing, and its measurement.

use nalgebra::{Point3, Vector3};

use crate::features::FeatureKind;

/// A measured feature and its nominal counterpart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatumPair {
    /// kind of both
    pub kind: FeatureKind,
    /// nominal centre, m, in the frame of the drawing
    pub nominal: Point3<f64>,
    /// nominal axis or outward normal, unit vector
    pub nominal_axis: Option<Vector3<f64>>,
    /// measured centre, m, in O
    pub measured: Point3<f64>,
    /// measured axis or outward normal, unit vector
    pub measured_axis: Vector3<f64>,
    /// standard uncertainty of the measured centre, root mean square distance across the axis, of a
    /// plane along its normal, m
    pub place_std: f64,
    /// standard uncertainty of the measured axis, rad; `None`: its direction is unused
    pub axis_std: Option<f64>,
}
