//! Scans finer than the tip: if a scan has the touched shape, it moves and keeps its detail;
//! elsewhere the patch replaces it.

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::mesh::{FaceTree, TriMesh, VertexId};
use touchup::reconstruct::{PatchedMesh, Patcher, PatcherParams, Support};
use touchup::stylus::{ContactEstimator, ContactEstimatorParams, Sample, TipParams, Wrench};

use crate::common::grid;
use crate::soundness::{intersections, soundness};

const RADIUS: f64 = 1.5e-3;
/// The scan lies this much above the part, m.
const ABOVE: f64 = 0.2e-3;
/// Half the side of the touched square, m.
const TOUCHED: f64 = 5e-3;
/// Half the side of a square hole, m.
const HOLE: f64 = 2.5e-3;
/// Of the engraved lines, m.
const DEPTH: f64 = 0.02e-3;

/// Engraved lines 1.5 mm apart, much narrower than the tip, m.
fn engraved(x: f64) -> f64 {
    let to_line = (x / 1.5e-3 - (x / 1.5e-3).round()).abs() * 1.5e-3;
    -DEPTH * (-(to_line / 0.15e-3).powi(2)).exp()
}

fn scan(noise: f64) -> TriMesh {
    // an own small generator
    let state = std::cell::Cell::new(1u64);
    let next = || {
        state.set(
            state
                .get()
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407),
        );
        (state.get() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    grid(160, 0.125e-3, |x, _| {
        ABOVE + engraved(x) + noise * 12f64.sqrt() * next()
    })
}

/// A ball slides over z = 0 in lines 0.8 mm apart, over a hole in the middle it goes down by
/// `sinks` (m) and up again.
fn patched(scan: &TriMesh, sinks: f64) -> PatchedMesh {
    let mut contacts = ContactEstimator::new(ContactEstimatorParams::new(TipParams {
        radius: RADIUS,
        stiffness: None,
    }))
    .unwrap();
    let mut patcher = Patcher::new(PatcherParams::new(RADIUS, None, 0.1e-3)).unwrap();
    let (lines, steps) = (13, 400);
    for i in 0..lines * steps {
        let (line, along) = (
            i / steps,
            f64::from(i % steps) / f64::from(steps) * 2.0 * TOUCHED - TOUCHED,
        );
        let (x, y) = (
            if line % 2 == 0 { along } else { -along },
            f64::from(line) * 0.8e-3 - 4.8e-3,
        );
        // clear of floor and walls
        let inside = HOLE - 1.1 * RADIUS - x.abs().max(y.abs());
        let is_over = sinks > 0.0 && x.abs().max(y.abs()) < HOLE;
        let down = if is_over {
            (4.0 * inside).clamp(0.0, sinks)
        } else {
            0.0
        };
        let force = if is_over { 0.0 } else { 2.0 };
        let pose_ot = Isometry3::translation(x, y, RADIUS - down);
        let wrench = Wrench {
            force: Vector3::z() * force,
            torque: Vector3::zeros(),
        };
        patcher.push(
            contacts
                .observe(&Sample {
                    stamp_ns: i64::from(i) * 1_000_000,
                    pose_ot,
                    wrench,
                })
                .unwrap(),
        );
    }
    patcher.flush();
    patcher.patched(scan, &FaceTree::new(scan)).unwrap()
}

/// Within the touched square by a radius, and farther than two radii from a hole.
fn is_well_inside(p: &Point3<f64>) -> bool {
    let from_middle = p.x.abs().max(p.y.abs());
    from_middle < TOUCHED - RADIUS && from_middle > HOLE + 0.3e-3
}

/// Distance from the touched part, m: the ball rests on the plane between the lines.
fn p95(mesh: &TriMesh, part: impl Fn(f64) -> f64) -> f64 {
    let used = (0..mesh.vertex_slots() as u32)
        .map(VertexId)
        .filter(|&v| !mesh.star(v).is_empty());
    let inside = used
        .map(|v| mesh.position(v))
        .filter(|p| is_well_inside(p) && p.z.abs() < 1e-3);
    let mut off: Vec<f64> = inside.map(|p| (p.z - part(p.x)).abs()).collect();
    off.sort_unstable_by(f64::total_cmp);
    off[off.len() * 95 / 100]
}

#[test]
fn what_is_engraved_stays_where_the_scan_agrees_with_touch() {
    let scan = scan(0.0);
    let patched = patched(&scan, 0.0);
    assert_eq!(
        (patched.removed_faces, patched.added_faces),
        (0, 0),
        "nothing is to be replaced"
    );
    let (before, after) = (p95(&scan, engraved), p95(&patched.mesh, engraved));
    println!(
        "p95 {:.4} mm before, {:.4} mm after",
        before * 1e3,
        after * 1e3
    );
    assert!(after < 0.004e-3 && before > 0.19e-3, "{before} {after}");
    let mut moved = 0;
    for (vertex, (was, is)) in scan
        .positions()
        .iter()
        .zip(patched.mesh.positions())
        .enumerate()
    {
        let from_middle = was.x.abs().max(was.y.abs());
        if from_middle > TOUCHED + 2.0 * RADIUS {
            assert!(was == is && patched.support[vertex] == Support::Scan);
        }
        moved += usize::from(was != is);
        let is_touched = patched.support[vertex] == Support::Touched;
        assert!(is_touched || from_middle > TOUCHED - 1e-3, "{was}");
    }
    assert_eq!(patched.moved_vertices, moved);
    assert!(intersections(&patched.mesh, 1e-4, |_| true).is_empty());
}

#[test]
fn a_hole_opens_in_a_scan_whose_detail_stays() {
    let scan = scan(0.0);
    let patched = patched(&scan, 2.5e-3);
    let after = p95(&patched.mesh, engraved);
    println!(
        "p95 {:.4} mm, {} removed, {} added",
        after * 1e3,
        patched.removed_faces,
        patched.added_faces
    );
    assert!(patched.removed_faces > 200 && after < 0.02e-3, "{after}");
    let lid = patched
        .mesh
        .faces()
        .map(|(face, _)| patched.mesh.barycentre(face));
    let lid = lid
        .filter(|p| p.x.abs().max(p.y.abs()) < 0.6e-3 && p.z > -1e-3)
        .count();
    assert_eq!(lid, 0, "faces across the hole");
    let (was, is) = (soundness(&scan), soundness(&patched.mesh));
    assert_eq!((was.bad_edges, is.bad_edges), (0, 0));
    assert!(intersections(&patched.mesh, 1e-4, |_| true).is_empty());
}

#[test]
fn noise_is_no_detail() {
    let noisy = scan(0.05e-3);
    let patched = patched(&noisy, 0.0);
    assert_eq!(patched.moved_vertices, 0);
    let after = p95(&patched.mesh, |_| 0.0);
    assert!(after < 0.03e-3, "touches do better: {after}");
}
