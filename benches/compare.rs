//! Deviation of a million points and registration of a hundred thousand: `cargo bench --bench compare`.

use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::{Point3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use touchup::compare::deviations;
use touchup::mesh::{FaceTree, TriMesh};

#[path = "../tests/common/wavy.rs"]
mod wavy;

/// Standard deviation of a point on each axis, m.
const NOISE: f64 = 0.05e-3;

fn main() {
    divan::main();
}

/// The vertices of a wavy plate of about `count`, noisy, in an order without rhyme.
fn points(count: usize) -> Vec<Point3<f64>> {
    let mut rng = Pcg64::new(1, 1);
    let mesh = wavy::wavy_plate(2 * count);
    let mut points: Vec<_> = mesh
        .positions()
        .iter()
        .map(|p| {
            let noise: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            p + Vector3::from(noise) * NOISE
        })
        .collect();
    let steps = points.len();
    (0..steps).for_each(|at| points.swap(at, at * 7919 % steps));
    points
}

fn truth(faces: usize) -> (TriMesh, FaceTree) {
    let mesh = wavy::wavy_plate(faces);
    let tree = FaceTree::new(&mesh);
    (mesh, tree)
}

/// Signed distance of a million points from a surface of so many faces.
#[divan::bench(args = [100_000, 1_000_000, 2_000_000], sample_count = 5)]
fn point_to_surface(bencher: Bencher, faces: usize) {
    let (points, (mesh, tree)) = (points(1_000_000), truth(faces));
    let largest = deviations(&points, &mesh, &tree).expect("finite").into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(largest > NOISE && largest < 10.0 * NOISE, "{largest}");
    bencher.counter(ItemsCount::new(points.len())).bench(|| deviations(&points, &mesh, &tree));
}
