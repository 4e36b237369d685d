//! A touch too light for a contact gives neither a surface nor free space: the scan keeps its
//! shape.

use std::fs;

use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use touchup::haptic::{RefineParams, Refiner};
use touchup::live::{Engine, Renewal};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::PatcherParams;
use touchup::stylus::{Sample, TipParams, Wrench};

use crate::common::grid;

const TIP: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(2e4),
};
/// Depth of the ball below the scan, m.
const BELOW: f64 = 1e-3;

/// A ball that goes to and fro at 40 mm/s, 1 mm below the scan at z = 0, and presses upwards as a
/// part does.
///
/// - `force`: at a time, s; N.
fn slide(seconds: f64, noise: f64, force: impl Fn(f64) -> f64) -> Vec<Sample> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
    let mut gauss = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng)) * noise;
    let at = |ms: i64| {
        let t = ms as f64 * 1e-3;
        let along = 20e-3 * (2.0 * (t % 1.0) - 1.0).abs();
        let pose_ot = Isometry3::translation(along - 10e-3, 1e-3 * t - 4e-3, TIP.radius - BELOW);
        let wrench = Wrench {
            force: Vector3::z() * force(t) + gauss(),
            torque: Vector3::zeros(),
        };
        Sample {
            stamp_ns: ms * 1_000_000,
            pose_ot,
            wrench,
        }
    };
    (0..(seconds * 1e3) as i64).map(at).collect()
}

/// The mesh as moved, and the surface that the patch makes of the samples.
fn refined(scan: &TriMesh, samples: &[Sample]) -> (TriMesh, TriMesh) {
    let patch = PatcherParams::new(TIP.radius, TIP.stiffness, 0.3e-3);
    let mut engine = Engine::new(
        scan.clone(),
        RefineParams::robust(TIP),
        Some(patch),
        Renewal::AtEnd,
    )
    .unwrap();
    for sample in samples {
        engine.push(sample).unwrap();
    }
    let mut ended = engine.finish().unwrap();
    let patched = ended
        .patcher
        .take()
        .unwrap()
        .patched(scan, &FaceTree::new(scan))
        .unwrap();
    (ended.mesh().into_owned(), patched.mesh)
}

fn lowest(mesh: &TriMesh) -> f64 {
    mesh.positions()
        .iter()
        .map(|p| p.z)
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn a_light_touch_leaves_the_scan_as_it_was_and_free_motion_does_not() {
    let scan = grid(40, 1e-3, |_, _| 0.0);
    for noise in [0.0, 0.01, 0.03] {
        let touched = slide(8.0, noise, |t| 0.22 + 0.02 * (9.0 * t).sin());
        let (moved, patched) = refined(&scan, &touched);
        assert!(moved.positions() == scan.positions(), "noise {noise} N");
        assert!(
            patched.positions() == scan.positions(),
            "patch at a noise of {noise} N"
        );
        let free = slide(8.0, noise, |_| 0.0);
        let (moved, patched) = refined(&scan, &free);
        assert!(
            lowest(&moved) < -0.8 * BELOW && lowest(&patched) < -0.8 * BELOW,
            "noise {noise} N"
        );
    }
}

/// A robot's ball that slid over a phantom at some 0.24 N, and as its scan the plane through the
/// mean of the centres, a radius too high.
#[test]
#[expect(clippy::too_many_lines)]
fn a_real_recording_of_light_touches_does_not_carve() {
    let Some(file) = crate::shared::shared("force/vu_dvrk_exploration/KidneyZ4-21Oct.csv") else {
        return;
    };
    let text = fs::read_to_string(file).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    let mut samples: Vec<Sample> = Vec::new();
    for row in &rows {
        let stamp_ns = (row[0] * 1e13) as i64 + (row[1] * 1e9) as i64;
        if samples.last().is_none_or(|last| last.stamp_ns < stamp_ns) {
            let pose_ot = Isometry3::translation(row[2] * 1e-3, row[3] * 1e-3, row[4] * 1e-3);
            let wrench = Wrench {
                force: Vector3::new(row[5], row[6], row[7]),
                torque: Vector3::zeros(),
            };
            samples.push(Sample {
                stamp_ns,
                pose_ot,
                wrench,
            });
        }
    }
    let centres: Vec<Point3<f64>> = samples
        .iter()
        .map(|s| s.pose_ot.translation.vector.into())
        .collect();
    let low = centres
        .iter()
        .fold(Point3::new(1.0, 1.0, 1.0), |low, p| low.inf(p));
    let high = centres
        .iter()
        .fold(Point3::new(-1.0, -1.0, -1.0), |high, p| high.sup(p));
    let size = high - low;
    let height = centres.iter().map(|p| p.z).sum::<f64>() / centres.len() as f64;
    let plane = grid((size.x.max(size.y) * 1e3).ceil() as u32, 1e-3, |_, _| {
        height
    });
    let middle = (low.coords + high.coords) / 2.0;
    let positions = plane
        .positions()
        .iter()
        .map(|p| p + Vector3::new(middle.x, middle.y, 0.0))
        .collect();
    let faces = plane
        .faces()
        .map(|(_, corners)| corners.map(|corner| corner.0))
        .collect();
    let scan = TriMesh::new(positions, faces).unwrap();
    let tip = TipParams {
        radius: 3.15e-3,
        stiffness: None,
    };
    let mut refiner = Refiner::new(scan.clone(), RefineParams::robust(tip)).unwrap();
    for sample in &samples {
        refiner.push(sample).unwrap();
    }
    let counts = refiner.counts();
    assert!(counts.light > counts.accepted / 100 * 99, "{counts:?}");
    assert!(refiner.mesh().positions() == scan.positions());
}
