//! Deviation of a million points and registration of a hundred thousand: `cargo bench --bench
//! compare`.

use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::{Isometry3, Point3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use touchup::align::{IcpParams, icp};
use touchup::compare::deviations;
use touchup::mesh::{FaceTree, SerialWorkers, TriMesh, Workers};
use touchup::sim::wavy;
use touchup::threads::Threads;

/// Standard deviation of a point on each axis, m.
const NOISE: f64 = 0.05e-3;

fn main() {
    divan::main();
}

/// The vertices of a wavy plate of about `count`, noisy, in a random order.
fn points(count: usize) -> Vec<Point3<f64>> {
    let mut rng = Pcg64::new(1, 1);
    let mesh = wavy::wavy_plate(2 * count).expect("it can be counted");
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
    let mesh = wavy::wavy_plate(faces).expect("it can be counted");
    let tree = FaceTree::new(&mesh);
    (mesh, tree)
}

/// Signed distance of a million points from a surface of `faces` faces, as `touchup compare`
/// measures it.
#[divan::bench(args = [100_000, 1_000_000, 2_000_000], sample_count = 5)]
fn point_to_surface(bencher: Bencher, faces: usize) {
    distances(bencher, faces, &Threads);
}

/// The same by one thread.
#[divan::bench(args = [100_000, 1_000_000, 2_000_000], sample_count = 5)]
fn point_to_surface_alone(bencher: Bencher, faces: usize) {
    distances(bencher, faces, &SerialWorkers);
}

fn distances(bencher: Bencher, faces: usize, workers: &dyn Workers) {
    let (points, (mesh, tree)) = (points(1_000_000), truth(faces));
    let found = deviations(&points, &mesh, &tree, workers).expect("finite");
    let largest = found.into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(largest > NOISE && largest < 10.0 * NOISE, "{largest}");
    bencher
        .counter(ItemsCount::new(points.len()))
        .bench(|| deviations(&points, &mesh, &tree, workers));
}

/// A hundred thousand points, 1 mm and 0.6° off, onto a surface of `faces` faces.
#[divan::bench(args = [200_000, 2_000_000], sample_count = 10)]
fn points_to_mesh(bencher: Bencher, faces: usize) {
    register(bencher, faces, &Threads);
}

/// The same by one thread.
#[divan::bench(args = [200_000, 2_000_000], sample_count = 10)]
fn points_to_mesh_alone(bencher: Bencher, faces: usize) {
    register(bencher, faces, &SerialWorkers);
}

fn register(bencher: Bencher, faces: usize, workers: &dyn Workers) {
    let moved = Isometry3::new(
        Vector3::new(0.6e-3, -0.5e-3, 0.6e-3),
        Vector3::new(0.004, -0.005, 0.008),
    );
    let (mut points, (mesh, tree)) = (points(100_000), truth(faces));
    points.iter_mut().for_each(|p| *p = moved.inverse() * *p);
    let register = || {
        icp(
            &points,
            &mesh,
            &tree,
            &Isometry3::identity(),
            &IcpParams::default(),
            workers,
        )
    };
    let found = register().expect("roughly in place");
    // the scatter over the root of the count, times five
    assert!(
        (found.source_to_target.translation.vector - moved.translation.vector).norm() < 5e-6,
        "{found:?}"
    );
    bencher
        .counter(ItemsCount::new(points.len()))
        .bench(register);
}
