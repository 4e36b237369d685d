//! Time of curvature and its clusters on a scan of 1M vertices, in order and in disorder.

use divan::{Bencher, black_box};
use nalgebra::Point3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use touchup::features::curvature;
use touchup::features::k_means;
use touchup::features::{ClusterParams, clusters};
use touchup::mesh::{FaceId, TriMesh};

fn main() {
    divan::main();
}

const CELLS: [u32; 2] = [316, 1000];

/// Waves of 2 mm over a square, edges of 0.5 mm.
fn waves(cells: u32) -> TriMesh {
    let row = cells + 1;
    let at = |i: u32| {
        let (x, y) = (f64::from(i % row) * 0.5e-3, f64::from(i / row) * 0.5e-3);
        Point3::new(x, y, 2e-3 * (x * 100.0).sin() * (y * 130.0).cos())
    };
    let faces = (0..cells * cells).flat_map(|i| {
        let a = i / cells * row + i % cells;
        [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]
    });
    TriMesh::new((0..row * row).map(at).collect(), faces.collect()).expect("a grid is sound")
}

/// The same mesh with its vertices and faces in no order: every look-up far from the one before.
fn shuffled(mesh: &TriMesh) -> TriMesh {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
    let mut place: Vec<u32> = (0..mesh.vertex_slots() as u32).collect();
    place.shuffle(&mut rng);
    let mut positions = vec![Point3::origin(); place.len()];
    place
        .iter()
        .zip(mesh.positions())
        .for_each(|(to, p)| positions[*to as usize] = *p);
    let mut faces: Vec<_> = (0..mesh.face_slots() as u32)
        .map(|f| mesh.corners(FaceId(f)).map(|v| place[v.0 as usize]))
        .collect();
    faces.shuffle(&mut rng);
    TriMesh::new(positions, faces).expect("the same mesh in another order")
}

#[divan::bench(args = CELLS, sample_count = 15)]
fn in_order(bencher: Bencher, cells: u32) {
    let mesh = waves(cells);
    bencher.bench_local(|| curvature(black_box(&mesh)));
}

/// The method of the paper on every vertex of the mesh, as the peers run it.
#[divan::bench(args = CELLS, sample_count = 5)]
fn five_means(bencher: Bencher, cells: u32) {
    let mesh = waves(cells);
    bencher.bench_local(|| k_means(black_box(mesh.positions()), 5, 0));
}

#[divan::bench(args = CELLS, sample_count = 5)]
fn creases(bencher: Bencher, cells: u32) {
    let mesh = waves(cells);
    let found = curvature(&mesh);
    bencher.bench_local(|| clusters(black_box(&mesh), &found, &ClusterParams::default()));
}

#[divan::bench(args = CELLS, sample_count = 5)]
fn shuffled_order(bencher: Bencher, cells: u32) {
    let mesh = shuffled(&waves(cells));
    bencher.bench_local(|| curvature(black_box(&mesh)));
}
