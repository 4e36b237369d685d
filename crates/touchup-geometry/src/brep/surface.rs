//! Analytic surfaces.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};

use super::placement::AxisPlacement;
use crate::numeric::length_and_direction;

/// Shape of a surface about its placement; lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfaceShape {
    /// through the origin, square to the axis
    Plane,
    /// about the axis
    Cylinder {
        /// positive
        radius: f64,
    },
    /// about the axis, wider along it; the nappe ends at the apex
    Cone {
        /// at the origin; zero for the apex there
        radius: f64,
        /// between axis and wall, rad, above 0 and below π/2
        half_angle: f64,
    },
    /// about the origin, with its poles on the axis
    Sphere {
        /// positive
        radius: f64,
    },
}

/// Surface in O. Its outward side is that of the axis of a plane, and away from the axis of another,
/// or from the centre of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalyticSurface {
    /// its place
    pub placement: AxisPlacement,
    /// its shape there
    pub shape: SurfaceShape,
}

impl AnalyticSurface {
    /// A shape about an axis of any length; the origin is that of the placement.
    pub fn along(origin: Point3<f64>, axis: Vector3<f64>, shape: SurfaceShape) -> Self {
        Self {
            placement: AxisPlacement::along(origin, axis),
            shape,
        }
    }

    /// Distance of a point, m: positive outside.
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        let at = self.placement.local(p);
        let across = at.x.hypot(at.y);
        match self.shape {
            SurfaceShape::Plane => at.z,
            SurfaceShape::Cylinder { radius } => across - radius,
            SurfaceShape::Cone { radius, half_angle } => {
                (across - radius) * half_angle.cos() - at.z * half_angle.sin()
            }
            SurfaceShape::Sphere { radius } => at.norm() - radius,
        }
    }

    /// Outward unit normal at the foot of a point; zero on an axis, or in the centre of a sphere.
    pub fn normal(&self, p: &Point3<f64>) -> Vector3<f64> {
        let axis = self.placement.axis;
        let off = p - self.placement.origin;
        let (across, radial) = length_and_direction(&(off - axis * off.dot(&axis)));
        match self.shape {
            SurfaceShape::Plane => axis,
            SurfaceShape::Cylinder { .. } => radial,
            SurfaceShape::Cone { half_angle, .. } if across > 0.0 => {
                radial * half_angle.cos() - axis * half_angle.sin()
            }
            SurfaceShape::Cone { .. } => Vector3::zeros(),
            SurfaceShape::Sphere { .. } => length_and_direction(&off).1,
        }
    }

    /// Size against which lengths are small: its radius; zero for a plane.
    pub(super) fn size(&self) -> f64 {
        match self.shape {
            SurfaceShape::Plane => 0.0,
            SurfaceShape::Cylinder { radius }
            | SurfaceShape::Cone { radius, .. }
            | SurfaceShape::Sphere { radius } => radius,
        }
    }

    /// Whether the placement is one and each size is in its range.
    pub fn is_sound(&self) -> bool {
        let is_length = |x: f64| x > 0.0 && x.is_finite();
        let is_shape = match self.shape {
            SurfaceShape::Plane => true,
            SurfaceShape::Cylinder { radius } | SurfaceShape::Sphere { radius } => {
                is_length(radius)
            }
            SurfaceShape::Cone { radius, half_angle } => {
                (radius == 0.0 || is_length(radius)) && half_angle > 0.0 && half_angle < FRAC_PI_2
            }
        };
        is_shape && self.placement.is_sound()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn each() -> [AnalyticSurface; 4] {
        let shapes = [
            SurfaceShape::Plane,
            SurfaceShape::Cylinder { radius: 0.01 },
            SurfaceShape::Cone {
                radius: 0.01,
                half_angle: 0.5,
            },
            SurfaceShape::Sphere { radius: 0.01 },
        ];
        let (origin, axis) = (Point3::new(0.1, -0.2, 0.05), Vector3::new(1.0, 2.0, -3.0));
        shapes.map(|shape| AnalyticSurface::along(origin, axis, shape))
    }

    /// The gradient of the distance, by central differences, and a step back along it.
    #[test]
    fn the_normal_is_the_gradient_of_the_distance_and_leads_to_the_surface() {
        let p = Point3::new(0.113, -0.207, 0.061);
        for surface in each() {
            let slope = |by: Vector3<f64>| {
                let [ahead, behind] = [p + by, p - by].map(|p| surface.signed_distance(&p));
                (ahead - behind) / 2e-6
            };
            let gradient = Vector3::from_fn(|i, _| slope(Vector3::ith(i, 1e-6)));
            let normal = surface.normal(&p);
            assert!((gradient - normal).norm() < 1e-6, "{surface:?}");
            let foot = p - normal * surface.signed_distance(&p);
            assert!(surface.signed_distance(&foot).abs() < 1e-15, "{surface:?}");
        }
    }

    #[test]
    fn sizes_out_of_range_are_no_surface() {
        assert!(each().iter().all(AnalyticSurface::is_sound));
        let bad = [
            SurfaceShape::Cylinder { radius: 0.0 },
            SurfaceShape::Cylinder { radius: f64::NAN },
            SurfaceShape::Sphere { radius: -0.01 },
            SurfaceShape::Cone {
                radius: 0.01,
                half_angle: FRAC_PI_2,
            },
        ];
        for shape in bad {
            let surface = AnalyticSurface { shape, ..each()[0] };
            assert!(!surface.is_sound(), "{shape:?}");
        }
        let nowhere = AnalyticSurface::along(Point3::origin(), Vector3::zeros(), each()[0].shape);
        assert!(!nowhere.is_sound());
    }
}
