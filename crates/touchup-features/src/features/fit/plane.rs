//! The plane.

use nalgebra::{Isometry3, Point3, Vector3};

use super::surface::pose_along;
use super::{Distance, FREEDOMS, FitError, SurfaceModel};
use touchup_geometry::numeric::mean;

const NORMAL: Option<&str> = Some("direction of the normal");

/// A plane whose air is on the side of z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Frame F in O: the origin lies on the plane, z is its normal out of the material.
    pub pose_of: Isometry3<f64>,
}

impl Plane {
    /// The plane through a point with a normal of any length but 0.
    pub fn new(point: Point3<f64>, normal: &Vector3<f64>) -> Self {
        Self {
            pose_of: pose_along(point, normal),
        }
    }

    /// Normal out of the material, in O.
    pub fn normal(&self) -> Vector3<f64> {
        self.axis()
    }

    /// A point on the plane, m, in O.
    pub fn point(&self) -> Point3<f64> {
        self.pose_of.translation.vector.into()
    }

    /// Distance from `from` along `direction` to the plane, m; `None`: parallel.
    pub(crate) fn along(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let normal = self.normal();
        let t = (self.point() - from).dot(&normal) / direction.dot(&normal);
        t.is_finite().then_some(t)
    }
}

impl SurfaceModel for Plane {
    const NAMES: [Option<&'static str>; FREEDOMS] = [
        None,
        None,
        Some("position along the normal"),
        NORMAL,
        NORMAL,
        None,
        None,
        None,
    ];

    fn pose_of(&self) -> &Isometry3<f64> {
        &self.pose_of
    }

    #[inline]
    fn distance_at(&self, q: &Vector3<f64>) -> Distance {
        Distance {
            value: q.z,
            normal: Vector3::z(),
            by_size: [0.0; 2],
        }
    }

    fn with(&self, pose_of: Isometry3<f64>, _: [f64; 2]) -> Self {
        Self { pose_of }
    }

    fn described_from(&self, points: &[Vector3<f64>]) -> Self {
        let q = mean(points.iter().copied());
        Self {
            pose_of: self.pose_of * nalgebra::Translation3::new(q.x, q.y, 0.0),
        }
    }

    fn check(&self) -> Result<(), FitError> {
        Ok(())
    }
}
