//! The ball slides over a touched region with constant force: on a plate with exact distances from
//! every place.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use touchup::features::FeatureKind;
use touchup::mesh::{FaceHit, TriMesh};
use touchup::probing::arm::{
    Arm, ArmState, Limits, Observer, SlideEnding, SlideRecord, SlideTarget, StopRequest,
    SupervisedArm, TouchParams,
};
use touchup::probing::execute::{
    Ending, Flag, FlagResult, Phase, ProbeParams, Prober, Progress, StaticWorld, World, plan,
};
use touchup::probing::plan::{Slide, Station};
use touchup::sim::{ArmParams, Plate, SimArm, Surface};

use super::cell;
use crate::plate_stream::plate_scan;

/// Top of the plate, m.
const TOP: f64 = 12e-3;
/// Of the ball, m.
const BALL: f64 = 1.5e-3;

fn params() -> ProbeParams {
    ProbeParams {
        slides: true,
        ..super::params()
    }
}

fn flag(kind: Option<FeatureKind>, [x, y, z]: [f64; 3], radius: f64) -> Flag {
    Flag {
        id: 1,
        kind,
        place: Point3::new(x, y, z),
        radius,
    }
}

fn world() -> StaticWorld {
    StaticWorld::new(plate_scan(1))
}

fn start() -> Isometry3<f64> {
    cell().pose(
        &UnitQuaternion::identity(),
        &Point3::new(40e-3, 25e-3, 50e-3),
    )
}

fn probed(flag: &Flag, world: &mut dyn World) -> (FlagResult, Point3<f64>) {
    let (plate, cell) = (Plate::default(), cell());
    let mut arm = SimArm::new(&plate, ArmParams::default(), &start()).unwrap();
    let probed = Prober::new(&mut arm, &cell, &params(), world).probe(flag);
    arm.advance(0.5);
    (probed, arm.ball())
}

/// The ball just touches at each station, and its normal leads away from the contact; lifted, and
/// on the whole path up, it is clear.
fn lies_on(plate: &Plate, slide: &Slide) {
    for (number, station) in slide.stations.iter().enumerate() {
        let off = plate.signed_distance(&station.centre) - BALL;
        assert!(
            off.abs() < 60e-6,
            "station {number}: {:.0} um off",
            off * 1e6
        );
        let away = station.centre - plate.closest(&station.centre).point;
        assert!(
            away.normalize().dot(&station.normal) > 0.99,
            "station {number}: {} {away}",
            station.normal.into_inner()
        );
        let (lifted, above) = (slide.lifted(number), slide.above(number));
        for share in 0..=20 {
            let room =
                plate.signed_distance(&(lifted + (above - lifted) * (f64::from(share) / 20.0)));
            assert!(
                room > BALL + 0.2e-3,
                "station {number}: {:.2} mm",
                room * 1e3
            );
        }
    }
    let longest = slide
        .stations
        .windows(2)
        .map(|pair| (pair[1].centre - pair[0].centre).norm())
        .fold(0.0, f64::max);
    assert!(longest < 0.2e-3, "{longest}");
}

