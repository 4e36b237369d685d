//! Scans much finer than the tip: the cost of a touch, and the fate of the detail.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::haptic::RefineParams;
use touchup::live::{Engine, Gate, Pace, Renewal};
use touchup::mesh::{Changes, FaceTree, TriMesh, VertexId};
use touchup::reconstruct::{PatcherParams, Support};
use touchup::stylus::{Sample, TipParams, Wrench};

use crate::common::grid;
use crate::soundness::intersections;

const TIP: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(2e4),
};
/// The scan lies this much above the part, m.
const ABOVE: f64 = 0.3e-3;
/// Half the side of the touched square, m.
const TOUCHED: f64 = 3e-3;

/// Of the texture, m.
const HEIGHT: f64 = 0.02e-3;

/// Finer than the tip can feel, m.
fn texture(x: f64, y: f64) -> f64 {
    HEIGHT * (16e3 * x).sin() * (16e3 * y).cos()
}

fn scan() -> TriMesh {
    grid(160, 0.1e-3, |x, y| ABOVE + texture(x, y))
}

/// A ball that slides over z = 0 in lines 0.4 mm apart at 25 mm/s and 1 kHz.
fn samples() -> impl Iterator<Item = Sample> {
    let (lines, steps) = (16, 240);
    (0..lines * steps).map(move |i| {
        let (line, along) = (
            i / steps,
            f64::from(i % steps) / f64::from(steps) * 2.0 * TOUCHED - TOUCHED,
        );
        let x = if line % 2 == 0 { along } else { -along };
        let pose_ot = Isometry3::translation(
            x,
            f64::from(line) * 0.4e-3 - TOUCHED,
            TIP.radius - 2.0 / 2e4,
        );
        let wrench = Wrench {
            force: Vector3::z() * 2.0,
            torque: Vector3::zeros(),
        };
        Sample {
            stamp_ns: i64::from(i) * 1_000_000,
            pose_ot,
            wrench,
        }
    })
}

/// The mesh that the haptic update alone makes of a scan, and the largest number of vertices that
/// it moved at one sample.
fn touched(scan: &TriMesh) -> (TriMesh, usize) {
    let mut engine = Engine::new(
        scan.clone(),
        RefineParams::robust(TIP),
        None,
        Renewal::AtEnd,
    )
    .unwrap();
    let mut most = 0;
    for sample in samples() {
        engine.push(&sample).unwrap();
        most = most.max(engine.refiner().moved_vertices().len());
    }
    let ended = engine.finish().unwrap();
    (ended.mesh().into_owned(), most)
}

