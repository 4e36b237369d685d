//! Registration of points to a mesh: it finds known motions and reports unconstrained directions.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use proptest::prelude::*;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use touchup::align::{IcpError, IcpFit, IcpParams, icp};
use touchup::compare::{sample_surface, surface_area};
use touchup::io::mesh_file::{MeshUnit, read_mesh};
use touchup::mesh::{FaceTree, SerialWorkers, TriMesh};

use crate::shapes::revolved;

fn fitted(points: &[Point3<f64>], target: &TriMesh) -> Result<IcpFit, IcpError> {
    icp(
        points,
        target,
        &FaceTree::new(target),
        &Isometry3::identity(),
        &IcpParams::default(),
        &SerialWorkers,
    )
}

/// About `count` points of a mesh, with normal noise on each axis (m).
fn noisy(mesh: &TriMesh, count: usize, noise: f64) -> Vec<Point3<f64>> {
    let mut rng = Pcg64::new(7, 7);
    let samples = sample_surface(mesh, count as f64 / surface_area(mesh), 3);
    let mut shaken = |p: Point3<f64>| {
        let shake: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
        p + Vector3::from(shake) * noise
    };
    samples
        .into_iter()
        .map(|sample| shaken(sample.point))
        .collect()
}

/// Largest displacement between two motions of a corner of the bounding box, m.
fn apart(mesh: &TriMesh, a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let [lo, hi] = mesh.bounds();
    let corner = |i: usize| {
        Point3::from(Vector3::from_fn(|axis, _| {
            if i >> axis & 1 == 0 {
                lo[axis]
            } else {
                hi[axis]
            }
        }))
    };
    (0..8)
        .map(corner)
        .map(|p| (a * p - b * p).norm())
        .fold(0.0, f64::max)
}

/// A square in the plane z = 0 about the origin, of `cells` × `cells` cells of an edge (m), normals
/// up.
fn square(cells: u32, edge: f64) -> TriMesh {
    let row = cells + 1;
    let at = |i: u32| (f64::from(i) - f64::from(cells) / 2.0) * edge;
    let positions = (0..row * row)
        .map(|i| Point3::new(at(i % row), at(i / row), 0.0))
        .collect();
    let faces = (0..cells * cells).flat_map(|i| {
        let a = i / cells * row + i % cells;
        [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]
    });
    TriMesh::new(positions, faces.collect()).unwrap()
}

#[test]
fn a_known_motion_of_a_real_part_is_found_through_noise() {
    let Some(path) = crate::shared::shared("parts/permissive/crs_ee3.stl") else {
        return;
    };
    let part = read_mesh(&path, MeshUnit::Metre).unwrap().mesh;
    let known = Isometry3::new(
        Vector3::new(1.2e-3, -0.8e-3, 1.5e-3),
        Vector3::new(0.02, -0.015, 0.025),
    );
    let points: Vec<_> = noisy(&part, 40_000, 0.05e-3)
        .iter()
        .map(|p| known.inverse() * p)
        .collect();
    let fit = fitted(&points, &part).unwrap();
    let off = apart(&part, &fit.source_to_target, &known);
    // 0.05 mm over the root of 40 000 is 0.25 µm; a corner takes shift and turn, and round edges a
    // bias
    assert!(off < 5e-6, "{off} m off, {fit:?}");
    assert_eq!(fit.undetermined().count(), 0, "{:?}", fit.motions);
    assert!((fit.rms - 0.05e-3).abs() < 0.01e-3, "rms {}", fit.rms);
    assert!(fit.inliers > 38_000, "{}", fit.inliers);
}

#[test]
fn outliers_do_not_pull() {
    let part = revolved(
        &[
            (0.0, -5e-3),
            (20e-3, -5e-3),
            (20e-3, 5e-3),
            (8e-3, 5e-3),
            (8e-3, 15e-3),
            (0.0, 15e-3),
        ],
        6,
    );
    let known = Isometry3::new(
        Vector3::new(0.5e-3, 0.3e-3, -0.4e-3),
        Vector3::new(0.01, 0.01, -0.02),
    );
    let mut points = noisy(&part, 20_000, 0.02e-3);
    // a fifth of the points floats 3 mm above
    points.iter_mut().step_by(5).for_each(|p| p.z += 3e-3);
    points.iter_mut().for_each(|p| *p = known.inverse() * *p);
    let fit = fitted(&points, &part).unwrap();
    let off = apart(&part, &fit.source_to_target, &known);
    assert!(off < 20e-6, "{off} m off");
}

#[test]
fn a_plane_slides_and_turns_and_nothing_else() {
    let plane = square(20, 5e-3);
    let points: Vec<_> = noisy(&plane, 5_000, 0.02e-3)
        .iter()
        .map(|p| p + Vector3::z() * 1e-3)
        .collect();
    let fit = fitted(&points, &plane).unwrap();
    let loose: Vec<_> = fit.undetermined().collect();
    assert_eq!(loose.len(), 3);
    for motion in &loose {
        let leaves_the_plane = motion.shift.z.abs() + motion.turn.x.abs() + motion.turn.y.abs();
        assert!(leaves_the_plane < 1e-6, "{motion:?}");
    }
    let pose = fit.source_to_target;
    assert!((pose.translation.z + 1e-3).abs() < 2e-6, "{pose}");
    assert!(
        pose.translation.x.abs() + pose.translation.y.abs() < 1e-6,
        "it must not slide by itself: {pose}"
    );
}