/// Walls, rims and tops of each kind, from a flag that is up to 2 mm off: 3 N within 0.3 N.
#[test]
fn slides_lie_on_what_was_found_and_keep_their_force() {
    let plate = Plate::default();
    let flags = [
        flag(Some(FeatureKind::Hole), [17e-3, 35e-3, TOP], 3e-3),
        flag(Some(FeatureKind::Hole), [32.5e-3, 35e-3, TOP], 3e-3),
        flag(Some(FeatureKind::Slot), [26e-3, 13e-3, TOP], 3e-3),
        flag(Some(FeatureKind::Boss), [47.5e-3, 26e-3, TOP + 4e-3], 3e-3),
        flag(Some(FeatureKind::Edge), [59e-3, 25e-3, TOP], 3e-3),
        flag(Some(FeatureKind::Plane), [45e-3, 9e-3, TOP], 5e-3),
    ];
    for flag in flags {
        let (probed, end) = probed(&flag, &mut world());
        assert_eq!(probed.ending, Ending::ToleranceReached, "{flag:?}");
        assert!(
            !probed.slides.is_empty() && end.z > TOP + BALL,
            "{flag:?} {end}"
        );
        for one in &probed.slides {
            lies_on(&plate, &one.slide);
            let record = one
                .record
                .as_ref()
                .unwrap_or_else(|| panic!("{flag:?}: {:?}", one.refused));
            println!(
                "{}: {:.0} mm, {:.2} N, {:.2} N off at most, {:.1} N",
                flag.kind.unwrap().name(),
                one.slide.length() * 1e3,
                record.mean_force,
                record.worst_force,
                record.peak_force
            );
            assert_eq!(
                (record.ending, record.reached),
                (SlideEnding::Arrived, one.slide.stations.len() - 1)
            );
            assert!(
                (record.mean_force - 3.0).abs() < 0.15 && record.worst_force < 0.3,
                "{flag:?} {record:?}"
            );
        }
        assert!(probed.peak_force < 4.5, "{}", probed.peak_force);
    }
}

/// From a flag beside an undetected hole: over the touched region only, and into nothing.
#[test]
fn an_unknown_region_is_slid_over_where_it_was_touched() {
    let plate = Plate::default();
    let (probed, end) = probed(&flag(None, [20e-3, 33e-3, TOP], 6e-3), &mut world());
    assert!(!probed.slides.is_empty() && end.z > TOP + BALL);
    let length: f64 = probed.slides.iter().map(|one| one.slide.length()).sum();
    assert!(length > 50e-3, "{length}");
    for station in probed.slides.iter().flat_map(|one| &one.slide.stations) {
        // between two touches of different height the surface is a guess
        let off = plate.signed_distance(&station.centre) - BALL;
        assert!(off.abs() < BALL, "{off}");
    }
    assert!(probed.slides.iter().any(|one| {
        one.record
            .as_ref()
            .is_some_and(|r| r.ending == SlideEnding::Arrived)
    }));
}

/// A straight slide over the top of the plate, at a height over it.
fn slid(from: [f64; 2], to: [f64; 2], height: f64) -> (SlideRecord, Point3<f64>, f64) {
    let (plate, params, cell) = (Plate::default(), ArmParams::default(), cell());
    let mut arm = SimArm::new(&plate, params.clone(), &start()).unwrap();
    let stations = (0..=200).map(|at| {
        let share = f64::from(at) / 200.0;
        let place = [0, 1].map(|i| from[i] + (to[i] - from[i]) * share);
        let centre = Point3::new(place[0], place[1], TOP + BALL + height);
        Station {
            centre: cell.pose_bo * centre,
            normal: Vector3::z_axis(),
        }
    });
    let rotation = UnitQuaternion::identity();
    let target = SlideTarget {
        rotation,
        stations: stations.collect(),
        lift: 3e-3,
        give: BALL,
    };
    let mut onlooker = Onlooker;
    let limits = self::params().limits;
    let mut watched = SupervisedArm::new(&mut arm, limits, &mut onlooker);
    watched.zero().unwrap();
    let record = watched.slide(&target, &TouchParams::default()).unwrap();
    assert_eq!(watched.reached, Some(record.reached));
    let peak = arm.peak_force();
    arm.advance(0.2);
    (record, arm.ball(), peak)
}

struct Onlooker;

impl Observer for Onlooker {
    fn on_state(&mut self, _: &ArmState) {}
}

/// The plate ends at x = 0.
#[test]
fn a_surface_that_ends_is_left() {
    let (record, ball, peak) = slid([6e-3, 25e-3], [-6e-3, 25e-3], 0.0);
    assert_eq!(record.ending, SlideEnding::Lost);
    assert!(
        ball.z > TOP + BALL + 2.5e-3 && ball.x < 0.5e-3 && ball.x > -BALL - 2.5e-3,
        "{ball}"
    );
    assert!(peak < 4.5, "{peak}");
}

