//! A closed scan stays closed, for any places of the ball.

use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::{Patcher, PatcherParams, Splice};
use touchup::stylus::{Sample, Wrench};

use crate::common::within;
use crate::full::either;
use crate::plate_stream::contacts_of;
use crate::shapes::{icosphere, subdivided, torus};
use crate::soundness::soundness;

const RADIUS: f64 = 1.5e-3;
const STIFFNESS: f64 = 20e3;

/// A cube of 20 mm around the origin, its faces halved three times.
pub fn cube() -> TriMesh {
    let half = 10e-3;
    let corner =
        |i: u32| Point3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half } else { -half }));
    let squares = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces = squares
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let cube = TriMesh::new((0..8).map(corner).collect(), faces).unwrap();
    (0..3).fold(cube, |mesh, _| subdivided(&mesh, |p| p))
}

/// A walk of the ball in and around a part, which turns back `far` (m) from its middle: mostly
/// without force, now and then pressed against anything, and at its end.
fn walk(seed: u64, start: Point3<f64>, far: f64) -> Vec<Sample> {
    let rng = &mut Pcg64::seed_from_u64(seed);
    let mut any = |size: f64| Vector3::from_fn(|_, _| within(rng, -size, size));
    let (mut x, mut step) = (start.coords, any(1e-4));
    let is_pressed = |tick: i64| tick > 1400 || (seed % 4 >= 2 && tick % 400 > 350);
    let samples = (0..1500).map(|tick| {
        step = (step + any(2e-5)) * 0.99;
        step *= (2e-4 / step.norm()).min(1.0);
        x += step;
        if x.norm() > far {
            (x, step) = (x * (far / x.norm()), -step);
        }
        let force = if is_pressed(tick) {
            any(1.0).normalize() * 2.0
        } else {
            Vector3::zeros()
        };
        let wrench = Wrench {
            force,
            torque: Vector3::zeros(),
        };
        Sample {
            stamp_ns: tick * 1_000_000,
            pose_ot: Isometry3::translation(x.x, x.y, x.z),
            wrench,
        }
    });
    samples.collect()
}

fn parts() -> [(&'static str, TriMesh, Point3<f64>); 3] {
    [
        ("sphere", icosphere(10e-3, 3), Point3::origin()),
        ("cube", cube(), Point3::origin()),
        (
            "torus",
            torus(9e-3, 3e-3, [48, 20]),
            Point3::new(9e-3, 0.0, 0.0),
        ),
    ]
}

/// Sphere and cube: before, 40 such walks in a sphere opened 162 to 430 edges each, 10,754 in all.
#[test]
fn walks_in_and_out_of_a_closed_scan_open_no_edge() {
    for (name, scan, start) in parts().into_iter().take(2) {
        assert!(soundness(&scan).rims.is_empty(), "the {name} is closed");
        let tree = FaceTree::new(&scan);
        for seed in 0..either(8, 400) {
            let far = if seed % 2 == 0 { 13e-3 } else { 8e-3 };
            let contacts = contacts_of(RADIUS, Some(STIFFNESS), &walk(seed, start, far));
            let mut patcher =
                Patcher::new(PatcherParams::new(RADIUS, Some(STIFFNESS), 0.05e-3)).unwrap();
            contacts.iter().for_each(|contact| patcher.push(contact));
            patcher.flush();
            let patched = patcher.patched(&scan, &tree).unwrap();
            let open = soundness(&patched.mesh).rims.len();
            assert_eq!(
                open, 0,
                "{name}, seed {seed}: {} squares",
                patched.open_squares
            );
            assert!(
                patched.added_faces > 100,
                "{name}, seed {seed}: it is no walk"
            );
        }
    }
}

/// The mesh that follows, bit by bit, closes after each renewal.
#[test]
fn a_closed_scan_that_follows_its_patch_is_closed_all_along() {
    for (name, scan, start) in parts() {
        let tree = FaceTree::new(&scan);
        for seed in 0..either(2, 40) {
            let mut patcher =
                Patcher::new(PatcherParams::new(RADIUS, Some(STIFFNESS), 0.05e-3)).unwrap();
            let (mut mesh, mut mesh_tree, mut splice) =
                (scan.clone(), FaceTree::new(&scan), Splice::default());
            for contacts in
                contacts_of(RADIUS, Some(STIFFNESS), &walk(seed, start, 13e-3)).chunks(150)
            {
                contacts.iter().for_each(|contact| patcher.push(contact));
                let delta = patcher.renewed(&scan, &tree);
                patcher.renew_far(&scan, &tree);
                splice.begin();
                assert!(
                    splice
                        .go_on(&delta, usize::MAX, &mut mesh, &mut mesh_tree)
                        .unwrap()
                );
                let open = soundness(&mesh).rims.len();
                assert_eq!(
                    open, 0,
                    "{name}, seed {seed}, at {} ns",
                    contacts[0].tip.stamp_ns
                );
            }
        }
    }
}
