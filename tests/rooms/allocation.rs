//! No sample costs an allocation once the refiner is warm: counted by the allocator itself.

use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::haptic::{GuardParams, RefineParams, Refiner, RoiSize};
use touchup::mesh::TriMesh;
use touchup::stylus::{
    BiasParams, MarkerBody, MarkerFilter, MarkerFrame, MarkerObservation, MarkerParams, Sample,
    StampedPose, TipParams, Wrench,
};
use touchup_report::allocations::asked;

use crate::common::{grid, within};

/// Requests of this thread up to now; asking adds one.
fn requests() -> u64 {
    asked().unwrap().requests
}

/// Samples of the path, at 1 kHz.
const PATH: i64 = 2_000;
/// Times that the path is gone again.
const ROUNDS: i64 = 5;
const TIP: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(20e3),
};

/// A figure of eight on the true plane z = 0, pressed with 2 N for four fifths of the path and
/// lifted off for the rest; the scan lies up to 0.3 mm off.
fn sample(tick: i64) -> Sample {
    let turn = std::f64::consts::TAU * tick as f64 / PATH as f64;
    let force = if tick % PATH < PATH * 4 / 5 { 2.0 } else { 0.0 };
    let height = TIP.radius - force / 20e3 + if force > 0.0 { 0.0 } else { -0.1e-3 };
    let pose_ot = Isometry3::translation(8e-3 * turn.sin(), 6e-3 * (2.0 * turn).sin(), height);
    let wrench = Wrench {
        force: Vector3::z() * force,
        torque: Vector3::zeros(),
    };
    Sample {
        stamp_ns: tick * 1_000_000,
        pose_ot,
        wrench,
    }
}

fn scan() -> TriMesh {
    let mut rng = Pcg64::seed_from_u64(1);
    grid(40, 1e-3, |_, _| within(&mut rng, -0.3e-3, 0.3e-3))
}

/// Allocations of `ROUNDS` times the path after one to warm up.
fn allocations(params: RefineParams) -> u64 {
    let mut refiner = Refiner::new(scan(), params).unwrap();
    (0..PATH).for_each(|tick| {
        refiner.push(&sample(tick)).unwrap();
    });
    let moved = refiner.counts().moved;
    let before = requests() + 1;
    for tick in PATH..PATH * (1 + ROUNDS) {
        refiner.push(&sample(tick)).unwrap();
    }
    let requests = requests() - before;
    let moved = refiner.counts().moved - moved;
    assert!(moved > 7_000, "the samples move the mesh: {moved}");
    requests
}

#[test]
fn the_counter_counts() {
    let before = requests() + 1;
    let list = std::hint::black_box(vec![1u8; 100]);
    assert_eq!((requests() - before, list.len()), (1, 100));
}

#[test]
fn no_sample_allocates_once_warm() {
    let paper = RefineParams {
        largest_move_edges: 2.6,
        guard: Some(GuardParams::default()),
        ..RefineParams::paper(TIP)
    };
    let tracked = RefineParams {
        bias: Some(BiasParams::default()),
        ..RefineParams::robust(TIP)
    };
    for (mode, params) in [
        ("robust", RefineParams::robust(TIP)),
        ("paper", paper),
        ("bias", tracked),
    ] {
        for roi in [
            RoiSize::OneRing,
            RoiSize::Radius(1.5e-3),
            RoiSize::Radius(4e-3),
        ] {
            assert_eq!(
                allocations(RefineParams { roi, ..params }),
                0,
                "{mode} {roi:?}"
            );
        }
    }
}

/// Frames with occlusion, outliers, losses and new first poses.
#[test]
fn no_marker_frame_allocates() {
    let markers_t = [
        [28, 0, 120],
        [-20, 22, 128],
        [-16, -26, 140],
        [18, 24, 155],
        [-30, 2, 168],
        [6, -22, 180],
    ];
    let body = MarkerBody::new(
        markers_t
            .map(|p| Point3::from(p.map(|x| f64::from(x) * 1e-3)))
            .to_vec(),
    )
    .unwrap();
    let mut filter = MarkerFilter::new(body.clone(), MarkerParams::default()).unwrap();
    let (mut poses, mut last) = (0_u64, None::<StampedPose>);
    let before = requests() + 1;
    for i in 0..2000_i64 {
        let mut frame = MarkerFrame::new(i * 5_000_000);
        let pose_ot = Isometry3::translation(0.05 * (i as f64 * 0.01).sin(), 0.0, 0.0);
        for (label, marker) in body.markers_t().iter().enumerate() {
            let is_seen = (i / 20 + label as i64) % 4 != 0 && i % 400 < 350;
            let far = if label as i64 == i % 50 { 0.1 } else { 0.0 };
            let position = pose_ot * marker + Vector3::x() * far;
            assert!(
                !is_seen
                    || frame.see(MarkerObservation {
                        label: label as u32,
                        position
                    })
            );
        }
        filter.push(&frame, |pose| {
            poses += 1;
            last = Some(pose);
        });
    }
    assert_eq!(requests() - before, 0);
    assert!(
        poses > 5000 && filter.counts().lost > 100 && filter.counts().rejected > 100,
        "{:?}",
        filter.counts()
    );
}
