//! From a flag to a feature: paths that keep clear, limits that hold, and a true reason for every
//! ending.

use std::path::PathBuf;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::features::FeatureKind;
use touchup::io::mesh_file::{MeshFile, MeshUnit, read_mesh};
use touchup::mesh::{FaceHit, TriMesh};
use touchup::probing::arm::{
    Arm, ArmGeometry, ArmState, Limits, Observer, ProbeError, Safety, StopRequest, UrGeometry,
};
use touchup::probing::execute::{
    Ending, Flag, FlagResult, PlannedMotion, ProbeParams, Prober, Progress, RobotCell, Tool, World,
    plan,
};
use touchup::probing::plan::PatternParams;
use touchup::sim::{ArmFault, ArmParams, Plate, SimArm, Surface};

use super::{cell, params};
use crate::chains::seven_joints;
use crate::plate_stream::plate_scan;
use crate::static_scan::StaticScan;

const HOLE: Flag = Flag {
    id: 7,
    kind: Some(FeatureKind::Hole),
    place: Point3::new(17e-3, 35e-3, 12e-3),
    radius: 3e-3,
};

fn above(cell: &RobotCell, place: [f64; 3]) -> Isometry3<f64> {
    cell.pose(&UnitQuaternion::identity(), &place.into())
}

/// Probes the hole of the plate, after a change of the arm.
fn probed(
    params: &ProbeParams,
    world: &mut StaticScan,
    change: impl FnOnce(&mut SimArm),
) -> (FlagResult, f64, [f64; 3]) {
    let (plate, cell) = (Plate::default(), cell());
    let mut arm = SimArm::new(
        &plate,
        ArmParams::default(),
        &above(&cell, [40e-3, 25e-3, 50e-3]),
    )
    .unwrap();
    change(&mut arm);
    let probed = Prober::new(&mut arm, &cell, params, world).probe(&HOLE);
    arm.advance(0.5);
    (probed, arm.at_rest_since(), arm.ball().into())
}

/// The hole of the plate: Ø 8 mm at (16, 36).
#[test]
fn a_flag_becomes_a_feature() {
    let mut world = StaticScan::new(plate_scan(1));
    let (probed, _, end) = probed(&params(), &mut world, |_| {});
    assert_eq!(probed.ending, Ending::ToleranceReached);
    let hole = probed.found.as_ref().unwrap().feature.as_ref().unwrap();
    let off = hole.centre.value - Point3::new(16e-3, 36e-3, 12e-3);
    assert!(off.norm() < 50e-6, "{off}");
    assert!((hole.diameter.as_ref().unwrap().value - 8e-3).abs() < 50e-6);
    assert!(
        probed.touches.len() < 40 && probed.peak_force < 4.5,
        "{} {}",
        probed.touches.len(),
        probed.peak_force
    );
    // it has retracted: the ball is above the part
    assert!(end[2] > 14e-3, "{end:?}");
    // each before its motion, and the last again with its result
    let count = probed.touches.len();
    assert_eq!(
        world.touches,
        (1..=count).chain([count]).collect::<Vec<_>>()
    );
    assert_eq!(world.made, probed.touches);
    let records = probed
        .touches
        .iter()
        .filter_map(|touch| touch.record.as_ref());
    assert!(
        records
            .clone()
            .all(|record| record.stamps_ns[1] > record.stamps_ns[0])
    );
    assert!(
        probed
            .touches
            .iter()
            .any(|touch| touch.deviation.is_some_and(|deviation| deviation < -0.1e-3))
    );
}

