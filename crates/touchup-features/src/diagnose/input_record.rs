//! Samples kept by the monitor.

use nalgebra::{Point3, UnitQuaternion, Vector3};

/// One kept sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct InputRecord {
    pub centre: Point3<f64>,
    pub rotation: UnitQuaternion<f64>,
    pub force_o: Vector3<f64>,
}

impl InputRecord {
    pub(crate) fn force_t(&self) -> Vector3<f64> {
        self.rotation.inverse_transform_vector(&self.force_o)
    }
}
