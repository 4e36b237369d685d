//! Cost of one sample: `Refiner::push` on meshes of 10k to 5M faces, and the hand-written minimal
//! loop beside it.
//!
//! A ball slides over a wavy plate at 50 mm/s and 1 kHz with contacts a little below the scan, so
//! that every timed push is in contact and moves vertices. Afterwards 1,000 queries equal brute
//! force. Figures are per push, from an own sorted list: a mean would hide the tails.
//!
//! `cargo bench --bench push [-- FACES…]`

use std::hint::black_box;
use std::time::Instant;

use nalgebra::{Point3, Vector3};
use touchup::haptic::{RefineParams, Refiner, RoiSize};
use touchup::mesh::{FaceTree, TriMesh, triangle};
use touchup::sim::wavy::{RADIUS, SIDE, STIFFNESS, slide, wavy_plate};
use touchup::stylus::TipParams;
use touchup_report::cost::MinimalLoop;

/// Width of the raster, m.
const WIDTH: f64 = 0.8 * SIDE;
const WARM: usize = 20_000;
const TIMED: usize = 100_000;

fn percentile(sorted: &[u64], share: f64) -> u64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

fn report(name: &str, faces: usize, mut times: Vec<u64>, more: &str) {
    times.sort_unstable();
    println!(
        "{name:34} {faces:>8} faces: median {:>6} ns  p99 {:>6} ns  p99.9 {:>6} ns  max {:>8} ns  {more}",
        percentile(&times, 0.5),
        percentile(&times, 0.99),
        percentile(&times, 0.999),
        times[times.len() - 1]
    );
}

fn push(name: &str, mesh: &TriMesh, roi: RoiSize, carve: bool) {
    let mut params = RefineParams {
        roi,
        ..RefineParams::robust(TipParams {
            radius: RADIUS,
            stiffness: Some(STIFFNESS),
        })
    };
    if !carve {
        params.carve = None;
    }
    let mut refiner = Refiner::new(mesh.clone(), params).expect("the settings are in range");
    let mut times = Vec::with_capacity(TIMED);
    let mut vertices = 0;
    for i in 0..WARM + TIMED {
        let sample = slide(i, WIDTH);
        let start = Instant::now();
        let update = black_box(refiner.push(black_box(&sample))).expect("the sample is sound");
        let time = start.elapsed().as_nanos() as u64;
        assert!(update.fit.is_some() || i < 10, "push {i} moved nothing");
        if i >= WARM {
            times.push(time);
            vertices += refiner.moved_vertices().len();
        }
    }
    check_index(&refiner);
    let more = format!(
        "{:.1} vertices moved, {} cut back",
        vertices as f64 / TIMED as f64,
        refiner.counts().cut_back
    );
    report(name, mesh.face_count(), times, &more);
}

/// 1,000 closest faces against brute force over the faces nearby, on the current mesh.
fn check_index(refiner: &Refiner) {
    let mesh = refiner.mesh();
    for i in 0..1_000 {
        let at = slide(WARM + i * TIMED / 1_000, WIDTH)
            .pose_ot
            .translation
            .vector;
        let p = Point3::from(at + Vector3::new(0.3e-3, -0.2e-3, 0.1e-3));
        let hit = refiner.closest_face(&p, 0.1).expect("there is a face");
        let nearest = mesh
            .faces()
            .filter(|(face, _)| (mesh.barycentre(*face) - p).norm() < 0.02)
            .map(|(face, _)| {
                (triangle::closest_point(&p, &mesh.triangle(face)).0 - p).norm_squared()
            })
            .fold(f64::INFINITY, f64::min);
        assert!(
            (hit.distance_squared - nearest).abs() <= 1e-12 * nearest,
            "query {i}"
        );
        if mesh.face_count() > 200_000 && i >= 50 {
            // brute force over millions of faces: fifty full scans, the rest by rebuilding the tree
            // once
            return check_against_new_tree(refiner);
        }
    }
}

/// The same queries against a rebuilt tree.
fn check_against_new_tree(refiner: &Refiner) {
    let mesh = refiner.mesh();
    let tree = FaceTree::new(mesh);
    for i in 0..1_000 {
        let p = Point3::from(
            slide(WARM + i * TIMED / 1_000, WIDTH)
                .pose_ot
                .translation
                .vector,
        );
        assert_eq!(
            refiner.closest_face(&p, 0.1),
            tree.closest(mesh, &p, 0.1),
            "query {i}"
        );
    }
}

/// The least that any refiner must do.
fn minimal(mesh: &TriMesh) {
    let mut minimal = MinimalLoop::new(mesh.clone());
    let mut times = Vec::with_capacity(TIMED);
    for i in 0..WARM + TIMED {
        let sample = slide(i, WIDTH);
        let start = Instant::now();
        black_box(minimal.push(black_box(&sample)));
        if i >= WARM {
            times.push(start.elapsed().as_nanos() as u64);
        }
    }
    report("minimal loop", mesh.face_count(), times, "");
}

fn main() {
    let mut sizes: Vec<usize> = std::env::args()
        .filter_map(|word| word.parse().ok())
        .collect();
    if sizes.is_empty() {
        sizes = vec![10_000, 100_000, 1_000_000, 5_000_000];
    }
    for faces in sizes {
        let mesh = wavy_plate(faces).expect("it can be counted");
        let start = Instant::now();
        black_box(FaceTree::new(&mesh));
        println!(
            "tree built in {:.0} ms",
            start.elapsed().as_secs_f64() * 1e3
        );
        minimal(&mesh);
        push(
            "push, handle only, no carving",
            &mesh,
            RoiSize::Handle,
            false,
        );
        push("push, one ring, no carving", &mesh, RoiSize::OneRing, false);
        push("push, one ring", &mesh, RoiSize::OneRing, true);
        if (100_000..=1_000_000).contains(&faces) {
            push(
                "push, region of the tip's radius",
                &mesh,
                RoiSize::Radius(RADIUS),
                true,
            );
        }
    }
}
