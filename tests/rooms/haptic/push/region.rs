//! The vertices that a push moves, and their shares of its displacement.

use std::collections::BTreeSet;

use super::*;
use touchup::haptic::{Case, RegionFit, RoiSize};
use touchup::mesh::FaceId;

fn neighbours(mesh: &TriMesh, vertex: VertexId) -> BTreeSet<VertexId> {
    let around = mesh
        .star(vertex)
        .iter()
        .flat_map(|&face| mesh.corners(face));
    around.filter(|&other| other != vertex).collect()
}

/// Vertices that may move with a handle: its corners, and those near it or next to it.
fn region(mesh: &TriMesh, handle: FaceId, size: RoiSize) -> BTreeSet<VertexId> {
    let corners = mesh.corners(handle);
    let mut region = BTreeSet::from(corners);
    match size {
        RoiSize::Handle => {}
        RoiSize::OneRing => corners
            .iter()
            .for_each(|&corner| region.extend(neighbours(mesh, corner))),
        RoiSize::Radius(radius) => {
            let middle = mesh.barycentre(handle);
            let all = (0..mesh.vertex_count() as u32).map(VertexId);
            region.extend(all.filter(|&v| (mesh.position(v) - middle).norm() <= radius));
        }
    }
    region
}

const SIZES: [RoiSize; 4] = [
    RoiSize::Handle,
    RoiSize::OneRing,
    RoiSize::Radius(1.5e-3),
    RoiSize::Radius(6e-3),
];

#[test]
fn vertices_outside_the_region_are_bit_equal_after_every_push() {
    for size in SIZES {
        for preset in [RefineParams::robust, RefineParams::paper] {
            let mut refiner = Refiner::new(
                bumpy(3),
                RefineParams {
                    roi: size,
                    carve: None,
                    ..preset(BALL)
                },
            )
            .unwrap();
            let mut handle = None;
            let mut allowed = BTreeSet::new();
            let mut moves = 0;
            for sample in raster(8e-3, 3, 0.1, &BALL, |_| 2.0) {
                let before = refiner.mesh().clone();
                let update = refiner.push(&sample).unwrap();
                let face = update.mismatch.map(|mismatch| mismatch.face);
                if update.fit.is_some() && face != handle {
                    handle = face;
                    // the region dates from the take-up of its handle
                    allowed = region(&before, face.unwrap(), size);
                }
                let (was, is) = (bits(&before), bits(refiner.mesh()));
                for vertex in (0..was.len()).filter(|&v| was[v] != is[v]) {
                    assert!(update.fit.is_some(), "nothing was to be moved");
                    assert!(
                        allowed.contains(&VertexId(vertex as u32)),
                        "{size:?}: vertex {vertex}"
                    );
                    moves += 1;
                }
            }
            assert!(moves > 1000, "{size:?}: {moves}");
        }
    }
}

/// Carving moves no more than the corners of one face.
#[test]
fn carving_moves_the_corners_of_one_face() {
    let mut refiner = Refiner::new(bumpy(3), RefineParams::robust(BALL)).unwrap();
    let mut carved = 0;
    // known to be free, well above
    for tick in -100..0 {
        refiner
            .push(&sample(
                tick,
                Point3::new(0.4e-3, 0.9e-3, 0.1),
                Vector3::zeros(),
            ))
            .unwrap();
    }
    for tick in 0..400 {
        let before = refiner.mesh().clone();
        let centre = Point3::new(0.4e-3 + 5e-6 * tick as f64, 0.9e-3, RADIUS - 0.3e-3);
        let update = refiner
            .push(&sample(tick, centre, Vector3::zeros()))
            .unwrap();
        let (was, is) = (bits(&before), bits(refiner.mesh()));
        let moved: Vec<_> = (0..was.len() as u32)
            .filter(|&v| was[v as usize] != is[v as usize])
            .collect();
        let is_one_face = before
            .faces()
            .any(|(_, corners)| moved.iter().all(|&v| corners.contains(&VertexId(v))));
        assert!(is_one_face, "{moved:?}");
        if !moved.is_empty() {
            assert_eq!(update.case, Case::MeshOnly);
            // the force that the spring of 20 N/mm lets expect at the plane of the face around the
            // tip, with no measured force
            let mismatch = update.mismatch.unwrap();
            let [a, b, c] = before.triangle(mismatch.face);
            let n = (b - a).cross(&(c - a)).normalize();
            let smoothed = refiner.contacts().latest().unwrap().ball.centre;
            let h = (smoothed - n * RADIUS - Point3::from((a.coords + b.coords + c.coords) / 3.0))
                .dot(&n);
            assert!(
                (mismatch.distance - h).abs() < 1e-12
                    && (mismatch.expected_force_o - n * (-2e4 * h).max(0.0)).norm() < 1e-6
            );
            assert!(
                mismatch.linear == -mismatch.expected_force_o
                    && mismatch.rotational == Vector3::zeros()
            );
            carved += 1;
        }
    }
    assert!(carved > 50, "{carved}");
}

/// The solver determines weights to 1e-9 of their start; the mean over up to a dozen neighbours to
/// twice that.
const MEAN_TOL: f64 = 1e-7;

