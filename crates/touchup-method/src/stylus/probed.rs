//! Record of each touch, for tracing every later measurement back to it.

use nalgebra::{Point3, Vector3};

/// One touch of the part.
///
/// The surface lies at `radius` from `centre`, whatever the measured normal; `point` and `normal`
/// identify that surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbedPoint {
    /// stamp of the sample, ns
    pub stamp_ns: i64,
    /// index of its stroke, from 0 on; a pause separates strokes
    pub stroke: u32,
    /// centre of the real ball, m, in O; for another tip its touching point
    pub centre: Point3<f64>,
    /// radius of the ball, m; 0 for another tip
    pub radius: f64,
    /// point of the surface, m, in O
    pub point: Point3<f64>,
    /// measured outward unit normal of the surface there, in O
    pub normal: Vector3<f64>,
    /// standard deviation of the centre along the normal from errors that average out, m; 0 if not
    /// estimated
    pub sigma: f64,
    /// standard deviation from the calibration of radius and stiffness, the same in each touch, m
    pub calibration: f64,
    /// standard deviation from the scan position and from what was taken off, the same displacement
    /// in each touch after it, m
    pub place: f64,
    /// weight beside other touches, at most 1
    pub weight: f64,
    /// whether it contradicts earlier contacts there: an outlier, a slip
    pub is_rejected: bool,
}

impl ProbedPoint {
    /// Standard deviation of the centre along the normal from all causes, m.
    pub fn sigma_along_normal(&self) -> f64 {
        self.sigma.hypot(self.calibration).hypot(self.place)
    }
}