/// Root mean square deviation of the scan from the part in the touched region, without its texture,
/// m.
fn left(before: &TriMesh, after: &TriMesh, texture: fn(f64, f64) -> f64) -> f64 {
    let pairs = before.positions().iter().zip(after.positions());
    let inside = pairs.filter(|(p, _)| p.x.abs().max(p.y.abs()) < TOUCHED - 1e-3);
    let off: Vec<f64> = inside.map(|(p, q)| q.z - texture(p.x, p.y)).collect();
    (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt()
}

#[test]
fn a_dense_scan_goes_where_it_was_touched_and_keeps_its_texture() {
    let scan = scan();
    let (mesh, most) = touched(&scan);
    // the region of the tip has 700 vertices of this scan
    assert!(most < 60, "{most} vertices in one update");
    // a smooth scan with edges of the update's own length, and the root mean square of the texture
    let coarse = grid(21, 0.76e-3, |_, _| ABOVE);
    let of_coarse = left(&coarse, &touched(&coarse).0, |_, _| 0.0);
    let of_dense = left(&scan, &mesh, texture);
    println!(
        "{} mm off the part, a coarse scan {} mm",
        of_dense * 1e3,
        of_coarse * 1e3
    );
    assert!(
        of_dense < of_coarse + HEIGHT / 2.0,
        "{of_dense} m, on a coarse scan {of_coarse} m"
    );
    for (before, after) in scan.positions().iter().zip(mesh.positions()) {
        let (from_middle, aside) = (
            before.x.abs().max(before.y.abs()),
            (after - before).xy().norm(),
        );
        assert!(
            aside < 0.05e-3,
            "{before} went {} mm to the side",
            aside * 1e3
        );
        if from_middle > TOUCHED + TIP.radius + 2e-3 {
            assert_eq!(before, after, "nothing was touched here");
        }
    }
    assert!(intersections(&mesh, 1e-4, |_| true).is_empty());
}

#[test]
fn the_paper_takes_every_face_as_it_is() {
    let scan = scan();
    let engine = Engine::new(scan.clone(), RefineParams::paper(TIP), None, Renewal::AtEnd).unwrap();
    assert_eq!(engine.refiner().mesh().face_count(), scan.face_count());
}

/// The largest distance of a used vertex from another mesh, m, within `TOUCHED` of the middle.
fn farthest(from: &TriMesh, to: &TriMesh) -> f64 {
    let tree = FaceTree::new(to);
    let used = (0..from.vertex_slots() as u32)
        .map(VertexId)
        .filter(|&v| !from.star(v).is_empty());
    let near = used
        .map(|v| from.position(v))
        .filter(|p| p.x.abs().max(p.y.abs()) < TOUCHED);
    let off = |p: Point3<f64>| {
        tree.closest(to, &p, 1.0)
            .map_or(1.0, |hit| hit.distance_squared.sqrt())
    };
    near.map(off).fold(0.0, f64::max)
}

/// An engine with a live patch and a mesh to look at.
fn watched(scan: &TriMesh) -> Engine {
    let patch = PatcherParams::new(TIP.radius, TIP.stiffness, 0.1e-3);
    let pace = Pace {
        is_patient: true,
        ..Pace::default()
    };
    let shared = Arc::new((scan.clone(), FaceTree::new(scan)));
    let renewal = Renewal::Beside {
        scan: shared,
        pace,
        room: 1 << 14,
        gate: Gate::default(),
    };
    let mut engine = Engine::new(
        scan.clone(),
        RefineParams::robust(TIP),
        Some(patch),
        renewal,
    )
    .unwrap();
    engine.watch();
    engine
}

/// The corners of all faces, as bits, in an order of their own.
fn triangles(mesh: &TriMesh) -> Vec<[[u64; 3]; 3]> {
    let bits = |v: VertexId| mesh.position(v).coords.map(f64::to_bits).into();
    let mut all: Vec<_> = mesh.faces().map(|(_, corners)| corners.map(bits)).collect();
    all.iter_mut().for_each(|corners| {
        let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(least);
    });
    all.sort_unstable();
    all
}

#[test]
fn a_dense_scan_at_rest_is_shown_as_it_is_saved() {
    let scan = scan();
    let [mut rested, mut other] = [watched(&scan), watched(&scan)];
    assert!(rested.is_settled(), "nothing was touched");
    let (mut changes, mut rests) = (Changes::default(), 0);
    for (i, sample) in samples().enumerate() {
        rested.push(&sample).unwrap();
        other.push(&sample).unwrap();
        if i % 700 != 650 {
            continue;
        }
        assert!(!rested.is_settled());
        for engine in [&mut rested, &mut other] {
            engine.catch_up().unwrap();
            while !engine.take_changes(1 << 20, &mut changes).unwrap() {}
        }
        assert!(
            triangles(rested.mesh()) == triangles(other.mesh()),
            "sample {i}: the rest before left a trace"
        );
        while !rested.settle().unwrap() {
            std::thread::yield_now();
        }
        // a part of it, and the rest in small steps, as a view takes it
        while !rested.take_changes(50, &mut changes).unwrap() {}
        assert!(rested.is_settled());
        rests += 1;
        let mut saved = rested.copy_patcher().unwrap().unwrap().recv().unwrap();
        saved.flush();
        let patched = saved.patched(&scan, &FaceTree::new(&scan)).unwrap();
        assert!(
            triangles(rested.mesh()) == triangles(&patched.mesh),
            "sample {i}: not what is saved"
        );
        let shown = (0..rested.mesh().vertex_slots() as u32).map(VertexId);
        let shown = shown
            .filter(|&v| rested.support(&scan, v) == Support::Touched)
            .count();
        assert_eq!(
            shown,
            patched
                .support
                .iter()
                .filter(|&&support| support == Support::Touched)
                .count()
        );
    }
    assert!(rests > 2, "{rests} rests");
}

#[test]
fn a_dense_scan_is_shown_with_its_own_faces_and_those_of_the_patch() {
    let scan = scan();
    let mut engine = watched(&scan);
    assert!(engine.mesh().positions() == scan.positions());
    let mut changes = Changes::default();
    for (i, sample) in samples().enumerate() {
        engine.push(&sample).unwrap();
        if i % 33 == 0 {
            engine.take_changes(200, &mut changes).unwrap();
        }
    }
    engine.catch_up().unwrap();
    while !engine.take_changes(200, &mut changes).unwrap() {}
    let (shown, working) = (engine.mesh(), engine.refiner().mesh());
    assert!(
        working.face_count() < scan.face_count() / 5,
        "{}",
        working.face_count()
    );
    // the texture, and the deviation of coarse faces of the scan from it
    let [there, back] = [farthest(shown, working), farthest(working, shown)];
    assert!(
        there < 3.0 * HEIGHT && back < 3.0 * HEIGHT,
        "{there} {back}"
    );
    let mut gone = 0;
    for (face, corners) in scan.faces() {
        let from_middle = corners
            .map(|v| scan.position(v))
            .iter()
            .map(|p| p.x.abs().max(p.y.abs()))
            .fold(0.0, f64::max);
        let is_there = shown.has_face(face) && shown.corners(face) == corners;
        gone += usize::from(!is_there);
        if from_middle > TOUCHED + TIP.radius + 3e-3 {
            assert!(
                is_there
                    && corners
                        .iter()
                        .all(|&v| shown.position(v) == scan.position(v)),
                "{face:?}"
            );
        }
    }
    // a square of 6 mm has 7200 faces of this scan
    assert!(gone > 5000, "{gone} faces of the scan are hidden");
    let touched = (0..shown.vertex_slots() as u32).map(VertexId);
    let touched = touched
        .filter(|&v| engine.support(&scan, v) == Support::Touched)
        .count();
    assert!(touched > 100, "{touched} vertices shown as touched");
}