/// One push from rest; gives the displacement of each vertex and the handle.
fn one_push(scan: TriMesh, size: RoiSize, at: Point3<f64>) -> (Vec<Vector3<f64>>, FaceId, TriMesh) {
    let mut refiner = Refiner::new(
        scan.clone(),
        RefineParams {
            roi: size,
            carve: None,
            ..RefineParams::robust(BALL)
        },
    )
    .unwrap();
    refiner.push(&sample(0, at, Vector3::z() * 2.0)).unwrap();
    assert!(bits(refiner.mesh()) == bits(&scan), "no time has passed");
    let update = refiner.push(&sample(1, at, Vector3::z() * 2.0)).unwrap();
    assert_eq!(update.fit, Some(RegionFit::Whole));
    let displacements = refiner
        .mesh()
        .positions()
        .iter()
        .zip(scan.positions())
        .map(|(is, was)| is - was)
        .collect();
    (displacements, update.mismatch.unwrap().face, scan)
}

/// The displacement of each free vertex is the mean of its neighbours', in any mesh.
fn check_mean(scan: TriMesh, size: RoiSize, at: Point3<f64>, least_free: usize) {
    let (displacements, handle, scan) = one_push(scan, size, at);
    let longest = displacements
        .iter()
        .map(|displacement| displacement.norm())
        .fold(0.0, f64::max);
    assert!(longest > 1e-7);
    let corners = scan.corners(handle);
    let mut free = 0;
    for vertex in region(&scan, handle, size)
        .into_iter()
        .filter(|vertex| !corners.contains(vertex))
    {
        let around = neighbours(&scan, vertex);
        let mean = around
            .iter()
            .map(|v| displacements[v.0 as usize])
            .sum::<Vector3<f64>>()
            / around.len() as f64;
        let off = (displacements[vertex.0 as usize] - mean).norm();
        assert!(
            off <= MEAN_TOL * longest,
            "{size:?} {vertex:?}: {:e} of the longest displacement",
            off / longest
        );
        free += 1;
    }
    assert!(free >= least_free, "{free} free");
}

#[test]
fn a_free_vertex_moves_by_the_mean_displacement_of_its_neighbours() {
    for size in [
        RoiSize::OneRing,
        RoiSize::Radius(4e-3),
        RoiSize::Radius(8e-3),
    ] {
        check_mean(
            bumpy(5),
            size,
            Point3::new(0.3e-3, 0.2e-3, RADIUS + 0.5e-3),
            5,
        );
    }
}

/// Here the region ends at the border of the scan.
#[test]
fn a_free_vertex_at_a_border_moves_by_the_mean_displacement_of_its_neighbours() {
    let half = 7.5 * EDGE;
    for size in [RoiSize::OneRing, RoiSize::Radius(4e-3)] {
        check_mean(
            bumpy(5),
            size,
            Point3::new(half - 0.9e-3, 0.2e-3, RADIUS + 0.5e-3),
            3,
        );
        check_mean(
            bumpy(5),
            size,
            Point3::new(half - 0.9e-3, half - 0.9e-3, RADIUS + 0.5e-3),
            1,
        );
    }
}

/// The handle goes as a rigid body along the measured normal: up, by a step that the tip's distance
/// sets.
#[test]
fn the_handle_rises_to_the_ball() {
    let above = 0.2e-3;
    let (displacements, handle, scan) = one_push(
        grid(15, EDGE, |_, _| 0.0),
        RoiSize::OneRing,
        Point3::new(0.3e-3, 0.2e-3, RADIUS + above),
    );
    let steps = scan.corners(handle).map(|v| displacements[v.0 as usize]);
    assert!(
        steps
            .iter()
            .all(|step| (step - steps[0]).norm() < 1e-15 && step.x == 0.0 && step.y == 0.0)
    );
    // dz/dt = α (F − f), f = k · (z − tip): towards tip + F/k at the rate α k = 25 per second, over
    // 1 ms
    let expected = (above + 2.0 / STIFFNESS) * -(-0.025f64).exp_m1();
    assert!(
        (steps[0].z - expected).abs() < 1e-12,
        "{} {expected}",
        steps[0].z
    );
}

/// Degenerate scans: a repeated face, three faces at an edge, a rim, a face without area, a lone
/// one.
#[test]
fn scans_that_are_no_surfaces_are_refined_all_the_same() {
    let sound = bumpy(6);
    let mut positions = sound.positions().to_vec();
    let mut faces: Vec<_> = sound
        .faces()
        .map(|(_, corners)| corners.map(|v| v.0))
        .collect();
    let middle = faces[faces.len() / 2 + 15];
    let at = positions.len() as u32;
    positions.push(positions[middle[0] as usize] + vector![0.0, 0.0, 2e-3]);
    positions.push(nalgebra::center(
        &positions[middle[0] as usize],
        &positions[middle[1] as usize],
    ));
    positions.push(positions[middle[2] as usize]);
    faces.extend([
        middle,
        [middle[0], middle[2], middle[1]],
        [middle[0], middle[1], at],
    ]);
    faces.extend([
        [middle[0], at + 1, middle[1]],
        [middle[2], at + 2, middle[0]],
    ]);
    faces.remove(faces.len() / 2 - 8);
    let scan = TriMesh::new(positions, faces).unwrap();
    for size in SIZES {
        for preset in [RefineParams::robust, RefineParams::paper] {
            let mut refiner = Refiner::new(
                scan.clone(),
                RefineParams {
                    roi: size,
                    ..preset(BALL)
                },
            )
            .unwrap();
            push_all(&mut refiner, &raster(20e-3, 9, 0.2, &BALL, |_| 2.0));
            assert!(
                refiner
                    .mesh()
                    .positions()
                    .iter()
                    .all(|p| p.coords.amax() < 0.1),
                "{size:?}"
            );
            assert!(refiner.counts().moved > 1000);
        }
    }
}
