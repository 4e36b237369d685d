//! Points spread evenly over a surface.

use nalgebra::Point3;
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;

use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};
use touchup_geometry::numeric::largest;

/// The generator's stream for sampling.
const STREAM: u64 = 0x5a3b;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledPoint {
    /// m, in the frame of the mesh
    pub point: Point3<f64>,
    /// the face under it
    pub face: FaceId,
    /// the nearest corner of that face, by barycentric coordinates
    pub corner: VertexId,
}

/// Area of all faces, m².
pub fn surface_area(mesh: &TriMesh) -> f64 {
    mesh.faces()
        .map(|(face, _)| mesh.double_area_normal(face).norm() / 2.0)
        .sum()
}

/// Points spread over a surface by area: one at random in each piece of 1/`density` of the faces,
/// laid end to end in order of id. Same mesh, density and seed, same points.
///
/// - `density`: points for each m², more than 0.
pub fn sample_surface(mesh: &TriMesh, density: f64, seed: u64) -> Vec<SampledPoint> {
    let mut rng = Pcg64::new(u128::from(seed), u128::from(STREAM));
    let mut random = move || -> f64 { StandardUniform.sample(&mut rng) };
    let mut samples = Vec::new();
    // position of the next point, in pieces from the start of the first face
    let mut next = random();
    let mut pieces_before = 0.0_f64;
    let mut number = 0.0_f64;
    for (face, corners) in mesh.faces() {
        let pieces = mesh.double_area_normal(face).norm() / 2.0 * density;
        while next < pieces_before + pieces {
            samples.push(on_face(mesh, face, corners, random().sqrt(), random()));
            number += 1.0;
            next = number + random();
        }
        pieces_before += pieces;
    }
    samples
}

/// The point at the share `u` of the segment from the first corner to the point at the share `v` of
/// the opposite side; evenly spread when `u`² and `v` are.
fn on_face(mesh: &TriMesh, face: FaceId, corners: [VertexId; 3], u: f64, v: f64) -> SampledPoint {
    let shares = [1.0 - u, u * (1.0 - v), u * v];
    let [a, b, c] = mesh.triangle(face).map(|p| p.coords);
    let point = Point3::from(a * shares[0] + b * shares[1] + c * shares[2]);
    SampledPoint {
        point,
        face,
        corner: nearest_corner(corners, &shares),
    }
}

/// The corner with the largest barycentric coordinate, the first among equals.
pub(super) fn nearest_corner(corners: [VertexId; 3], shares: &[f64; 3]) -> VertexId {
    corners[largest(shares)]
}
