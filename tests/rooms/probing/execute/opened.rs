//! An already touched hole is open in the mesh: its flag is on the surface around it, not on a wall
//! or floor of it.

use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use touchup::features::FeatureKind;
use touchup::live::{Engine, Gate, LiveError, Pace, Renewal};
use touchup::mesh::{FaceHit, FaceTree, TriMesh};
use touchup::probing::arm::{Arm, ArmState, Observer, StopRequest};
use touchup::probing::execute::{
    Ending, Flag, FlagResult, Plan, Prober, Progress, RobotCell, World, plan,
};
use touchup::scene::Scene;
use touchup::sim::{ArmParams, Plate, SimArm};
use touchup::stylus::{Sample, WrenchFrame};

use super::{cell, params};
use crate::plate_stream::plate_scan;
use crate::static_scan::StaticScan;

/// The mesh that follows the forces of the arm, as in the node; it makes the arm stay after some
/// states.
struct RefinedScan {
    engine: Engine,
    cell: RobotCell,
    stays_after: Option<usize>,
    seen: usize,
}

impl RefinedScan {
    fn new(scan: TriMesh) -> Self {
        let scene = Scene::from_yaml(include_str!("../../../../config/probe.yaml")).unwrap();
        let refine = scene.refine_params(WrenchFrame::Sensor).unwrap();
        let pace = Pace {
            is_patient: true,
            every_ns: 200_000_000,
            ..Pace::default()
        };
        let both = Arc::new((scan.clone(), FaceTree::new(&scan)));
        let renewal = Renewal::Beside {
            scan: both,
            pace,
            room: 1 << 16,
            gate: Gate::default(),
        };
        let engine = Engine::new(scan, refine, scene.patcher_params(), renewal).unwrap();
        Self {
            engine,
            cell: cell(),
            stays_after: None,
            seen: 0,
        }
    }
}

impl Observer for RefinedScan {
    fn on_state(&mut self, state: &ArmState) {
        self.seen += 1;
        let (pose, wrench) = state.as_probe(state.stamp_ns);
        let pose_ot = self.cell.pose_bo.inverse() * pose.pose_ot;
        let pushed = self.engine.push(&Sample {
            stamp_ns: state.stamp_ns,
            pose_ot,
            wrench: wrench.wrench,
        });
        assert!(
            matches!(pushed, Ok(_) | Err(LiveError::Refine(_))),
            "{:?}",
            pushed.err()
        );
    }

    fn stop_request(&self) -> Option<StopRequest> {
        self.stays_after
            .is_some_and(|stays_after| self.seen > stays_after)
            .then_some(StopRequest::Stay)
    }
}

impl World for RefinedScan {
    fn mesh(&self) -> &TriMesh {
        self.engine.refiner().mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.engine.refiner().closest_face(place, reach)
    }

    fn publish(&mut self, _: &Progress) {}
}

/// The through hole of the plate, Ø 8 mm at (16, 36) mm in its top at 12 mm, flagged at a height
/// (m).
fn hole(height: f64) -> Flag {
    Flag {
        id: 7,
        kind: Some(FeatureKind::Hole),
        place: Point3::new(16e-3, 36e-3, height),
        radius: 3e-3,
    }
}

fn arm(plate: &Plate) -> SimArm<'_> {
    let start = cell().pose(
        &UnitQuaternion::identity(),
        &Point3::new(40e-3, 25e-3, 50e-3),
    );
    SimArm::new(plate, ArmParams::default(), &start).unwrap()
}

fn diameter(probed: &FlagResult) -> Option<f64> {
    Some(
        probed
            .found
            .as_ref()?
            .feature
            .as_ref()?
            .diameter
            .as_ref()?
            .value,
    )
}

