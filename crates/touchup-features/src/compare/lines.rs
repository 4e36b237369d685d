//! Lines and places as small solids among the faces of a mesh: pictures show them in place, and
//! hide them behind the part.

use nalgebra::{Point3, Vector3};

use super::colour::Rgb;
use touchup_geometry::mesh::{MeshError, TriMesh};
use touchup_geometry::numeric::tangent_basis;

/// A mesh with added solids, and a colour for each vertex.
#[derive(Clone, Debug, Default)]
pub struct DrawnMesh {
    positions: Vec<Point3<f64>>,
    faces: Vec<[u32; 3]>,
    paint: Vec<Rgb>,
}

/// Sides of a line.
const SIDES: usize = 5;

impl DrawnMesh {
    /// A mesh in one colour.
    pub fn of(mesh: &TriMesh, colour: Rgb) -> Self {
        let positions = mesh.positions().to_vec();
        let paint = vec![colour; positions.len()];
        let faces = mesh
            .faces()
            .map(|(_, corners)| corners.map(|corner| corner.0))
            .collect();
        Self {
            positions,
            faces,
            paint,
        }
    }

    fn add(&mut self, points: &[Point3<f64>], faces: &[[u32; 3]], colour: Rgb) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(points);
        self.paint.extend(points.iter().map(|_| colour));
        self.faces
            .extend(faces.iter().map(|face| face.map(|corner| first + corner)));
    }

    /// A line of a radius (m) from one place to another; nothing between equal places.
    pub fn line(&mut self, from: &Point3<f64>, to: &Point3<f64>, radius: f64, colour: Rgb) {
        let Some(along) = (to - from).try_normalize(0.0) else {
            return;
        };
        let [x, y] = tangent_basis(&along);
        let around = |end: &Point3<f64>, at: usize| {
            let angle = at as f64 / SIDES as f64 * std::f64::consts::TAU;
            end + (x * angle.cos() + y * angle.sin()) * radius
        };
        let points: Vec<_> = [from, to]
            .iter()
            .flat_map(|end| (0..SIDES).map(|at| around(end, at)))
            .collect();
        let sides = SIDES as u32;
        let faces: Vec<[u32; 3]> = (0..sides)
            .flat_map(|at| {
                let next = (at + 1) % sides;
                [[at, next, sides + at], [next, sides + next, sides + at]]
            })
            .collect();
        self.add(&points, &faces, colour);
    }

    /// A place, as an octahedron of a radius (m).
    pub fn place(&mut self, at: &Point3<f64>, radius: f64, colour: Rgb) {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let points: Vec<_> = axes
            .iter()
            .flat_map(|axis| [at + axis * radius, at - axis * radius])
            .collect();
        let faces = [
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        self.add(&points, &faces, colour);
    }

    /// The mesh and colours for drawing.
    ///
    /// # Errors
    /// [`MeshError`] for non-finite places.
    pub fn finish(self) -> Result<(TriMesh, Vec<Rgb>), MeshError> {
        Ok((TriMesh::new(self.positions, self.faces)?, self.paint))
    }
}
