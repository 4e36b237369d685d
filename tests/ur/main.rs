//! The real ur-rtde client against a stand-in for the controller: the library, the child process,
//! the wire and the arm behind it.
//!
//! The record of the stand-in shows whether the arm is at rest, by its own clock. That waits for
//! the client, and so do the deadlines of client and guard: the load of this machine changes
//! nothing. Tests of the guard and of the driver (`src/ur`) check the time of detection, on clocks
//! that they move by hand.

mod faults;
mod motion;
mod payload_identification;
mod probing;
mod refusals;
#[path = "../common/shared.rs"]
#[expect(dead_code, reason = "no arm is tested on shared data")]
mod shared;
mod stand_in;

use std::path::Path;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use stand_in::{StandIn, limits, packages};
use touchup::probing::arm::{
    OnsetVerdict, ProbeError, StopRequest, SupervisedArm, TouchOutcome, TouchParams, TouchRecord,
    TouchTarget,
};
use touchup::sim::ArmParams;
use touchup::ur::UrArm;

/// From an order to the arm that follows it, and from a stop to the last of the motion, s: some
/// periods of the controller.
const LATENCY: f64 = 20e-3;
/// Top of the plate, m in O.
const TOP: f64 = 12e-3;
/// A place with nothing but the flat top below, m in O.
const PLACE: [f64; 2] = [45e-3, 8e-3];

/// The tip upright at a place of O, in B; O is the frame of the stand-in's part.
fn at(place: [f64; 3]) -> Isometry3<f64> {
    let place = ArmParams::default().pose_bo * Point3::from(place);
    Isometry3::from_parts(place.coords.into(), UnitQuaternion::identity())
}

/// Looks on, and may want it to end.
struct Onlooker<S: FnMut(&touchup::probing::arm::ArmState), C: Fn() -> Option<StopRequest>> {
    seen: S,
    stop_request: C,
}

impl<S, C> touchup::probing::arm::Observer for Onlooker<S, C>
where
    S: FnMut(&touchup::probing::arm::ArmState),
    C: Fn() -> Option<StopRequest>,
{
    fn on_state(&mut self, state: &touchup::probing::arm::ArmState) {
        (self.seen)(state);
    }

    fn stop_request(&self) -> Option<StopRequest> {
        (self.stop_request)()
    }
}

fn above(height: f64) -> TouchTarget {
    let [x, y] = PLACE;
    TouchTarget {
        standoff_bt: at([x, y, TOP + height]),
        direction: -Vector3::z_axis(),
        search: 8e-3,
        expected: None,
    }
}

/// Runs with ur-rtde, or reports this test as skipped.
fn with_library(body: impl FnOnce(&Path) -> Result<(), ProbeError>) {
    match packages() {
        Ok(packages) => body(packages).unwrap(),
        Err(reason) => shared::skip(&format!("no ur-rtde: {reason}")),
    }
}

fn touched(arm: &mut UrArm, target: &TouchTarget) -> Result<TouchRecord, ProbeError> {
    let mut onlooker = Onlooker {
        seen: |_: &_| {},
        stop_request: || None,
    };
    let mut watched = SupervisedArm::new(arm, limits(), &mut onlooker);
    watched.zero()?;
    watched.touch(target, &TouchParams::default())
}

#[test]
fn a_touch_finds_the_surface() {
    with_library(|packages| {
        let stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        let record = touched(&mut arm, &above(5e-3))?;
        let TouchOutcome::Contact {
            onset,
            centre,
            force_b,
        } = &record.outcome
        else {
            panic!("{:?}", record.outcome)
        };
        let found = ArmParams::default().pose_bo.inverse_transform_point(centre);
        let error = found.z - (TOP + ArmParams::default().radius);
        println!(
            "{:.1} um off, {:.1} N at most, {onset:?}",
            error * 1e6,
            record.peak_force
        );
        assert_eq!(onset.verdict, OnsetVerdict::Clean, "{onset:?}");
        assert!(error.abs() < 25e-6, "{error}");
        assert!(
            force_b.normalize().z > 0.95,
            "the part pushes back: {force_b}"
        );
        assert!(
            record.peak_force < 2.0 * TouchParams::default().force,
            "{}",
            record.peak_force
        );
        Ok(())
    });
}

#[test]
fn where_nothing_is_that_is_the_answer() {
    with_library(|packages| {
        let stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        let record = touched(&mut arm, &above(13e-3))?;
        let TouchOutcome::Miss { travel } = record.outcome else {
            panic!("{:?}", record.outcome)
        };
        assert!((travel - 8e-3).abs() < 0.3e-3, "{travel}");
        Ok(())
    });
}

/// A surface nearer than in the mesh.
#[test]
fn an_obstacle_stops_it() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        stand_in.send("mark begin");
        let error = touched(&mut arm, &above(-3e-3)).err().unwrap();
        stand_in.send("mark commanded");
        let ProbeError::Obstacle {
            place_mm, force_n, ..
        } = error
        else {
            panic!("{error}")
        };
        let expected = ArmParams::default().pose_bo
            * Point3::new(0.0, 0.0, TOP + ArmParams::default().radius)
            * 1e3;
        assert!(
            (place_mm[2] - expected.z).abs() < 0.5 && force_n > 1.0,
            "{place_mm:?}, {force_n} N"
        );
        let record = stand_in.record_between("mark begin", "mark commanded");
        assert!(
            record.iter().any(|line| line.force > 1.0),
            "the part was touched"
        );
        assert!(
            record.iter().all(|line| line.force < limits().force),
            "the part is not pressed by more than the limit"
        );
        // from the stop command, as slow as it searches
        stand_in.stands_in(
            "stop requested",
            TouchParams::default().search_speed / limits().acceleration + LATENCY,
        );
        Ok(())
    });
}