/// The same with an arm that is no UR: the planner's ways, the joints of the states and the checks
/// are those of seven joints.
#[test]
fn a_flag_becomes_a_feature_with_seven_joints_as_with_a_ur() {
    let chain = seven_joints();
    let geometry = ArmGeometry::from(chain.clone());
    let cell = RobotCell {
        geometry: geometry.clone(),
        pose_bo: Isometry3::translation(0.45, -0.03, 0.15),
        ..cell()
    };
    let (lowest, highest) = (Point3::new(0.35, -0.2, 0.1), Point3::new(0.65, 0.2, 0.5));
    let params = ProbeParams {
        limits: Limits {
            lowest,
            highest,
            ..params().limits
        },
        ..params()
    };
    let simulated = ArmParams {
        geometry,
        pose_bo: cell.pose_bo,
        ..ArmParams::default()
    };
    let plate = Plate::default();
    let mut arm = SimArm::new(&plate, simulated, &above(&cell, [40e-3, 25e-3, 50e-3])).unwrap();
    let probed = Prober::new(
        &mut arm,
        &cell,
        &params,
        &mut StaticScan::new(plate_scan(1)),
    )
    .probe(&HOLE);
    assert_eq!(probed.ending, Ending::ToleranceReached);
    let hole = probed.found.as_ref().unwrap().feature.as_ref().unwrap();
    let off = hole.centre.value - Point3::new(16e-3, 36e-3, 12e-3);
    let diameter = hole.diameter.as_ref().unwrap().value - 8e-3;
    println!(
        "centre {:.1} µm off, diameter {:.1} µm",
        off.norm() * 1e6,
        diameter * 1e6
    );
    assert!(
        off.norm() < 50e-6 && diameter.abs() < 50e-6,
        "{off} {diameter}"
    );
    let state = arm.next_state().unwrap();
    assert_eq!(state.joints.len(), 7);
    let reported = cell.geometry.flange(&state.joints) * cell.pose_ft;
    // 10 µm of noise in each axis
    assert!((reported.translation.vector - state.pose_bt.translation.vector).norm() < 60e-6);
    for (joint, angle) in chain.joints().iter().zip(state.joints.iter()) {
        assert!(
            joint
                .range
                .is_some_and(|[low, high]| (low..=high).contains(angle)),
            "{}: {angle}",
            joint.name
        );
    }
}