#[test]
fn a_cylinder_turns_and_slides_along_its_axis() {
    let tube = revolved(&[(10e-3, -20e-3), (10e-3, 0.0), (10e-3, 20e-3)], 64);
    let points: Vec<_> = noisy(&tube, 20_000, 0.02e-3)
        .iter()
        .map(|p| p + Vector3::new(0.3e-3, 0.1e-3, 0.0))
        .collect();
    let fit = fitted(&points, &tube).unwrap();
    let loose: Vec<_> = fit.undetermined().collect();
    assert_eq!(loose.len(), 2, "{:?}", fit.motions);
    for motion in loose {
        let across = motion.shift.xy().norm() + motion.turn.xy().norm();
        assert!(across < 0.05, "{motion:?}");
    }
    let shift = fit.source_to_target.translation;
    assert!(
        (shift.x + 0.3e-3).abs() < 5e-6 && (shift.y + 0.1e-3).abs() < 5e-6,
        "{shift}"
    );
}

#[test]
fn a_sphere_turns_about_every_axis() {
    let outline: Vec<_> = (0..=48)
        .map(|i| TAU / 96.0 * f64::from(i) - TAU / 4.0)
        .map(|a| (10e-3 * a.cos().max(0.0), 10e-3 * a.sin()))
        .collect();
    let ball = revolved(&outline, 96);
    let points: Vec<_> = noisy(&ball, 20_000, 0.01e-3)
        .iter()
        .map(|p| p + Vector3::new(0.2e-3, 0.0, -0.1e-3))
        .collect();
    let fit = fitted(&points, &ball).unwrap();
    assert_eq!(fit.undetermined().count(), 3, "{:?}", fit.motions);
    assert!(
        fit.undetermined().all(|motion| motion.shift.norm() < 0.02),
        "{:?}",
        fit.motions
    );
    assert!(
        fit.source_to_target.rotation.angle() < 1e-3,
        "it must not turn by itself"
    );
}

#[test]
fn what_cannot_be_fitted_is_refused_with_numbers() {
    let plane = square(4, 5e-3);
    let tree = FaceTree::new(&plane);
    let far = vec![Point3::new(0.0, 0.0, 1.0); 100];
    let near = IcpParams {
        reach: 1e-3,
        ..Default::default()
    };
    let refused = icp(
        &far,
        &plane,
        &tree,
        &Isometry3::identity(),
        &near,
        &SerialWorkers,
    )
    .unwrap_err();
    assert_eq!(
        refused,
        IcpError::TooFew {
            found: 0,
            needed: 12,
            reach: 1e-3
        }
    );
    assert_eq!(
        refused.to_string(),
        "0 points lie within 1.000 mm of the target, 12 are needed: are both in the same unit, and roughly in place?"
    );
    let mut bad = vec![Point3::origin(); 20];
    bad[7].y = f64::NAN;
    assert_eq!(
        fitted(&bad, &plane).unwrap_err(),
        IcpError::NotFinite { point: 7 }
    );
    assert!(matches!(
        fitted(&[], &plane),
        Err(IcpError::TooFew { found: 0, .. })
    ));
    // all at one place: a fit without a lever, which nothing but the height determines
    let one = fitted(&[Point3::new(0.0, 0.0, 1e-3); 50], &plane);
    assert!(one.is_ok_and(|fit| fit.undetermined().count() == 5));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// The common frame of both does not matter.
    #[test]
    fn a_motion_of_both_moves_the_answer(
        axis in prop::array::uniform3(-1.0..1.0f64), angle in -3.0..3.0f64, shift in prop::array::uniform3(-0.2..0.2f64),
    ) {
        prop_assume!(Vector3::from(axis).norm() > 0.1);
        let part = revolved(&[(0.0, 0.0), (20e-3, 0.0), (25e-3, 8e-3), (10e-3, 12e-3), (0.0, 12e-3)], 5);
        let known = Isometry3::new(Vector3::new(0.4e-3, -0.2e-3, 0.3e-3), Vector3::new(0.01, 0.02, -0.01));
        let points: Vec<_> = noisy(&part, 4_000, 0.0).iter().map(|p| known.inverse() * p).collect();
        let turn = Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis.into()), angle);
        let frame = Isometry3::from_parts(Vector3::from(shift).into(), turn.into());
        let there = TriMesh::new(
            part.positions().iter().map(|p| frame * p).collect(),
            part.faces().map(|(_, corners)| corners.map(|v| v.0)).collect(),
        ).unwrap();
        let moved: Vec<_> = points.iter().map(|p| frame * p).collect();
        let fit = fitted(&moved, &there).unwrap();
        // without noise it is exact to the rounding of coordinates of 0.2 m
        let off = apart(&there, &fit.source_to_target, &(frame * known * frame.inverse()));
        prop_assert!(off < 1e-10, "{} m off", off);
    }
}
