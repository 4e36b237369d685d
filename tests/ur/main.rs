//! The real ur-rtde client against a stand-in for the controller: the library, the child process, the wire and the arm behind it.
//!
//! Whether the arm stands is read in the record of the stand-in, by its own clock.

mod faults;
mod lateness;
mod motion;
mod probing;
mod refusals;
mod stand_in;
mod weighing;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use lateness::Lateness;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use stand_in::{StandIn, limits, packages};
use touchup::robot::ur::UrArm;
use touchup::robot::{ProbeError, TouchOutcome, TouchParams, TouchRecord, TouchTarget, Verdict, Watched};
use touchup::sim::ArmParams;

/// Of a test on a machine that is busy.
const TRIES: usize = 3;
/// Five periods of the arm.
const TOO_LATE: Duration = Duration::from_millis(10);
/// Top of the plate, m in O.
const TOP: f64 = 12e-3;
/// A place with nothing but the flat top below, m in O.
const PLACE: [f64; 2] = [45e-3, 8e-3];

/// The tip upright at a place of O, in B; where the part of the stand-in lies, and its ball.
fn at(place: [f64; 3]) -> Isometry3<f64> {
    let place = ArmParams::default().pose_bo * Point3::from(place);
    Isometry3::from_parts(place.coords.into(), UnitQuaternion::identity())
}

/// Looks on, and may want it to end.
struct Onlooker<S: FnMut(&touchup::robot::ArmState), C: Fn() -> bool> {
    seen: S,
    is_cancelled: C,
}

impl<S: FnMut(&touchup::robot::ArmState), C: Fn() -> bool> touchup::robot::Witness for Onlooker<S, C> {
    fn see(&mut self, state: &touchup::robot::ArmState) {
        (self.seen)(state);
    }

    fn is_cancelled(&self) -> bool {
        (self.is_cancelled)()
    }
}

fn above(height: f64) -> TouchTarget {
    let [x, y] = PLACE;
    TouchTarget { standoff_bt: at([x, y, TOP + height]), direction: -Vector3::z_axis(), search: 8e-3, expected: None }
}

/// A machine that is busy otherwise lets the states come late now and then, which ends a motion, as it should; and an arm that
/// stands in time is none where nobody runs in time. What fails while this machine was late says nothing: it is tried again.
fn patiently(test: &str, body: impl Fn(&Path) -> Result<(), ProbeError>) {
    let Some(packages) = packages(test) else { return };
    // one arm at a time: they would make each other late
    static ARM: Mutex<()> = Mutex::new(());
    let _arm = ARM.lock().unwrap_or_else(PoisonError::into_inner);
    for left in (0..TRIES).rev() {
        let lateness = Lateness::watch();
        let ended = catch_unwind(AssertUnwindSafe(|| body(&packages)));
        let late = lateness.end();
        match ended {
            Ok(Ok(())) => return,
            Ok(Err(ProbeError::LowRate { gap_ms, .. })) if left > 0 => {
                println!("{test}: states came {gap_ms:.0} ms apart: again");
            }
            _ if left > 0 && late > TOO_LATE => {
                println!("{test}: this machine was {} ms late: again", late.as_millis())
            }
            Ok(Err(error)) => panic!("{error}, and this machine was {} ms late", late.as_millis()),
            Err(failure) => resume_unwind(failure),
        }
    }
}

/// What ended a motion, where something should; not that this machine was late.
fn error_of<T>(ended: Result<T, ProbeError>) -> Result<ProbeError, ProbeError> {
    match ended.err().unwrap() {
        late @ ProbeError::LowRate { .. } => Err(late),
        error => Ok(error),
    }
}

fn touched(arm: &mut UrArm, target: &TouchTarget) -> Result<TouchRecord, ProbeError> {
    let mut onlooker = Onlooker { seen: |_: &_| {}, is_cancelled: || false };
    let mut watched = Watched::new(arm, limits(), &mut onlooker);
    watched.zero()?;
    watched.touch(target, &TouchParams::default())
}

#[test]
fn a_touch_finds_the_surface() {
    patiently("a_touch_finds_the_surface", |packages| {
        let stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        let record = touched(&mut arm, &above(5e-3))?;
        let TouchOutcome::Contact { onset, centre, force_b } = &record.outcome else { panic!("{:?}", record.outcome) };
        let found = ArmParams::default().pose_bo.inverse_transform_point(centre);
        let error = found.z - (TOP + ArmParams::default().radius);
        println!("{:.1} um off, {:.1} N at most, {onset:?}", error * 1e6, record.peak_force);
        assert_eq!(onset.verdict, Verdict::Clean, "{onset:?}");
        assert!(error.abs() < 25e-6, "{error}");
        assert!(force_b.normalize().z > 0.95, "the part pushes back: {force_b}");
        assert!(record.peak_force < 2.0 * TouchParams::default().force, "{}", record.peak_force);
        Ok(())
    });
}

#[test]
fn where_nothing_is_that_is_the_answer() {
    patiently("where_nothing_is_that_is_the_answer", |packages| {
        let stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        let record = touched(&mut arm, &above(13e-3))?;
        let TouchOutcome::Miss { travel } = record.outcome else { panic!("{:?}", record.outcome) };
        assert!((travel - 8e-3).abs() < 0.3e-3, "{travel}");
        Ok(())
    });
}

/// A surface that comes earlier than the mesh says.
#[test]
fn what_is_in_the_way_stops_it() {
    patiently("what_is_in_the_way_stops_it", |packages| {
        let mut stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        stand_in.tell("mark begin");
        let error = error_of(touched(&mut arm, &above(-3e-3)))?;
        stand_in.tell("mark told");
        let ProbeError::InTheWay { place_mm, force_n, .. } = error else { panic!("{error}") };
        let expected = ArmParams::default().pose_bo * Point3::new(0.0, 0.0, TOP + ArmParams::default().radius) * 1e3;
        assert!((place_mm[2] - expected.z).abs() < 0.5 && force_n > 1.0, "{place_mm:?}, {force_n} N");
        let record = stand_in.record_after("mark begin", 1.5);
        assert!(
            record.iter().all(|line| line.force < limits().force),
            "the part is not pressed by more than the limit"
        );
        let record = stand_in.record_after("mark told", 0.4);
        let stood = record.iter().rev().find(|line| line.speed > 0.0).map_or(0.0, |line| line.time - record[0].time);
        assert!(stood < 0.2, "{stood}");
        Ok(())
    });
}