/// The boss has a radius of 5 mm at (47 25) mm.
#[test]
fn an_obstacle_ends_a_slide() {
    let (record, ball, peak) = slid([30e-3, 25e-3], [47e-3, 25e-3], 0.0);
    assert_eq!(record.ending, SlideEnding::Blocked);
    assert!(
        (ball.x - (42e-3 - BALL)).abs() < 0.3e-3 && ball.z > TOP + BALL + 2.5e-3,
        "{ball}"
    );
    // 15 N/mm at 10 mm/s, until the arm has received the stop and is at rest
    assert!(peak < 10.0, "{peak}");
}

#[test]
fn where_no_surface_is_nothing_is_slid_over() {
    let (record, ball, peak) = slid([45e-3, 5e-3], [45e-3, 9e-3], 6e-3);
    assert_eq!((record.ending, record.reached), (SlideEnding::NoSurface, 0));
    assert!(ball.z > TOP + BALL + 6e-3 && peak == 0.0, "{ball} {peak}");
}

/// Wants it to end after some states of a slide.
struct Impatient {
    inner: StaticWorld,
    is_sliding: bool,
    seen: usize,
}

impl Observer for Impatient {
    fn on_state(&mut self, _: &ArmState) {
        self.seen += usize::from(self.is_sliding);
    }

    fn stop_request(&self) -> Option<StopRequest> {
        (self.seen > 2000).then_some(StopRequest::Retract)
    }
}

impl World for Impatient {
    fn mesh(&self) -> &TriMesh {
        self.inner.mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.inner.closest_face(place, reach)
    }

    fn publish(&mut self, _: &Progress) {}

    fn enter(&mut self, phase: Phase) {
        self.is_sliding |= phase == Phase::Slide;
    }
}

#[test]
fn a_cancelled_slide_comes_out_of_the_hole() {
    let mut world = Impatient {
        inner: world(),
        is_sliding: false,
        seen: 0,
    };
    let (probed, end) = probed(
        &flag(Some(FeatureKind::Hole), [17e-3, 35e-3, TOP], 3e-3),
        &mut world,
    );
    assert_eq!(probed.ending, Ending::Cancelled(StopRequest::Retract));
    assert!(probed.found.is_some() && end.z > TOP + BALL + 1e-3, "{end}");
    assert!(probed.peak_force < 4.5, "{}", probed.peak_force);
}

/// A plan has the slides too, and omits unreachable ones.
#[test]
fn slides_are_planned_and_checked() {
    let (plate, cell, params) = (Plate::default(), cell(), params());
    let mut arm = SimArm::new(&plate, ArmParams::default(), &start()).unwrap();
    let now = arm.next_state().unwrap();
    let flag = flag(Some(FeatureKind::Plane), [45e-3, 9e-3, TOP], 5e-3);
    let planned = plan(&cell, &params, &world(), &flag, &now, None).unwrap();
    assert_eq!(
        (planned.slides.len(), planned.held_back.len()),
        (1, 0),
        "{:?}",
        planned.held_back
    );
    let on_path = |place: &Point3<f64>| planned.path.contains(place);
    assert!(
        planned.slides[0]
            .stations
            .iter()
            .all(|station| on_path(&station.centre))
    );
    // a floor of the workspace between the clear height and the surface
    let floor = (cell.pose_bo * Point3::new(45e-3, 9e-3, TOP + BALL + 1e-3)).z;
    let lowest = Point3::new(-0.6, -0.3, floor);
    let narrow = ProbeParams {
        limits: Limits {
            lowest,
            ..params.limits.clone()
        },
        ..params
    };
    let planned = plan(&cell, &narrow, &world(), &flag, &now, None).unwrap();
    assert!(
        planned.held_back.len() >= planned.touches.len().max(1),
        "{:?}",
        planned.held_back
    );
}