/// After 25 s in it the mesh has walls, and a floor out of the ball's reach; a tap into the hole
/// flags it there.
#[test]
fn a_hole_in_which_the_arm_was_stopped_is_probed_to_the_end_when_it_is_flagged_in_its_opening() {
    let (plate, cell, params) = (Plate::default(), cell(), params());
    let mut arm = arm(&plate);
    let mut world = RefinedScan {
        stays_after: Some(12_500),
        ..RefinedScan::new(plate_scan(1))
    };
    let mut prober = Prober::new(&mut arm, &cell, &params, &mut world);
    let stopped = prober.probe(&hole(12e-3));
    let way_out = prober.way_out;
    assert_eq!(stopped.ending, Ending::Cancelled(StopRequest::Stay));
    assert!(stopped.touches.len() > 4 && way_out.is_some());
    world.stays_after = None;
    let mut prober = Prober::new(&mut arm, &cell, &params, &mut world);
    prober.way_out = way_out;
    let probed = prober.probe(&hole(8e-3));
    assert_eq!(probed.ending, Ending::ToleranceReached);
    assert!(
        (diameter(&probed).unwrap() - 8e-3).abs() < 50e-6,
        "{:?}",
        diameter(&probed)
    );
    assert!(probed.touches.iter().all(|touch| touch.refused.is_none()));
}

fn planned(mesh: TriMesh, flag: &Flag) -> Plan {
    let plate = Plate::default();
    let now = arm(&plate).next_state().unwrap();
    plan(&cell(), &params(), &StaticScan::new(mesh), flag, &now, None).unwrap()
}

/// The drawing of the plate has its openings open: of the floors of slot and blind hole nothing of
/// the plan may depend.
#[test]
fn a_plan_for_what_is_open_begins_above_the_surface_around_it_wherever_the_flag_is() {
    // through hole, blind hole with its floor at 4 mm, slot with its floor at 7 mm
    let flags = [
        (FeatureKind::Hole, [16e-3, 36e-3]),
        (FeatureKind::Hole, [32e-3, 34e-3]),
        (FeatureKind::Slot, [25e-3, 14e-3]),
    ];
    for (kind, [x, y]) in flags {
        for z in [14e-3, 12e-3, 10e-3, 8e-3, 5e-3] {
            let flag = Flag {
                id: 1,
                kind: Some(kind),
                place: Point3::new(x, y, z),
                radius: 3e-3,
            };
            let planned = planned(Plate::default().mesh(1e-5).unwrap(), &flag);
            assert!(
                planned.held_back.is_empty(),
                "{kind:?} at {z}: {:?}",
                planned.held_back
            );
            // the first search begins with a ball of 1.5 mm 3 mm above the top at 12 mm
            let first = planned.touches[0];
            let off = first.from.z - 16.5e-3;
            assert!(
                off.abs() < 1.5e-3,
                "{kind:?} at {z}: the first search begins {} mm off",
                off * 1e3
            );
            assert!(first.direction.dot(&Vector3::z()) < -0.99);
        }
    }
}

/// A feature without an opening lies on the surface nearest to its flag: on top of the boss, 4 mm
/// above the plate around it, and at the edge of the step.
#[test]
fn flags_of_what_is_no_opening_are_on_what_is_nearest() {
    let mesh = || Plate::default().mesh(1e-5).unwrap();
    let flag = |kind, place: [f64; 3]| Flag {
        id: 1,
        kind: Some(kind),
        place: place.into(),
        radius: 3e-3,
    };
    for above in [-2e-3, 0.0, 2e-3] {
        let boss = planned(
            mesh(),
            &flag(FeatureKind::Boss, [47e-3, 25e-3, 16e-3 + above]),
        );
        assert!(
            (boss.touches[0].from.z - 20.5e-3).abs() < 1e-9,
            "{}",
            boss.touches[0].from
        );
        let plane = planned(
            mesh(),
            &flag(FeatureKind::Plane, [45e-3, 8e-3, 12e-3 + above]),
        );
        assert!(
            (plane.touches[0].from.z - 16.5e-3).abs() < 1e-9,
            "{}",
            plane.touches[0].from
        );
    }
}
