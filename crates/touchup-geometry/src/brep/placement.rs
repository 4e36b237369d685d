//! Axes at a point.

use nalgebra::{Point3, Vector3};

use crate::numeric::{length_and_direction, tangent_basis};

/// Distance below which two places are one, relative to the size of a surface: far above the
/// rounding of a computed placement, far below a fit's uncertainty.
pub(super) const COINCIDENT: f64 = 1e-9;
/// Angle below which two directions are parallel, rad: 1 nm over 1 m.
pub(super) const PARALLEL: f64 = 1e-9;

/// Right-handed orthonormal axes at a point, as AXIS2_PLACEMENT_3D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPlacement {
    /// m
    pub origin: Point3<f64>,
    /// z: axis of revolution or normal; unit vector
    pub axis: Vector3<f64>,
    /// x: unit vector square to the axis
    pub reference: Vector3<f64>,
}

impl AxisPlacement {
    /// With any reference; `axis` of any length. [`Brep::new`](super::Brep::new) refuses a zero
    /// axis.
    pub fn along(origin: Point3<f64>, axis: Vector3<f64>) -> Self {
        let (_, axis) = length_and_direction(&axis);
        let [reference, _] = tangent_basis(&axis);
        Self {
            origin,
            axis,
            reference,
        }
    }

    /// y: unit vector square to axis and reference.
    pub fn second(&self) -> Vector3<f64> {
        self.axis.cross(&self.reference)
    }

    /// Coordinates of a point along reference, second axis and axis.
    pub fn local(&self, p: &Point3<f64>) -> Vector3<f64> {
        let off = p - self.origin;
        Vector3::new(
            off.dot(&self.reference),
            off.dot(&self.second()),
            off.dot(&self.axis),
        )
    }

    /// The point of these coordinates.
    pub fn place(&self, x: f64, y: f64, z: f64) -> Point3<f64> {
        self.origin + self.reference * x + self.second() * y + self.axis * z
    }

    /// Whether it is finite and orthonormal.
    pub(super) fn is_sound(&self) -> bool {
        // some roundings of a unit vector
        const ORTHONORMAL: f64 = 1e-12;
        let errors = [
            self.axis.norm() - 1.0,
            self.reference.norm() - 1.0,
            self.axis.dot(&self.reference),
        ];
        is_finite(&self.origin) && errors.iter().all(|error| error.abs() <= ORTHONORMAL)
    }
}

/// Whether each coordinate is finite.
pub(super) fn is_finite(p: &Point3<f64>) -> bool {
    p.iter().all(|x| x.is_finite())
}
