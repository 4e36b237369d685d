//! A wavy plate as a structured grid: smooth, open, any number of faces.

use nalgebra::Point3;
use touchup::mesh::TriMesh;

/// Side of the plate, m.
pub const SIDE: f64 = 0.3;

/// Height over (x, y), m: waves of 40 mm and 2 mm amplitude.
pub fn height(x: f64, y: f64) -> f64 {
    let wave = std::f64::consts::TAU / 0.04;
    2e-3 * (wave * x).sin() * (wave * y).cos()
}

/// About `faces` triangles over the square from 0 to [`SIDE`].
pub fn wavy_plate(faces: usize) -> TriMesh {
    let n = ((faces as f64 / 2.0).sqrt().round() as u32).max(1);
    let at = |i: u32| SIDE * f64::from(i) / f64::from(n);
    let positions =
        (0..=n).flat_map(|j| (0..=n).map(move |i| Point3::new(at(i), at(j), height(at(i), at(j))))).collect();
    let id = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = cells
        .flat_map(|(i, j)| [[id(i, j), id(i + 1, j), id(i + 1, j + 1)], [id(i, j), id(i + 1, j + 1), id(i, j + 1)]]);
    TriMesh::new(positions, triangles.collect()).expect("the grid is sound")
}