#[test]
fn exhausted_limits_are_reported() {
    let of = |params: ProbeParams| probed(&params, &mut StaticScan::new(plate_scan(1)), |_| {}).0;
    let few = PatternParams {
        budget: 13,
        sigma: 1e-9,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    let spent = of(ProbeParams {
        pattern: few,
        ..params()
    });
    assert_eq!(
        (spent.ending, spent.touches.len()),
        (Ending::TouchesSpent, 13)
    );
    assert!(spent.found.is_some(), "it is as good as they made it");
    let late = of(ProbeParams {
        limits: Limits {
            time: 10.0,
            ..params().limits
        },
        ..params()
    });
    assert_eq!(late.ending, Ending::TimeSpent);
    assert!(
        late.seconds > 10.0 && late.seconds < 16.0,
        "{}",
        late.seconds
    );
}

#[test]
fn a_cancelled_probing_stops_and_retracts() {
    let mut world = StaticScan {
        patience: Some(6000),
        ..StaticScan::new(plate_scan(1))
    };
    let (probed, _, end) = probed(&params(), &mut world, |_| {});
    assert_eq!(probed.ending, Ending::Cancelled(StopRequest::Retract));
    assert!(!probed.touches.is_empty());
    assert_eq!(world.made, probed.touches);
    assert!(end[2] > 14e-3, "{end:?}");
}

/// At any place of its cancellation, the retreat does not lead deeper: from 50 mm/s a stop takes
/// 2.5 mm.
#[test]
fn a_cancelled_probing_goes_no_deeper() {
    // every segment of its path, also between the places of the retreat
    for patience in (1..16)
        .map(|times| 700 * times)
        .chain((0..8).map(|times| 3000 + 211 * times))
    {
        let mut world = StaticScan {
            patience: Some(patience),
            ..StaticScan::new(plate_scan(1))
        };
        let (probed, _, end) = probed(&params(), &mut world, |_| {});
        assert_eq!(
            probed.ending,
            Ending::Cancelled(StopRequest::Retract),
            "{patience}"
        );
        let [first, least] = world.since_then.unwrap();
        assert!(
            first - least < 2.7e-3,
            "{patience}: {:.1} mm deeper",
            (first - least) * 1e3
        );
        assert!(end[2] > 14e-3, "{patience}: {end:?}");
    }
}

/// From 50 mm/s a stop takes 0.1 s, and it stops a retraction as everything else.
#[test]
fn a_probing_that_is_to_stay_stands_where_it_is() {
    for (patience, stays_after) in [
        (None, 900),
        (None, 6000),
        (Some(6000), 6001),
        (Some(6000), 6020),
        (Some(900), 950),
    ] {
        let mut world = StaticScan {
            patience,
            stays_after: Some(stays_after),
            ..StaticScan::new(plate_scan(1))
        };
        let (probed, at_rest_since, _) = probed(&params(), &mut world, |_| {});
        assert_eq!(
            probed.ending,
            Ending::Cancelled(StopRequest::Stay),
            "{patience:?}, {stays_after}"
        );
        let stood = at_rest_since - world.stayed_ns as f64 * 1e-9;
        assert!(stood < 0.13, "{patience:?}, {stays_after}: after {stood} s");
    }
}

/// A probe inside the part would have its force zeroed.
#[test]
fn nothing_is_zeroed_where_the_probe_is_at_the_mesh() {
    let (plate, cell, params) = (Plate::default(), cell(), params());
    let mut world = StaticScan::new(plate.mesh(1e-5).unwrap());
    let start = above(&cell, [45e-3, 8e-3, 12e-3 + 1.6e-3]);
    let mut arm = SimArm::new(&plate, ArmParams::default(), &start).unwrap();
    // pressed onto the top, as after a stop
    let press = touchup::probing::arm::Command::Line {
        to: above(&cell, [45e-3, 8e-3, 13.4e-3]),
        speed: 5e-3,
        acceleration: 0.5,
    };
    for _ in 0..200 {
        arm.command(&press).unwrap();
        arm.next_state().unwrap();
    }
    let before = arm.time();
    let probed = Prober::new(&mut arm, &cell, &params, &mut world).probe(&HOLE);
    assert!(
        matches!(probed.ending, Ending::NoClearPath(_)),
        "{}",
        probed.ending
    );
    assert!(
        probed.ending.to_string().contains("free air"),
        "{}",
        probed.ending
    );
    assert!(arm.time() - before < 0.01, "it zeroes for longer");
}

#[test]
fn what_is_out_of_reach_is_refused_before_anything_moves() {
    let mut tight = params();
    tight.limits.lowest.z = 0.07;
    let mut world = StaticScan::new(plate_scan(1));
    let (probed, stood, _) = probed(&tight, &mut world, |_| {});
    assert!(
        matches!(probed.ending, Ending::OutOfLimits(_)),
        "{}",
        probed.ending
    );
    assert!(stood.abs() < 1e-9, "it moved until {stood} s");
}

#[test]
fn a_stop_of_the_arm_ends_it_with_what_was_measured() {
    let mut world = StaticScan::new(plate_scan(1));
    let (probed, stood, _) = probed(&params(), &mut world, |arm| {
        arm.fail_at(20.0, ArmFault::ProtectiveStop)
    });
    let Ending::Stopped(ProbeError::Arm { error, .. }) = &probed.ending else {
        panic!("{}", probed.ending)
    };
    assert_eq!(
        *error,
        touchup::probing::arm::ArmError::Stopped {
            safety: Safety::ProtectiveStop
        }
    );
    assert!(stood - 20.0 < 0.2, "{stood}");
    assert!(!probed.touches.is_empty());
}

/// The stop of a touch belongs to it: its force, and the time until then.
#[test]
fn a_stop_keeps_the_force_and_the_time_of_the_touch_that_it_ended() {
    let hit = |arm: &mut SimArm| arm.fail_at(20.0, ArmFault::ForceSpike(40.0));
    let (spiked, ..) = probed(&params(), &mut StaticScan::new(plate_scan(1)), hit);
    assert!(
        matches!(spiked.ending, Ending::Stopped(ProbeError::Limit { .. })),
        "{}",
        spiked.ending
    );
    assert!(
        (spiked.peak_force - 40.0).abs() < 5.0,
        "{}",
        spiked.peak_force
    );
    let lose = |arm: &mut SimArm| arm.fail_at(20.0, ArmFault::LinkLost);
    let (lost, ..) = probed(&params(), &mut StaticScan::new(plate_scan(1)), lose);
    // zeroing took 64 readings before it began
    assert!((lost.seconds - 20.0).abs() < 0.3, "{}", lost.seconds);
}

/// The scan lies 0.3 mm below the part, and follows the first touch, which measures the offset.
#[test]
fn the_deviation_of_a_touch_is_from_the_mesh_before_it() {
    let (plate, cell) = (Plate::default(), cell());
    let right = plate.mesh(1e-5).unwrap();
    let corners: Vec<_> = right
        .faces()
        .map(|(_, corners)| corners.map(|corner| corner.0))
        .collect();
    let low = right
        .positions()
        .iter()
        .map(|p| p - Vector3::z() * 0.3e-3)
        .collect();
    let mut world = StaticScan {
        after: Some(right),
        ..StaticScan::new(TriMesh::new(low, corners).unwrap())
    };
    let mut arm = SimArm::new(
        &plate,
        ArmParams::default(),
        &above(&cell, [45e-3, 9e-3, 50e-3]),
    )
    .unwrap();
    let flag = Flag {
        id: 1,
        kind: Some(FeatureKind::Plane),
        place: Point3::new(45e-3, 9e-3, 12e-3),
        radius: 3e-3,
    };
    let params = ProbeParams {
        pattern: PatternParams {
            budget: 4,
            ..params().pattern
        },
        ..params()
    };
    let probed = Prober::new(&mut arm, &cell, &params, &mut world).probe(&flag);
    let deviations: Vec<f64> = probed
        .touches
        .iter()
        .map(|touch| touch.deviation.unwrap())
        .collect();
    assert!((deviations[0] - 0.3e-3).abs() < 30e-6, "{deviations:?}");
    assert!(
        deviations[1..]
            .iter()
            .all(|deviation| deviation.abs() < 30e-6),
        "{deviations:?}"
    );
}

/// Records the turning speed of a probe, and the least distance of its shaft from the true part.
struct Turning {
    scan: StaticScan,
    plate: Plate,
    cell: RobotCell,
    before: Option<UnitQuaternion<f64>>,
    fastest: f64,
    nearest: f64,
}

impl Observer for Turning {
    fn on_state(&mut self, state: &ArmState) {
        let rotation = state.pose_bt.rotation;
        let turned = self
            .before
            .replace(rotation)
            .map_or(0.0, |before| before.angle_to(&rotation));
        self.fastest = self.fastest.max(turned / 2e-3);
        let (ball, shaft) = (self.cell.place(&state.pose_bt), self.cell.shaft(&rotation));
        let along = (3..60).map(|mm| {
            self.plate
                .signed_distance(&(ball + shaft.into_inner() * (f64::from(mm) * 1e-3)))
        });
        self.nearest = along.fold(self.nearest, f64::min);
        self.scan.on_state(state);
    }
}

impl World for Turning {
    fn mesh(&self) -> &TriMesh {
        self.scan.mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.scan.closest_face(place, reach)
    }

    fn publish(&mut self, progress: &Progress) {
        self.scan.publish(progress);
    }
}

/// A probe that leans by 50° low over the part turns upright: its shaft stays clear of the part by
/// its closed form, and no state turns faster than the arm can.
#[test]
fn a_leaning_probe_is_turned_slowly_and_clear_of_the_part() {
    let (plate, cell) = (Plate::default(), cell());
    let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.87);
    let start = cell.pose(&lean, &Point3::new(30e-3, 25e-3, 16e-3));
    let mut arm = SimArm::new(&plate, ArmParams::default(), &start).unwrap();
    let mut world = Turning {
        scan: StaticScan::new(plate_scan(1)),
        plate: plate.clone(),
        cell: cell.clone(),
        before: None,
        fastest: 0.0,
        nearest: f64::INFINITY,
    };
    let probed = Prober::new(&mut arm, &cell, &params(), &mut world).probe(&HOLE);
    assert_eq!(probed.ending, Ending::ToleranceReached, "{}", probed.ending);
    assert!(
        world.fastest < 1.01 * ArmParams::default().top_turn_speed,
        "{} rad/s",
        world.fastest
    );
    assert!(
        world.fastest > 0.0 && world.nearest > cell.tool.shaft_radius,
        "{}",
        world.nearest
    );
}

