//! The cylinder: holes, bores, bosses, fillets.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::surface::{AXIS, CENTRE, RADIUS, check_size, pose_along, radial, side};
use super::{Distance, FREEDOMS, Fit, FitError, SurfaceModel};
use touchup_geometry::numeric::mean;

/// Bound on the squared sine between a direction and the axis for parallelism: rounding level.
const ALONG: f64 = 1e-24;

/// A cylinder without ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Frame F in O: the origin lies on the axis, z along it.
    pub pose_of: Isometry3<f64>,
    /// m
    pub radius: f64,
    /// Whether the air is inside (a hole) and not the material (a boss).
    pub concave: bool,
}

impl Cylinder {
    /// From a point on the axis and the axis, of any length but 0.
    pub fn new(point: Point3<f64>, axis: &Vector3<f64>, radius: f64, concave: bool) -> Self {
        Self {
            pose_of: pose_along(point, axis),
            radius,
            concave,
        }
    }
}

impl SurfaceModel for Cylinder {
    const NAMES: [Option<&'static str>; FREEDOMS] =
        [CENTRE, CENTRE, None, AXIS, AXIS, None, RADIUS, None];

    fn pose_of(&self) -> &Isometry3<f64> {
        &self.pose_of
    }

    fn section_radius(&self) -> Option<f64> {
        Some(self.radius)
    }

    #[inline]
    fn distance_at(&self, q: &Vector3<f64>) -> Distance {
        let (rho, away) = radial(q);
        let s = side(self.concave);
        Distance {
            value: s * (rho - self.radius),
            normal: s * away,
            by_size: [-s, 0.0],
        }
    }

    fn with(&self, pose_of: Isometry3<f64>, by: [f64; 2]) -> Self {
        Self {
            pose_of,
            radius: self.radius + by[0],
            concave: self.concave,
        }
    }

    fn described_from(&self, points: &[Vector3<f64>]) -> Self {
        let q = mean(points.iter().copied());
        Self {
            pose_of: self.pose_of * Translation3::new(0.0, 0.0, q.z),
            ..*self
        }
    }

    fn check(&self) -> Result<(), FitError> {
        check_size("radius", self.radius)
    }
}

impl Cylinder {
    /// Nearest point on the axis to a point in O, m.
    pub(crate) fn nearest_on_axis(&self, point: &Point3<f64>) -> Point3<f64> {
        self.center() + self.axis() * (point - self.center()).dot(&self.axis())
    }
}

impl Cylinder {
    /// Distance from `from` (in O) along the unit vector `direction` to the exit from the cylinder,
    /// m; `None`: no hit, or a direction along the axis.
    pub(crate) fn exit(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let axis = self.axis();
        let across = |v: Vector3<f64>| v - axis * v.dot(&axis);
        let (p, d) = (across(from - self.center()), across(*direction));
        // |p + t d|² = R²
        let (a, b, c) = (
            d.norm_squared(),
            p.dot(&d),
            p.norm_squared() - self.radius * self.radius,
        );
        let square = b * b - a * c;
        (a > ALONG && square >= 0.0).then(|| (square.sqrt() - b) / a)
    }
}

impl Fit<Cylinder> {
    /// Root mean square lateral uncertainty of a place on the axis, m.
    pub(crate) fn lateral_std(&self, at: &Point3<f64>) -> Option<f64> {
        let height = self.surface.pose_of.inverse_transform_point(at).z;
        self.center_covariance(height)
            .map(|covariance| covariance.trace().max(0.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_leaves_a_cylinder_on_its_far_side() {
        // about z, 5 across: a line along (3, 4, 0)/5 from (−1, 0, 2) leaves where (−1 + 0.6 t)² +
        // (0.8 t)² = 25
        let cylinder = Cylinder::new(Point3::new(0.0, 0.0, 7.0), &Vector3::z(), 5.0, false);
        let from = Point3::new(-1.0, 0.0, 2.0);
        let t = cylinder.exit(&from, &Vector3::new(0.6, 0.8, 0.0)).unwrap();
        assert!((t - (0.6 + f64::sqrt(0.36 + 24.0))).abs() < 1e-12, "{t}");
        assert_eq!(cylinder.exit(&from, &Vector3::z()), None, "along the axis");
        assert_eq!(
            cylinder.exit(&Point3::new(6.0, 0.0, 0.0), &Vector3::y()),
            None,
            "beside it"
        );
    }
}
