//! A stopped arm inside of a feature goes on from there after its recovery, back along its own
//! path.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use touchup::features::FeatureKind;
use touchup::probing::arm::{Arm, Command, StopRequest};
use touchup::probing::execute::{Ending, Flag, Prober, WayOut, plan};
use touchup::sim::{ArmParams, Plate, SimArm};

use super::{cell, params};
use crate::plate_stream::plate_scan;
use crate::static_scan::StaticScan;

/// The through hole of the plate, Ø 8 mm at (16, 36) mm in its top.
const HOLE: Flag = Flag {
    id: 7,
    kind: Some(FeatureKind::Hole),
    place: Point3::new(16e-3, 36e-3, 12e-3),
    radius: 3e-3,
};
const TOP: f64 = 12e-3;
/// Numbers of states after which the arm stops: some of them are inside of the hole.
const STOPS: [usize; 7] = [3000, 5000, 6011, 7222, 8433, 9644, 11055];

/// The plate and its scan; the arm stays after `stays_after` states.
fn stopping(stays_after: Option<usize>) -> StaticScan {
    StaticScan {
        stays_after,
        part: Some((Plate::default(), cell())),
        ..StaticScan::new(plate_scan(1))
    }
}

fn arm(plate: &Plate) -> SimArm<'_> {
    let start = cell().pose(
        &UnitQuaternion::identity(),
        &Point3::new(40e-3, 25e-3, 50e-3),
    );
    SimArm::new(plate, ArmParams::default(), &start).unwrap()
}

/// Probes until the arm stops after some states; returns the place of the ball and the way out of
/// there.
fn stopped(arm: &mut SimArm, stays_after: usize) -> (Point3<f64>, Option<WayOut>) {
    let (cell, params, mut world) = (cell(), params(), stopping(Some(stays_after)));
    let mut prober = Prober::new(arm, &cell, &params, &mut world);
    let probed = prober.probe(&HOLE);
    assert_eq!(
        probed.ending,
        Ending::Cancelled(StopRequest::Stay),
        "{stays_after}"
    );
    let way_out = prober.way_out;
    (arm.ball(), way_out)
}

/// Stopped inside of the hole.
fn stopped_inside(plate: &Plate) -> (SimArm<'_>, Point3<f64>, WayOut) {
    let inside = STOPS.into_iter().find_map(|stays_after| {
        let mut arm = arm(plate);
        let (place, way_out) = stopped(&mut arm, stays_after);
        is_inside(&place).then(|| (arm, place, way_out.expect("it came in by a way")))
    });
    inside.expect("one of the stops is in the hole")
}

fn is_inside(place: &Point3<f64>) -> bool {
    place.z < TOP + 1.5e-3
}

/// Probes on from there, to its end.
fn goes_on(arm: &mut SimArm, way_out: Option<WayOut>) -> (Ending, f64) {
    let (cell, params, mut world) = (cell(), params(), stopping(None));
    let mut prober = Prober::new(arm, &cell, &params, &mut world);
    prober.way_out = way_out;
    let probed = prober.probe(&HOLE);
    let found = probed
        .found
        .and_then(|found| found.feature)
        .and_then(|hole| hole.diameter);
    assert!(
        found
            .as_ref()
            .is_none_or(|diameter| (diameter.value - 8e-3).abs() < 50e-6),
        "{found:?}"
    );
    (probed.ending, world.nearest)
}

#[test]
fn wherever_in_a_hole_it_was_stopped_it_goes_out_by_its_way_and_probes_to_the_end() {
    let plate = Plate::default();
    let mut inside = 0;
    for stays_after in STOPS {
        let mut arm = arm(&plate);
        let (place, way_out) = stopped(&mut arm, stays_after);
        let is_inside = is_inside(&place);
        inside += usize::from(is_inside);
        assert!(
            way_out.is_some() || !is_inside,
            "{stays_after}: no way out of {place}"
        );
        if is_inside {
            // the scan has no hole there for the shaft, or no room for its margin
            let (refused, _) = goes_on(&mut arm, None);
            assert!(
                matches!(refused, Ending::NoClearPath(_)),
                "{stays_after}: {refused}"
            );
        }
        let now = arm.next_state().unwrap();
        let planned = plan(
            &cell(),
            &params(),
            &StaticScan::new(plate_scan(1)),
            &HOLE,
            &now,
            way_out.as_ref(),
        )
        .unwrap();
        assert!(
            planned.held_back.is_empty() && (planned.path[0] - place).norm() < 0.3e-3,
            "{:?}",
            planned.held_back
        );
        let (ending, nearest) = goes_on(&mut arm, way_out);
        assert_eq!(ending, Ending::ToleranceReached, "{stays_after}");
        // the ball presses into the part by no more than a touch does
        assert!(nearest > 1.5e-3 - 0.3e-3, "{stays_after}: {nearest} m");
    }
    assert!(inside >= 3, "stopped {inside} times inside of the hole");
}

#[test]
fn an_arm_that_was_moved_since_it_was_stopped_does_not_go_by_a_way_that_begins_elsewhere() {
    let plate = Plate::default();
    let (mut arm, place, way_out) = stopped_inside(&plate);
    // by hand, 1 mm up
    let to = cell().pose(&UnitQuaternion::identity(), &(place + Vector3::z() * 1e-3));
    for _ in 0..500 {
        arm.command(&Command::Line {
            to,
            speed: 5e-3,
            acceleration: 0.5,
        })
        .unwrap();
        arm.next_state().unwrap();
    }
    let (ending, _) = goes_on(&mut arm, Some(way_out));
    assert!(matches!(ending, Ending::NoClearPath(_)), "{ending}");
}

/// Stopped again on its way out, it goes on from there.
#[test]
fn a_way_out_that_is_broken_off_remains_from_where_it_was() {
    let plate = Plate::default();
    let (mut arm, place, way_out) = stopped_inside(&plate);
    let (cell, params, mut world) = (cell(), params(), stopping(Some(60)));
    let mut prober = Prober::new(&mut arm, &cell, &params, &mut world);
    prober.way_out = Some(way_out);
    let probed = prober.probe(&HOLE);
    assert_eq!(probed.ending, Ending::Cancelled(StopRequest::Stay));
    let way_out = prober.way_out;
    assert!(way_out.is_some());
    let on_the_way = arm.ball();
    assert!(on_the_way.z > place.z - 0.2e-3, "{on_the_way} from {place}");
    assert_eq!(goes_on(&mut arm, way_out).0, Ending::ToleranceReached);
}
