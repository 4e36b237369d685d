//! The space that the ball swept is free of mesh.

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::{Patcher, PatcherParams, Splice};
use touchup::stylus::{Sample, Wrench};

use crate::plate_stream::contacts_of;
use crate::reconstruct::accuracy::sheet;
use crate::reconstruct::closed::cube;

const RADIUS: f64 = 1.5e-3;
/// The mesh consists of chords: for a circle of that radius, across a cell of half a radius, they
/// are this far inside.
const CHORD: f64 = 0.1 * RADIUS;
/// Samples between two renewals on the way: a third of a millimetre.
const RENEWED_EVERY: usize = 33;
/// Apparent depth of the ball in the part by noise alone.
const NOISE: f64 = 0.027 * RADIUS;

/// The patch of a ball that goes along a straight line, without force; made at once, and renewed on
/// the way.
fn after_free_motion(scan: &TriMesh, from: &Point3<f64>, to: &Point3<f64>) -> [TriMesh; 2] {
    const TICKS: i64 = 4000;
    let at = |tick: i64| {
        let centre = from + (to - from) * (tick as f64 / TICKS as f64);
        let wrench = Wrench {
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
        };
        let pose_ot = Isometry3::translation(centre.x, centre.y, centre.z);
        Sample {
            stamp_ns: tick * 1_000_000,
            pose_ot,
            wrench,
        }
    };
    let samples: Vec<_> = (0..TICKS).map(at).collect();
    let mut patcher = Patcher::new(PatcherParams::new(RADIUS, None, 0.05e-3)).unwrap();
    let tree = FaceTree::new(scan);
    let (mut mesh, mut mesh_tree, mut splice) =
        (scan.clone(), FaceTree::new(scan), Splice::default());
    let mut follow = |patcher: &mut Patcher| {
        let delta = patcher.renewed(scan, &tree);
        patcher.renew_far(scan, &tree);
        splice.begin();
        assert!(
            splice
                .go_on(&delta, usize::MAX, &mut mesh, &mut mesh_tree)
                .unwrap()
        );
    };
    for (at, contact) in contacts_of(RADIUS, None, &samples).iter().enumerate() {
        if at % RENEWED_EVERY == 0 {
            follow(&mut patcher);
        }
        patcher.push(contact);
    }
    patcher.flush();
    follow(&mut patcher);
    [patcher.patched(scan, &tree).unwrap().mesh, mesh]
}

/// The least distance of a vertex, or the middle of a face, from the line through two points,
/// between these.
fn nearest_to_line(mesh: &TriMesh, from: &Point3<f64>, to: &Point3<f64>) -> f64 {
    let along = to - from;
    let distance = |p: Point3<f64>| {
        let share = (p - from).dot(&along) / along.norm_squared();
        (p - (from + along * share.clamp(0.0, 1.0))).norm()
    };
    let of_face = |[a, b, c]: [Point3<f64>; 3]| {
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        [a, b, c, middle]
            .map(distance)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    };
    mesh.faces()
        .map(|(face, _)| of_face(mesh.triangle(face)))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn a_tunnel_is_as_wide_as_the_ball_that_went_through() {
    let scan = cube();
    for direction in [
        Vector3::x(),
        Vector3::new(1.0, 0.2, 0.1),
        Vector3::new(1.0, 0.7, 0.4),
    ] {
        let middle = Point3::new(0.1e-3, 0.3e-3, -0.2e-3);
        let [from, to] = [-20e-3, 20e-3].map(|along| middle + direction.normalize() * along);
        for nearest in
            after_free_motion(&scan, &from, &to).map(|mesh| nearest_to_line(&mesh, &from, &to))
        {
            println!("along {direction:?}: {:.3} radii", nearest / RADIUS);
            assert!(
                nearest > RADIUS - NOISE - CHORD,
                "{direction:?}: {nearest:e} m"
            );
        }
    }
}

/// The ball goes along the rim of a sheet, 0.9 mm deep in it.
#[test]
fn the_rim_of_a_scan_gives_way_to_the_ball() {
    let scan = sheet();
    for y in [-0.5e-3, 0.3e-3, 1e-3] {
        let [from, to] = [10e-3, 30e-3].map(|x| Point3::new(x, y, 0.6e-3));
        for nearest in
            after_free_motion(&scan, &from, &to).map(|mesh| nearest_to_line(&mesh, &from, &to))
        {
            println!("{y:e} m from the rim: {:.3} radii", nearest / RADIUS);
            // parts of the scan that reach into the ball between two unreached nodes of the lattice
            // stay
            assert!(
                nearest > RADIUS - NOISE - 2.0 * CHORD,
                "{y:e} m from the rim: {nearest:e} m"
            );
        }
    }
}