#[test]
fn a_dry_run_moves_nothing() {
    let (plate, cell) = (Plate::default(), cell());
    let start = above(&cell, [40e-3, 25e-3, 50e-3]);
    let mut arm = SimArm::new(&plate, ArmParams::default(), &start).unwrap();
    let now = arm.next_state().unwrap();
    let world = StaticScan::new(plate_scan(1));
    let planned = plan(&cell, &params(), &world, &HOLE, &now, None).unwrap();
    assert!(
        !planned.touches.is_empty() && planned.held_back.is_empty(),
        "{:?}",
        planned.held_back
    );
    assert_eq!(arm.at_rest_since(), 0.0);
}

/// Distance of a point from a triangle, by its corners, edges and inside one after the other.
fn distance_to_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let to_segment = |a: &Point3<f64>, b: &Point3<f64>| {
        let along = b - a;
        let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - (a + along * t)).norm()
    };
    let edges = to_segment(a, b).min(to_segment(b, c)).min(to_segment(c, a));
    let normal = (b - a).cross(&(c - a));
    let side = |from: &Point3<f64>, to: &Point3<f64>| (to - from).cross(&(p - from)).dot(&normal);
    let is_over = side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0;
    if is_over {
        edges.min((p - a).dot(&normal).abs() / normal.norm())
    } else {
        edges
    }
}

