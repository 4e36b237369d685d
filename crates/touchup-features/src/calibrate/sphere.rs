//! A sphere of known diameter.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{MeshError, TriMesh};

/// A sphere of known diameter at a known place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSphere {
    /// m, in O
    pub centre: Point3<f64>,
    /// m
    pub radius: f64,
}

/// Segments of the equator of a mesh: its faces are within 0.3 % of the radius.
const SEGMENTS: u32 = 48;

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
