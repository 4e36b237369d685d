//! The sphere: domes, seats of balls, ends of ball-nosed tools, and balls that calibrate.

use nalgebra::{Isometry3, Matrix4, Point3, Vector3, Vector4};

use super::surface::{CENTRE, RADIUS, check_size, side};
use super::{Distance, FREEDOMS, Fit, FitError, Freedom, SurfaceModel};
use touchup_geometry::numeric::{NormalEquations, centroid_and_spread, length_and_direction};

/// A whole sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Frame F in O: the origin is the centre; not turned.
    pub pose_of: Isometry3<f64>,
    /// m
    pub radius: f64,
    /// Whether the air is inside (a seat) and not the material (a dome).
    pub concave: bool,
}

impl Sphere {
    /// About a centre, m in O.
    pub fn new(centre: Point3<f64>, radius: f64, concave: bool) -> Self {
        Self {
            pose_of: Isometry3::translation(centre.x, centre.y, centre.z),
            radius,
            concave,
        }
    }
}

impl SurfaceModel for Sphere {
    const NAMES: [Option<&'static str>; FREEDOMS] =
        [CENTRE, CENTRE, CENTRE, None, None, None, RADIUS, None];

    fn pose_of(&self) -> &Isometry3<f64> {
        &self.pose_of
    }

    fn section_radius(&self) -> Option<f64> {
        Some(self.radius)
    }

    #[inline]
    fn distance_at(&self, q: &Vector3<f64>) -> Distance {
        let (rho, away) = length_and_direction(q);
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

    fn described_from(&self, _: &[Vector3<f64>]) -> Self {
        *self
    }

    fn check(&self) -> Result<(), FitError> {
        check_size("radius", self.radius)
    }
}

impl Fit<Sphere> {
    /// Root mean square uncertainty of the centre in space, m.
    pub(crate) fn centre_std(&self) -> Option<f64> {
        let [x, y, z] = [Freedom::X, Freedom::Y, Freedom::Z].map(|freedom| self.std(freedom));
        Some(x?.hypot(y?).hypot(z?))
    }
}

/// The sphere of plain least squares through points, such as the centres of a ball in contact with
/// another.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereFit {
    /// m, in the frame of the points
    pub centre: Point3<f64>,
    /// of balls in contact the sum of both radii, m
    pub radius: f64,
    /// covariance of centre and radius for points with a standard deviation of 1 along their radius
    pub cofactors: Matrix4<f64>,
    /// Σ of the squared distances of the points from the sphere, m²
    pub residual_square: f64,
    /// number of points less the four unknowns
    pub degrees_of_freedom: usize,
}

/// Maximum number of Gauss–Newton steps; each squares the error.
const ROUNDS: usize = 20;
/// Length of a negligible step, m.
const SETTLED: f64 = 1e-13;

/// Minimises Σ (|pᵢ − c| − ρ)² over centre c and radius ρ.
///
/// - `points`: m. `None` for fewer than five, or if they do not determine a sphere.
///
/// # Example
/// ```
/// # use nalgebra::{Point3, Vector3};
/// # use touchup_features::features::fit::fit_sphere;
/// let middle = Point3::new(0.1, 0.2, 0.3);
/// let touches = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
/// let fit = fit_sphere(&touches.map(|out| middle + Vector3::from(out) * 0.014)).unwrap();
/// assert!((fit.centre - middle).norm() < 1e-12 && (fit.radius - 0.014).abs() < 1e-12);
/// ```
pub fn fit_sphere(points: &[Point3<f64>]) -> Option<SphereFit> {
    let degrees_of_freedom = points.len().checked_sub(4).filter(|count| *count > 0)?;
    let mut centre = linear_centre(points)?;
    let mut radius = points.iter().map(|p| (p - centre).norm()).sum::<f64>() / points.len() as f64;
    for _ in 0..ROUNDS {
        let step = equations(points, &centre, radius).solution()?;
        centre += step.xyz();
        radius += step.w;
        if step.norm() < SETTLED {
            break;
        }
    }
    let here = equations(points, &centre, radius);
    let cofactors = here.information.cholesky()?.inverse();
    let is_sphere = centre.iter().all(|x| x.is_finite()) && radius > 0.0;
    is_sphere.then_some(SphereFit {
        centre,
        radius,
        cofactors,
        residual_square: here.square,
        degrees_of_freedom,
    })
}

/// Normal equations of a step of the centre and the radius.
fn equations(points: &[Point3<f64>], centre: &Point3<f64>, radius: f64) -> NormalEquations<4> {
    NormalEquations::of(points.iter().map(|p| {
        let off = p - centre;
        let distance = off.norm();
        let out = off.try_normalize(0.0).unwrap_or_else(Vector3::z);
        (out.push(1.0), distance - radius)
    }))
}

/// Centre from |p|² = 2 p·c + (ρ² − |c|²), which is linear in c and ρ² − |c|²; p from the mean of
/// the points, in units of their extent.
fn linear_centre(points: &[Point3<f64>]) -> Option<Point3<f64>> {
    let (mean, extent) = centroid_and_spread(points.iter());
    let rows = points.iter().map(|p| {
        let off = (p - mean) / extent;
        (
            Vector4::new(2.0 * off.x, 2.0 * off.y, 2.0 * off.z, 1.0),
            off.norm_squared(),
        )
    });
    let solution = NormalEquations::of(rows).solution()?;
    Some(mean + solution.xyz() * extent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::fit::{FitParams, Observation, fit};

    /// Five touches of a sphere, one of them too far out by 20 µm: with a pole and four at the
    /// equator the pole alone determines the height, so an error of the pole is one of the centre;
    /// an error at the equator has the residuals of a hand count.
    #[test]
    fn a_fit_has_the_residuals_of_a_hand_count() {
        let out = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let mut points = out.map(|out| Point3::from(Vector3::from(out) * 0.015));
        points[0].x += 20e-6;
        let fit = fit_sphere(&points).unwrap();
        // the radii of the x pair grow by 10 µm on average, half of it in the common radius:
        // residuals ±5 µm on four touches
        assert!(
            (fit.residual_square - 4.0 * 5e-6f64.powi(2)).abs() < 1e-13,
            "{}",
            fit.residual_square
        );
        assert!((fit.radius - 0.015 - 5e-6).abs() < 1e-8 && (fit.centre.x - 10e-6).abs() < 1e-8);
        assert_eq!(fit.degrees_of_freedom, 1);
        // for x: two touches with ±1
        assert!(
            (fit.cofactors[(0, 0)] - 0.5).abs() < 1e-3,
            "{}",
            fit.cofactors
        );
    }

    #[test]
    fn too_few_touches_and_touches_in_a_plane_are_no_sphere() {
        let ring: Vec<_> = (0..6)
            .map(f64::from)
            .map(|a| Point3::new(a.cos(), a.sin(), 0.0))
            .collect();
        assert_eq!(fit_sphere(&ring), None);
        assert_eq!(fit_sphere(&ring[..4]), None);
        assert_eq!(fit_sphere(&[Point3::origin(); 7]), None);
        assert_eq!(fit_sphere(&[]), None);
    }

    /// Ten turns of a seat of 6 mm with errors of ±5 µm by turns: the centre is as uncertain as the
    /// cofactors of plain least squares say.
    #[test]
    fn a_robust_fit_of_a_seat_has_the_covariance_of_least_squares() {
        let (centre, radius) = (Point3::new(0.01, -0.02, 0.03), 6e-3);
        let point = |i: u32| {
            let (lean, turn) = (0.1 + 0.035 * f64::from(i % 40), 2.4 * f64::from(i));
            let out = Vector3::new(
                lean.sin() * turn.cos(),
                lean.sin() * turn.sin(),
                -lean.cos(),
            );
            let error = if i.is_multiple_of(2) { 5e-6 } else { -5e-6 };
            centre + out * (radius + error)
        };
        let points: Vec<_> = (0..400).map(point).collect();
        let observations: Vec<_> = (0..)
            .zip(&points)
            .map(|(group, &point)| Observation {
                point,
                offset: 0.0,
                sigma: 5e-6,
                group,
            })
            .collect();
        let guess = Sphere::new(centre + Vector3::repeat(1e-4), 5.5e-3, true);
        let found = fit(&guess, &observations, &FitParams::default()).unwrap();
        let plain = fit_sphere(&points).unwrap();
        let expected = (plain.cofactors.fixed_view::<3, 3>(0, 0).trace()).sqrt() * 5e-6;
        let std = found.centre_std().unwrap();
        assert!((std / expected - 1.0).abs() < 0.1, "{std} {expected}");
        assert!((found.surface.center() - centre).norm() < 4.0 * std);
        assert!((found.surface.radius - radius).abs() < 2e-6);
        assert!(found.surface.distance(&centre) > 0.0, "air is inside");
    }
}
