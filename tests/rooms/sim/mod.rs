//! The simulation from outside: known surfaces, scanner and stylus.

mod arm;
mod scanner;
mod stylus;
mod surface;
mod world;

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use touchup::mesh::TriMesh;
use touchup::sim::{MeshSurface, Peaks, Plate, SimError, Surface, TruthShape};

/// Corner points of all faces.
fn triangles(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    mesh.faces().map(|(face, _)| mesh.triangle(face)).collect()
}

/// Distance from a point to a triangle, from the plane when the foot is inside and else from the
/// three sides.
fn distance_to_triangle(p: &Point3<f64>, t: &[Point3<f64>; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(&(t[2] - t[0])).normalize();
    let sides = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    if sides
        .iter()
        .all(|(a, b)| normal.dot(&(b - a).cross(&(p - a))) >= 0.0)
    {
        return normal.dot(&(p - t[0])).abs();
    }
    let to_side = |(a, b): &(Point3<f64>, Point3<f64>)| {
        let s = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (p - (a + (b - a) * s)).norm()
    };
    sides.iter().map(to_side).fold(f64::MAX, f64::min)
}

/// Winding number of the mesh around a point: 1 inside, 0 outside [solid angles].
fn winding_number(p: &Point3<f64>, mesh: &[[Point3<f64>; 3]]) -> f64 {
    let solid_angle = |t: &[Point3<f64>; 3]| {
        let [a, b, c] = t.map(|x| x - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let down = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(down)
    };
    mesh.iter().map(solid_angle).sum::<f64>() / (4.0 * PI)
}

fn around(surface: &dyn Surface, margin: f64) -> impl Strategy<Value = Point3<f64>> {
    let b = surface.bounds().grown(margin);
    (b.min.x..b.max.x, b.min.y..b.max.y, b.min.z..b.max.z)
        .prop_map(|(x, y, z)| Point3::new(x, y, z))
}
