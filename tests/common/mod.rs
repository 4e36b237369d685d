//! Shared by the tests of meshes and of their refinement.

use nalgebra::Point3;
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;
use touchup::mesh::TriMesh;

/// Evenly distributed between `lo` and `hi`.
pub fn within(rng: &mut Pcg64, lo: f64, hi: f64) -> f64 {
    let share: f64 = StandardUniform.sample(rng);
    lo + (hi - lo) * share
}

/// The height field z = `height(x, y)` over a square about the origin: `cells` × `cells` squares of
/// side `edge` (m), two triangles each, normals up.
pub fn grid(cells: u32, edge: f64, mut height: impl FnMut(f64, f64) -> f64) -> TriMesh {
    let row = cells + 1;
    let at = |i: u32| (f64::from(i) - f64::from(cells) / 2.0) * edge;
    let positions = (0..row * row)
        .map(|i| {
            let (x, y) = (at(i % row), at(i / row));
            Point3::new(x, y, height(x, y))
        })
        .collect();
    let faces = (0..cells * cells).flat_map(|i| {
        let a = i / cells * row + i % cells;
        [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]
    });
    TriMesh::new(positions, faces.collect()).unwrap()
}