fn parts() -> Option<Vec<PathBuf>> {
    let listed = std::fs::read_dir(crate::shared::shared("parts/permissive")?).unwrap();
    let is_mesh = |path: &PathBuf| {
        path.extension().is_some_and(|e| {
            ["stl", "ply", "obj"]
                .iter()
                .any(|known| e.eq_ignore_ascii_case(known))
        })
    };
    let mut parts: Vec<_> = listed
        .map(|entry| entry.unwrap().path())
        .filter(is_mesh)
        .collect();
    parts.sort();
    Some(parts)
}

/// The part in the size of a hand, in any unit.
fn in_reach(mesh: &TriMesh) -> TriMesh {
    let [low, high] = mesh.bounds();
    let scale = 0.12 / (high - low).norm();
    let kept: Vec<_> = mesh
        .faces()
        .map(|(_, corners)| corners.map(|corner| corner.0))
        .collect();
    TriMesh::new(mesh.positions().iter().map(|p| p * scale).collect(), kept).unwrap()
}

/// All triangles of a mesh, each in a ball, so that the search skips most.
struct Triangles(Vec<([Point3<f64>; 3], Point3<f64>, f64)>);

impl Triangles {
    fn new(mesh: &TriMesh) -> Self {
        let ball = |corners: [Point3<f64>; 3]| {
            let middle =
                Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
            (
                corners,
                middle,
                corners
                    .iter()
                    .map(|p| (p - middle).norm())
                    .fold(0.0, f64::max),
            )
        };
        Self(
            mesh.faces()
                .map(|(face, _)| ball(mesh.triangle(face)))
                .collect(),
        )
    }

