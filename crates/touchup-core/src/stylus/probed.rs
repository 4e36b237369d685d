//! The record of each touch, so that every later measurement can be traced back to it.

use nalgebra::{Point3, Vector3};

/// One touch of the part.
///
/// Its surface lies at `radius` from `centre`, whatever the measured normal; `point` and `normal`
/// identify that surface.
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
    /// measured outward unit normal of the surface there, in O
    pub normal: Vector3<f64>,
    /// standard deviation of the centre along the normal by what averages out, m; 0 where that is
    /// not estimated
    pub sigma: f64,
    /// … by what the calibration of radius and stiffness leaves, the same in each touch, m
    pub calibration: f64,
    /// … by what the place of the scan is off, the same displacement in each touch, m
    pub place: f64,
    /// what it counts beside others, at most 1
    pub weight: f64,
    /// it contradicts earlier contacts there: an outlier, a slip
    pub is_rejected: bool,
}

impl ProbedPoint {
    /// Standard deviation of the centre along the normal by all causes, m.
    pub(crate) fn sigma_along_normal(&self) -> f64 {
        self.sigma.hypot(self.calibration).hypot(self.place)
    }
}
