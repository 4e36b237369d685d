//! The cone: countersinks, chamfers of holes, tapers.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::surface::{AXIS, CENTRE, RADIUS, check_size, pose_along, radial, side};
use super::{Distance, FREEDOMS, FitError, SurfaceModel};
use touchup_geometry::numeric::mean;

/// A cone, by one of its circles and the angle between its lines and its axis.
///
/// Its freedoms are a shift along its normal and the angle, turned about the circle: both stay well
/// conditioned from a cylinder (angle 0) to a flat cone (angle near 90°), unlike apex and radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Frame F in O: the origin is the centre of the circle, z the axis.
    pub pose_of: Isometry3<f64>,
    /// Radius of the circle, m.
    pub radius: f64,
    /// Angle between the lines and the axis, rad, within ± π/2; positive if it widens along z.
    pub half_angle: f64,
    /// Whether the air is inside (a countersink) and not the material.
    pub concave: bool,
}

impl Cone {
    /// From the centre of a circle, the axis (any length but 0), radius of the circle, half angle.
    pub fn new(
        center: Point3<f64>,
        axis: &Vector3<f64>,
        radius: f64,
        half_angle: f64,
        concave: bool,
    ) -> Self {
        Self {
            pose_of: pose_along(center, axis),
            radius,
            half_angle,
            concave,
        }
    }

    /// Apex, m, in O; `None` for a cylinder.
    pub fn apex(&self) -> Option<Point3<f64>> {
        let height = -self.radius / self.half_angle.tan();
        height
            .is_finite()
            .then(|| self.pose_of * Point3::new(0.0, 0.0, height))
    }
}

impl SurfaceModel for Cone {
    const NAMES: [Option<&'static str>; FREEDOMS] = [
        CENTRE,
        CENTRE,
        None,
        AXIS,
        AXIS,
        None,
        RADIUS,
        Some("half angle"),
    ];

    fn pose_of(&self) -> &Isometry3<f64> {
        &self.pose_of
    }

    fn section_radius(&self) -> Option<f64> {
        Some(self.radius)
    }

    #[inline]
    fn distance_at(&self, q: &Vector3<f64>) -> Distance {
        let (rho, away) = radial(q);
        let (sin, cos) = self.half_angle.sin_cos();
        let s = side(self.concave);
        let (out, along) = (rho - self.radius, q.z);
        Distance {
            value: s * (out * cos - along * sin),
            normal: s * (away * cos - Vector3::z() * sin),
            by_size: [-s, -s * (out * sin + along * cos)],
        }
    }

    fn with(&self, pose_of: Isometry3<f64>, [shift, turn]: [f64; 2]) -> Self {
        let (sin, cos) = self.half_angle.sin_cos();
        Self {
            pose_of: pose_of * Translation3::new(0.0, 0.0, -shift * sin),
            radius: self.radius + shift * cos,
            half_angle: self.half_angle + turn,
            concave: self.concave,
        }
    }

    fn described_from(&self, points: &[Vector3<f64>]) -> Self {
        let rho = points.iter().map(|q| radial(q).0).sum::<f64>() / points.len() as f64;
        let q = mean(points.iter().copied());
        let (sin, cos) = self.half_angle.sin_cos();
        let along = (rho - self.radius) * sin + q.z * cos;
        let pose_of = self.pose_of * Translation3::new(0.0, 0.0, along * cos);
        Self {
            pose_of,
            radius: self.radius + along * sin,
            ..*self
        }
    }

    fn check(&self) -> Result<(), FitError> {
        check_size("radius", self.radius)?;
        let value = self.half_angle;
        if value.abs() < FRAC_PI_2 {
            Ok(())
        } else {
            Err(FitError::BadSize {
                what: "half angle",
                value,
            })
        }
    }
}
