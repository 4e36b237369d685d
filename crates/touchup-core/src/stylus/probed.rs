//! What is kept of each touch, so that whatever is measured later can be followed back to it.

use nalgebra::{Point3, Vector3};

/// One touch of the part.
///
/// A surface that it is of lies at `radius` from `centre`, whatever the normal that was felt; `point` and `normal` say which
/// surface that is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbedPoint {
    /// stamp of the sample, ns
    pub stamp_ns: i64,
    /// which stroke it is of: what was touched without a pause, from 0 on
    pub stroke: u32,
    /// centre of the real ball, m, in O; of another tip the point that touched
    pub centre: Point3<f64>,
    /// radius of the ball, m; 0 for another tip
    pub radius: f64,
    /// point of the surface, m, in O
    pub point: Point3<f64>,
    /// outward unit normal of the surface there as it was felt, in O
    pub normal: Vector3<f64>,
    /// standard deviation of the centre along the normal by what averages out, m; 0 where that was not asked for
    pub sigma: f64,
    /// … by what the calibration leaves, the same in each touch, m
    pub calibration: f64,
    /// what it counts beside others, at most 1
    pub weight: f64,
    /// it contradicts what was felt there before: an outlier, a slip
    pub is_rejected: bool,
}