    /// Distance of a place, up to `reach`, m.
    fn distance(&self, p: &Point3<f64>, reach: f64) -> f64 {
        self.0
            .iter()
            .fold(reach, |nearest, (corners, middle, radius)| {
                let is_far = (p - middle).norm_squared() >= (nearest + radius).powi(2);
                if is_far {
                    nearest
                } else {
                    nearest.min(distance_to_triangle(p, corners))
                }
            })
    }
}

/// Counts of the moves of all plans.
#[derive(Clone, Copy, Debug, Default)]
struct Moves {
    parts: usize,
    plans: usize,
    touches: usize,
    links: usize,
    /// with an upright shaft, which the test can check
    upright: usize,
    /// that pass within two millimetres of the surfaces to avoid
    close: usize,
    /// that go around an obstacle on the straight path from the last place in free air
    around: usize,
}

/// Ball and shaft keep their radii and the margin all along a move; `shaft`: its direction, if
/// known.
fn check_move(
    triangles: &Triangles,
    tool: &Tool,
    [from, to]: [Point3<f64>; 2],
    shaft: Option<Vector3<f64>>,
    step: f64,
) -> f64 {
    let steps = ((to - from).norm() / step).ceil().max(1.0) as usize;
    let mut least = f64::INFINITY;
    for at in (0..=steps).map(|at| from + (to - from) * (at as f64 / steps as f64)) {
        let ball = triangles.distance(&at, 10e-3) - tool.ball_radius - tool.margin;
        assert!(
            ball >= -1e-9,
            "the ball comes nearer by {:.3} mm at {at}",
            -ball * 1e3
        );
        least = least.min(ball);
        let along = (1..=12).map(|part| f64::from(part) / 12.0 * tool.shaft_length);
        for place in shaft
            .iter()
            .flat_map(|shaft| along.clone().map(move |length| at + shaft * length))
        {
            let room = triangles.distance(&place, 10e-3) - tool.shaft_radius - tool.margin;
            assert!(
                room >= -1e-9,
                "the shaft comes nearer by {:.3} mm at {place}",
                -room * 1e3
            );
        }
    }
    least
}

