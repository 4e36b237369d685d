//! A sphere of known diameter, and the sphere through the centres of a ball in contact with it.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix4, Point3, Vector3, Vector4};

use touchup_geometry::mesh::{MeshError, TriMesh};
use touchup_geometry::numeric::NormalEquations;

/// A sphere of known diameter at a known place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSphere {
    /// m, in O
    pub centre: Point3<f64>,
    /// m
    pub radius: f64,
}

/// The sphere of least squares through the centres of a ball in contact with a sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereFit {
    /// m, in the frame of the touches
    pub centre: Point3<f64>,
    /// radius of the touched sphere plus the radius of the ball, m
    pub radius: f64,
    /// covariance of centre and radius for touches with a standard deviation of 1 along their
    /// radius
    pub cofactors: Matrix4<f64>,
    /// Σ of the squared distances of the centres of the ball from the sphere, m²
    pub residual_square: f64,
    /// number of touches less the four unknowns
    pub degrees_of_freedom: usize,
}

/// Maximum number of Gauss–Newton steps; each squares the error.
const ROUNDS: usize = 20;
/// Length of a negligible step, m.
const SETTLED: f64 = 1e-13;
/// Segments of the equator of a mesh: its faces are within 0.3 % of the radius.
const SEGMENTS: u32 = 48;

/// Minimises Σ (|pᵢ − c| − ρ)² over centre c and radius ρ.
///
/// - `points`: centres of the ball, m. `None` for fewer than five, or if they do not determine a
///   sphere.
///
/// # Example
/// ```
/// # use nalgebra::{Point3, Vector3};
/// # use touchup_features::calibrate::fit_sphere;
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
    let mean =
        Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64);
    let extent = points.iter().map(|p| (p - mean).norm()).fold(0.0, f64::max);
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

impl ReferenceSphere {
    /// Its surface as triangles with corners on the sphere, as an obstacle.
    ///
    /// # Errors
    /// [`MeshError`] if centre or radius is no number.
    fn mesh(&self) -> Result<TriMesh, MeshError> {
        let rings = SEGMENTS / 2;
        let on_ring = |ring: u32| {
            (0..SEGMENTS).map(move |at| {
                let (polar, azimuth) = (
                    PI * f64::from(ring) / f64::from(rings),
                    TAU * f64::from(at) / f64::from(SEGMENTS),
                );
                Vector3::new(
                    polar.sin() * azimuth.cos(),
                    polar.sin() * azimuth.sin(),
                    polar.cos(),
                )
            })
        };
        let between = (1..rings).flat_map(on_ring);
        let corners = [Vector3::z()]
            .into_iter()
            .chain(between)
            .chain([-Vector3::z()]);
        let positions = corners.map(|out| self.centre + out * self.radius).collect();
        let corner = |ring: u32, at: u32| 1 + (ring - 1) * SEGMENTS + at % SEGMENTS;
        let last = 1 + (rings - 1) * SEGMENTS;
        let mut faces = Vec::new();
        for at in 0..SEGMENTS {
            faces.push([0, corner(1, at), corner(1, at + 1)]);
            faces.push([last, corner(rings - 1, at + 1), corner(rings - 1, at)]);
            for ring in 1..rings - 1 {
                let [a, b, c, d] = [
                    corner(ring, at),
                    corner(ring + 1, at),
                    corner(ring + 1, at + 1),
                    corner(ring, at + 1),
                ];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        TriMesh::new(positions, faces)
    }
}

/// A mesh with the surfaces of spheres beside it.
///
/// # Errors
/// [`MeshError`] if the centre or radius of a sphere is no number, or the mesh is too large.
pub fn beside_spheres(part: &TriMesh, spheres: &[ReferenceSphere]) -> Result<TriMesh, MeshError> {
    let mut positions = part.positions().to_vec();
    let mut faces: Vec<_> = part
        .faces()
        .map(|(_, corners)| corners.map(|corner| corner.0))
        .collect();
    for sphere in spheres {
        let (mesh, first) = (sphere.mesh()?, positions.len() as u32);
        positions.extend(mesh.positions());
        faces.extend(
            mesh.faces()
                .map(|(_, corners)| corners.map(|corner| first + corner.0)),
        );
    }
    TriMesh::new(positions, faces)
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn the_mesh_of_a_sphere_is_closed_and_looks_outward() {
        let sphere = ReferenceSphere {
            centre: Point3::new(0.03, 0.0, -0.01),
            radius: 12.5e-3,
        };
        let mesh = sphere.mesh().unwrap();
        let volume: f64 = mesh
            .faces()
            .map(|(face, _)| {
                let [a, b, c] = mesh.triangle(face).map(|p| p - sphere.centre);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        let whole = 4.0 / 3.0 * PI * sphere.radius.powi(3);
        assert!(
            volume < whole && volume > 0.99 * whole,
            "{}",
            volume / whole
        );
    }
}