/// For any part: no plan leaves the box, and no move through free air brings ball or shaft nearer
/// to the mesh than their radii and the margin. Distances come from another method than the tree's:
/// all triangles, one after the other.
#[test]
#[expect(clippy::too_many_lines)]
fn no_plan_leaves_the_limits_or_passes_through_the_mesh() {
    let is_full = crate::full::is_full();
    let mut rng = Pcg64::seed_from_u64(3);
    let mut moves = Moves::default();
    let Some(parts) = parts() else { return };
    for path in parts {
        // in any unit
        let units = [MeshUnit::Millimetre, MeshUnit::Metre, MeshUnit::Inch];
        let read = units.iter().find_map(|unit| read_mesh(&path, *unit).ok());
        let MeshFile { mesh, .. } =
            read.unwrap_or_else(|| panic!("{} cannot be read", path.display()));
        let mesh = in_reach(&mesh);
        // all triangles for every place: large ones are for the slow proof
        if mesh.face_count() > if is_full { 200_000 } else { 20_000 } {
            continue;
        }
        moves.parts += 1;
        let [low, high] = mesh.bounds();
        // wherever the part is, in the middle of the arm's workspace
        let middle = nalgebra::center(&low, &high);
        let base = Point3::new(-0.4, -0.1, 0.1);
        let pose_bo = Isometry3::translation(base.x - middle.x, base.y - middle.y, base.z - low.z);
        let cell = RobotCell {
            pose_bo,
            geometry: UrGeometry::UR10E.into(),
            ..cell()
        };
        let params = ProbeParams {
            pattern: PatternParams {
                budget: 12,
                ..params().pattern
            },
            ..params()
        };
        let start = above(&cell, [middle.x, middle.y, high.z + 60e-3]);
        let faces: Vec<_> = mesh.faces().map(|(face, _)| mesh.triangle(face)).collect();
        let (triangles, world) = (Triangles::new(&mesh), StaticScan::new(mesh.clone()));
        let flange = start * cell.pose_ft.inverse();
        let joints = cell.geometry.most_dexterous(&flange).unwrap();
        let now = ArmState {
            stamp_ns: 0,
            pose_bt: start,
            wrench_b: touchup::stylus::Wrench::default(),
            raw_wrench_f: touchup::stylus::Wrench::default(),
            joints,
            safety: Safety::Normal,
        };
        for kind in [
            Some(FeatureKind::Hole),
            Some(FeatureKind::Edge),
            Some(FeatureKind::Plane),
            None,
        ] {
            let [a, b, c] = faces[rng.random_range(0..faces.len())];
            let place = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let flag = Flag {
                id: 1,
                kind,
                place,
                radius: 4e-3,
            };
            let planned = plan(&cell, &params, &world, &flag, &now, None).unwrap();
            moves.plans += 1;
            for (number, planned_touch) in planned.touches.iter().enumerate() {
                if planned
                    .held_back
                    .iter()
                    .any(|one| one.what == PlannedMotion::Touch(number))
                {
                    continue;
                }
                moves.touches += 1;
                for place in [
                    planned_touch.entry,
                    planned_touch.from,
                    planned_touch.from
                        + planned_touch.direction.into_inner() * planned_touch.search,
                ] {
                    let p = cell.pose_bo * place;
                    let is_in = (0..3).all(|i| {
                        p[i] >= params.limits.lowest[i] - 1e-9
                            && p[i] <= params.limits.highest[i] + 1e-9
                    });
                    assert!(is_in, "{}: {kind:?} at {p}", path.display());
                }
            }
            // a turn is a move that goes nowhere; without one the shaft stays along z
            let has_turned = planned.links.iter().any(|[from, to]| from == to);
            let shaft = (!has_turned).then(Vector3::z);
            for pair in &planned.links {
                moves.links += 1;
                moves.upright += usize::from(!has_turned);
                let step = if is_full { 0.25e-3 } else { 1e-3 };
                moves.close +=
                    usize::from(check_move(&triangles, &cell.tool, *pair, shaft, step) < 2e-3);
            }
            // up, over, and down again
            moves.around += planned
                .links
                .windows(3)
                .filter(|path| {
                    let [from, to] = [path[0][0], path[2][1]];
                    let mut straight =
                        (0..=100).map(|at| from + (to - from) * (f64::from(at) / 100.0));
                    straight.any(|p| triangles.distance(&p, 10e-3) < cell.tool.ball_radius)
                })
                .count();
        }
    }
    println!("{moves:?}");
    let Moves {
        parts,
        plans,
        touches,
        links,
        upright,
        close,
        around,
    } = moves;
    assert!(
        parts >= 5 && plans == 4 * parts && touches >= 40 && links >= 40,
        "{moves:?}"
    );
    assert!(upright >= 20 && close >= 20 && around >= 10, "{moves:?}");
}

/// The shaft is along the normal, when it leans.
#[test]
fn the_shaft_is_turned_to_the_surface_and_left_where_it_is_near() {
    let cell = cell();
    let now = UnitQuaternion::identity();
    let near = Unit::new_normalize(Vector3::new(0.1, 0.0, 1.0));
    assert_eq!(cell.upright(&now, &near), now);
    let far = Unit::new_normalize(Vector3::new(1.0, 0.5, 1.0));
    let turned = cell.shaft(&cell.upright(&now, &far));
    assert!((turned.into_inner() - far.into_inner()).norm() < 1e-12);
}
