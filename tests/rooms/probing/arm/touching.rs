//! A simulated arm touches a plate with walls in closed form.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind, MeasuredValue};
use touchup::probing::arm::{
    Arm, ArmError, ArmState, Command, LimitError, Limits, Observer, OnsetVerdict, ProbeError,
    RequestLimits, Safety, StopRequest, SupervisedArm, TouchOutcome, TouchParams, TouchRecord,
    TouchTarget, UNEXPECTED,
};
use touchup::probing::plan::{ExploreError, Explorer, PatternParams, TouchResult};
use touchup::sim::{ArmFault, ArmParams, Plate, SensorFault, SimArm};
use touchup::stylus::Wrench;

use crate::plate_stream::plate_scan;

/// Distance of the ball's centre from its contact, m.
type Error = Box<dyn Fn(&Point3<f64>) -> f64>;
/// Whether an error names the true cause.
type IsTrue = fn(&ProbeError) -> bool;

/// Top of the plate, m.
const TOP: f64 = 12e-3;
/// The through hole: axis and radius, m.
const HOLE: ([f64; 2], f64) = ([16e-3, 36e-3], 4e-3);

/// Looks on.
struct Onlooker;

impl Observer for Onlooker {
    fn on_state(&mut self, _: &ArmState) {}
}

fn limits() -> Limits {
    Limits {
        lowest: Point3::new(-0.6, -0.3, 0.0),
        highest: Point3::new(-0.2, 0.2, 0.4),
        ..Limits::default()
    }
}

/// The tip upright at a place of O, in B.
pub(super) fn at(params: &ArmParams, place: [f64; 3]) -> Isometry3<f64> {
    let place = params.pose_bo * Point3::from(place);
    Isometry3::from_parts(place.coords.into(), UnitQuaternion::identity())
}

pub(super) fn touched(
    arm: &mut dyn Arm,
    touching: &TouchParams,
    target: &TouchTarget,
) -> Result<TouchRecord, ProbeError> {
    let mut onlooker = Onlooker;
    let mut watched = SupervisedArm::new(arm, limits(), &mut onlooker);
    watched.zero()?;
    watched.touch(target, touching)
}

fn down(params: &ArmParams, place: [f64; 3]) -> TouchTarget {
    TouchTarget {
        standoff_bt: at(params, place),
        direction: -Vector3::z_axis(),
        search: 8e-3,
        expected: None,
    }
}

/// The place of a ball that just touches is exact: a radius above the top, a radius inside the wall
/// of the hole.
#[test]
#[expect(clippy::too_many_lines)]
fn the_contact_is_where_the_ball_touches_and_not_where_the_arm_rests() {
    let plate = Plate::default();
    let mut rng = Pcg64::seed_from_u64(5);
    let (mut errors, mut normal, mut rested) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..40 {
        let params = ArmParams {
            seed,
            ..ArmParams::default()
        };
        let touching = TouchParams {
            stiffness: params.stiffness,
            ..TouchParams::default()
        };
        let is_wall = seed % 2 == 1;
        // the sign of `error` is along the approach
        let (target, error): (TouchTarget, Error) = if is_wall {
            let angle = rng.random_range(0.0..std::f64::consts::TAU);
            let direction = Vector3::new(f64::cos(angle), f64::sin(angle), 0.0);
            let ([x, y], radius) = HOLE;
            let standoff_bt = at(&params, [x, y, TOP - 4e-3]);
            let ball = params.radius;
            let error = move |p: &Point3<f64>| (p.x - x).hypot(p.y - y) - (radius - ball);
            (
                TouchTarget {
                    standoff_bt,
                    direction: Unit::new_normalize(direction),
                    search: 8e-3,
                    expected: None,
                },
                Box::new(error),
            )
        } else {
            let place = [
                rng.random_range(40e-3..50e-3),
                rng.random_range(5e-3..12e-3),
                TOP + 5e-3,
            ];
            let ball = params.radius;
            (
                down(&params, place),
                Box::new(move |p: &Point3<f64>| TOP + ball - p.z),
            )
        };
        let mut arm =
            SimArm::new(&plate, params.clone(), &at(&params, [16e-3, 36e-3, 30e-3])).unwrap();
        if is_wall {
            let mut onlooker = Onlooker;
            let mut watched = SupervisedArm::new(&mut arm, limits(), &mut onlooker);
            watched.zero().unwrap();
            watched
                .line("going down", &target.standoff_bt, 10e-3, &touching, 1.5)
                .unwrap();
        }
        let record = touched(&mut arm, &touching, &target).unwrap();
        let TouchOutcome::Contact {
            onset,
            centre,
            force_b,
        } = &record.outcome
        else {
            panic!("{:?}", record.outcome)
        };
        assert_eq!(onset.verdict, OnsetVerdict::Clean, "{onset:?}");
        assert!(
            record.peak_force < 1.5 * touching.force && arm.peak_force() < 1.5 * touching.force,
            "{}",
            record.peak_force
        );
        assert!(
            (onset.stiffness / params.stiffness - 1.0).abs() < 0.1,
            "{onset:?}"
        );
        let along = force_b.normalize().dot(&target.direction);
        assert!(along < -0.95, "the part pushes back: {along}");
        let found = params.pose_bo.inverse_transform_point(centre);
        errors.push(error(&found));
        normal.push(error(&found) / onset.sigma);
        let deepest = record.curve.iter().map(|m| m.travel).fold(0.0, f64::max);
        rested.push(deepest - onset.travel);
    }
    let rms = |of: &[f64]| (of.iter().map(|x| x * x).sum::<f64>() / of.len() as f64).sqrt();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    println!(
        "mean {:.2} um, rms {:.2} um, over what is stated {:.2}; where it rested {:.0} um deeper",
        mean * 1e6,
        rms(&errors) * 1e6,
        rms(&normal),
        rms(&rested) * 1e6
    );
    assert!(
        mean.abs() < 2e-6 && rms(&errors) < 8e-6,
        "{mean} {}",
        rms(&errors)
    );
    assert!((0.4..1.6).contains(&rms(&normal)), "{}", rms(&normal));
    // the error of the place of rest
    assert!(rms(&rested) > 100e-6);
}

/// Makes the touches that a search wants, until it wants no more; returns the largest force.
#[expect(clippy::too_many_lines)]
pub(super) fn explored(
    arm: &mut SimArm,
    params: &ArmParams,
    touching: &TouchParams,
    search: &mut Explorer,
) -> f64 {
    let mut onlooker = Onlooker;
    let mut watched = SupervisedArm::new(arm, limits(), &mut onlooker);
    watched.zero().unwrap();
    let pose = |place: &Point3<f64>| at(params, (*place).into());
    let (mut from, mut peak) = (None, 0.0f64);
    while let Some(planned) = search.next_touch() {
        // up from its place, over, down
        let above = |place: &Point3<f64>| place + Vector3::z() * 6e-3;
        if let Some(out) = from {
            watched
                .line(
                    "going up",
                    &pose(&above(&out)),
                    touching.link_speed,
                    touching,
                    5.0,
                )
                .unwrap();
        }
        watched
            .line(
                "going over",
                &pose(&above(&planned.entry)),
                touching.link_speed,
                touching,
                1.5,
            )
            .unwrap();
        watched
            .line(
                "going over",
                &pose(&planned.entry),
                touching.link_speed,
                touching,
                1.5,
            )
            .unwrap();
        let direction =
            Unit::new_normalize(params.pose_bo.rotation * planned.direction.into_inner());
        let target = TouchTarget {
            standoff_bt: pose(&planned.from),
            direction,
            search: planned.search,
            expected: planned.expected,
        };
        from = Some(planned.entry);
        let record = match watched.touch(&target, touching) {
            Ok(record) => record,
            Err(ProbeError::Obstacle { .. }) => {
                search.take(&TouchResult::Unclear);
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        peak = peak.max(record.peak_force);
        search.take(&match record.outcome {
            TouchOutcome::Contact { onset, centre, .. }
                if onset.verdict != OnsetVerdict::Impact =>
            {
                TouchResult::At {
                    centre: params.pose_bo.inverse_transform_point(&centre),
                    sigma: onset.sigma,
                }
            }
            TouchOutcome::Miss { .. } => TouchResult::Nothing,
            _ => TouchResult::Unclear,
        });
    }
    peak
}

/// Of the scan of the plate, by touches that repeat within 5 µm.
fn hole_search(flag: &Point3<f64>) -> Explorer {
    let params = PatternParams {
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    Explorer::new(
        Some(FeatureKind::Hole),
        flag,
        &Vector3::z_axis(),
        params,
        &plate_scan(1),
    )
    .unwrap()
}

/// From a click up to 3 mm off and no size: place and diameter of both holes of the plate, against
/// its closed form.
#[test]
fn a_hole_is_found_from_one_click_and_measured() {
    let plate = Plate::default();
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut worst, mut counts) = ([0.0f64; 2], Vec::new());
    // twenty seeds are the slow proof
    let seeds = crate::full::either(2, 20);
    for seed in 0..seeds {
        let ([x, y], radius) = if seed % 2 == 0 {
            HOLE
        } else {
            ([32e-3, 34e-3], 3e-3)
        };
        let params = ArmParams {
            seed,
            ..ArmParams::default()
        };
        let touching = TouchParams {
            stiffness: params.stiffness,
            ..TouchParams::default()
        };
        let (angle, off) = (
            rng.random_range(0.0..std::f64::consts::TAU),
            rng.random_range(0.0..3e-3),
        );
        let flag = Point3::new(
            x + off * angle.cos(),
            y + off * angle.sin(),
            TOP + rng.random_range(-0.5e-3..0.5e-3),
        );
        let mut arm = SimArm::new(&plate, params.clone(), &at(&params, [x, y, 30e-3])).unwrap();
        let mut search = hole_search(&flag);
        let peak = explored(&mut arm, &params, &touching, &mut search);
        let found = search.found().unwrap();
        let feature = found.feature.as_ref().unwrap();
        let (centre, diameter) = (
            feature.centre.value,
            feature.diameter.as_ref().unwrap().value,
        );
        let errors = [
            (centre.x - x).hypot(centre.y - y),
            (diameter - 2.0 * radius).abs(),
        ];
        println!(
            "off {:.1} mm: {} touches, {:.0} s, centre {:.1} um, diameter {:.1} um, height {:.1} um, peak {peak:.1} N, as asked {}",
            off * 1e3,
            found.touches,
            arm.time(),
            errors[0] * 1e6,
            errors[1] * 1e6,
            (centre.z - TOP) * 1e6,
            found.is_as_asked
        );
        worst = [0, 1].map(|at| worst[at].max(errors[at]));
        counts.push(found.touches);
        assert!(peak < 1.5 * touching.force, "{peak}");
        assert!((centre.z - TOP).abs() < 20e-6, "{}", centre);
    }
    assert!(worst[0] < 50e-6 && worst[1] < 50e-6, "{worst:?}");
    assert!(counts.iter().all(|count| *count < 40), "{counts:?}");
}

#[test]
fn where_no_hole_is_none_is_found() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let mut arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 30e-3])).unwrap();
    let flag = Point3::new(45e-3, 8e-3, TOP);
    let mut search = hole_search(&flag);
    explored(&mut arm, &params, &TouchParams::default(), &mut search);
    assert!(
        matches!(search.found(), Err(ExploreError::NotFound { .. })),
        "{:?}",
        search.found()
    );
}

#[test]
fn where_nothing_is_that_is_the_answer() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let mut arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 30e-3])).unwrap();
    let target = down(&params, [45e-3, 8e-3, 30e-3]);
    let record = touched(&mut arm, &TouchParams::default(), &target).unwrap();
    let TouchOutcome::Miss { travel } = record.outcome else {
        panic!("{:?}", record.outcome)
    };
    assert!((travel - 8e-3).abs() < 0.2e-3, "{travel}");
    assert!(record.peak_force < 1.0);
}

/// If something obstructs a planned path, the arm stops and reports the place.
#[test]
fn an_obstacle_stops_it() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let mut arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 20e-3])).unwrap();
    let inside = down(&params, [45e-3, 8e-3, TOP - 3e-3]);
    let error = touched(
        &mut arm,
        &TouchParams {
            link_speed: 10e-3,
            ..TouchParams::default()
        },
        &inside,
    )
    .unwrap_err();
    let ProbeError::Obstacle {
        place_mm, force_n, ..
    } = error
    else {
        panic!("{error}")
    };
    let expected = (params.pose_bo * Point3::new(45e-3, 8e-3, TOP + params.radius)) * 1e3;
    assert!(
        (place_mm[2] - expected.z).abs() < 0.5 && force_n > 1.0,
        "{place_mm:?}, {force_n} N"
    );
    arm.advance(0.3);
    assert!(arm.peak_force() < limits().force);
    assert!(arm.time() - arm.at_rest_since() > 0.1);
}

/// For any speed of a link, to the part or from it: the arm presses an obstacle with no more than
/// the limit, and has left it in the end.
#[test]
fn a_link_that_meets_something_rigid_keeps_the_limit_of_force_and_comes_free() {
    let plate = Plate::default();
    for (stiffness, leaves) in [
        (5e3, false),
        (15e3, false),
        (40e3, false),
        (15e3, true),
        (40e3, true),
    ] {
        let params = ArmParams {
            stiffness,
            ..ArmParams::default()
        };
        let mut arm =
            SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 40e-3])).unwrap();
        let touching = TouchParams {
            stiffness,
            link_speed: 0.25,
            ..TouchParams::default()
        };
        let limits = Limits {
            speed: 0.25,
            ..limits()
        };
        let mut world = Onlooker;
        let mut watched = SupervisedArm::new(&mut arm, limits.clone(), &mut world);
        watched.zero().unwrap();
        let inside = at(&params, [45e-3, 8e-3, TOP - 5e-3]);
        let met = match leaves {
            true => watched.leave("retracting", &inside, touching.link_speed, &touching),
            false => watched.line(
                "going",
                &inside,
                touching.link_speed,
                &touching,
                UNEXPECTED * touching.trigger,
            ),
        };
        let Err(ProbeError::Obstacle {
            force_n, place_mm, ..
        }) = met
        else {
            panic!("{met:?}")
        };
        let surface = (params.pose_bo * Point3::new(45e-3, 8e-3, TOP + params.radius)) * 1e3;
        assert!((place_mm[2] - surface.z).abs() < 1.0, "{place_mm:?}");
        println!(
            "{stiffness} N/m: {:.1} N at most, told {force_n:.1} N",
            arm.peak_force()
        );
        assert!(
            arm.peak_force() < limits.force && force_n > 0.8 * arm.peak_force() - 0.5,
            "{force_n}"
        );
        arm.advance(0.3);
        let left_n = arm.next_state().unwrap().wrench_b.force.norm();
        assert!(
            left_n < 1.2 && arm.time() - arm.at_rest_since() > 0.25,
            "{left_n} N"
        );
    }
}

/// The way out of the hole leans into its wall, by 0.25 mm at the rim: pressed in by that the ball
/// would feel 3.75 N. It goes off the wall and on.
#[test]
fn a_wall_beside_the_way_out_is_no_obstacle() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let touching = TouchParams {
        stiffness: params.stiffness,
        ..TouchParams::default()
    };
    let wall = HOLE.0[0] + HOLE.1 - params.radius;
    let inside = at(&params, [wall - 50e-6, HOLE.0[1], TOP - 6e-3]);
    let above = at(&params, [wall + 0.5e-3, HOLE.0[1], TOP + 5e-3]);
    let mut arm = SimArm::new(&plate, params, &inside).unwrap();
    let mut seen = ForceSeen::default();
    let mut watched = SupervisedArm::new(&mut arm, limits(), &mut seen);
    watched.zero().unwrap();
    watched
        .leave("going up", &above, touching.link_speed, &touching)
        .unwrap();
    let ended = arm.next_state().unwrap().pose_bt.translation.vector;
    let off = ended - above.translation.vector;
    assert!(off.z.abs() < 0.1e-3 && off.norm() < 0.6e-3, "{off}");
    assert!((1.5..3.0).contains(&seen.0), "{} N", seen.0);
}

/// The way out of the hole leans a little into its wall, so that the arm feels it only near the
/// rim: the ball passes the rim before the arm stands, and goes on.
#[test]
fn a_rim_that_is_passed_while_the_arm_brakes_is_no_obstacle() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let touching = TouchParams {
        stiffness: params.stiffness,
        ..TouchParams::default()
    };
    let wall = HOLE.0[0] + HOLE.1 - params.radius;
    let inside = at(&params, [wall - 50e-6, HOLE.0[1], TOP - 6e-3]);
    let mut passed = 0;
    for beyond in (10..40).map(|step| 10e-6 * f64::from(step)) {
        let above = at(&params, [wall + beyond, HOLE.0[1], TOP + 5e-3]);
        let mut arm = SimArm::new(&plate, params.clone(), &inside).unwrap();
        let mut seen = ForceSeen::default();
        let mut watched = SupervisedArm::new(&mut arm, limits(), &mut seen);
        watched.zero().unwrap();
        let left = watched.leave("going up", &above, touching.link_speed, &touching);
        left.unwrap_or_else(|error| panic!("{:.0} µm: {error}", beyond * 1e6));
        passed += u32::from((1.2..2.0).contains(&seen.0));
    }
    assert!(passed > 3, "{passed}");
}

/// The largest force, N.
#[derive(Default)]
struct ForceSeen(f64);

impl Observer for ForceSeen {
    fn on_state(&mut self, state: &ArmState) {
        self.0 = self.0.max(state.wrench_b.force.norm());
    }
}

/// An arm with altered states.
struct Altered<'a, F: FnMut(&mut ArmState)> {
    arm: SimArm<'a>,
    alter: F,
}

impl<F: FnMut(&mut ArmState)> Arm for Altered<'_, F> {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        let mut state = self.arm.next_state()?;
        (self.alter)(&mut state);
        Ok(state)
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        self.arm.command(command)
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        self.arm.zero_sensor()
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        self.arm.recover()
    }

    fn period(&self) -> f64 {
        self.arm.period()
    }
}

/// The first contact shows it, and it is not pressed after that.
#[test]
fn a_force_with_the_other_sign_is_named_at_the_first_contact() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 20e-3])).unwrap();
    let mut turned = Altered {
        arm,
        alter: |state: &mut ArmState| state.wrench_b.force *= -1.0,
    };
    let mut world = Onlooker;
    let mut watched = SupervisedArm::new(&mut turned, limits(), &mut world);
    watched.zero().unwrap();
    let error = watched
        .touch(
            &down(&params, [45e-3, 8e-3, TOP + 5e-3]),
            &TouchParams::default(),
        )
        .unwrap_err();
    assert!(
        matches!(error, ProbeError::Pulls { .. }) && error.to_string().contains("sign"),
        "{error}"
    );
    turned.arm.advance(0.3);
    let left_n = turned.next_state().unwrap().wrench_b.force.norm();
    assert!(left_n < 1.2, "{left_n} N");
    assert!(turned.arm.peak_force() < limits().force);
}

/// Zeroing a sensor under load would hide that force in every later touch.
#[test]
fn a_sensor_that_feels_something_is_not_zeroed() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let free = at(&params, [45e-3, 8e-3, 30e-3]);
    let mut world = Onlooker;
    let alter = |state: &mut ArmState| state.wrench_b.force.z += 7.5;
    let mut pressed = Altered {
        arm: SimArm::new(&plate, params.clone(), &free).unwrap(),
        alter,
    };
    let error = SupervisedArm::new(&mut pressed, limits(), &mut world)
        .zero()
        .unwrap_err();
    assert!(
        matches!(error, ProbeError::Loaded { force_n, most_n: 5.0, .. } if force_n > 6.0),
        "{error}"
    );
    // a person leans on it: 20 N/s
    let arm = SimArm::new(&plate, params.clone(), &free).unwrap();
    let alter = |state: &mut ArmState| {
        state.wrench_b.force.x += 20.0 * (state.stamp_ns % 1_000_000_000) as f64 * 1e-9
    };
    let mut leaned = Altered { arm, alter };
    let error = SupervisedArm::new(
        &mut leaned,
        Limits {
            tare: 50.0,
            ..limits()
        },
        &mut world,
    )
    .zero()
    .unwrap_err();
    assert!(
        matches!(error, ProbeError::Unsteady { change_n, .. } if change_n > 0.3),
        "{error}"
    );
    // a free one is, also with twice its noise
    for seed in 0..50 {
        let params = ArmParams {
            seed,
            force_noise: 0.3,
            ..params.clone()
        };
        let mut arm = SimArm::new(&plate, params.clone(), &free).unwrap();
        SupervisedArm::new(&mut arm, limits(), &mut world)
            .zero()
            .unwrap();
    }
}

/// After any fault in the middle of a search, the arm is at rest within 200 ms, and the reported
/// cause is the true one.
#[test]
#[expect(clippy::too_many_lines)]
fn after_each_fault_the_arm_is_at_rest_and_the_reported_reason_is_true() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let is_true: [(ArmFault, IsTrue); 5] = [
        (ArmFault::LinkLost, |e| {
            matches!(
                e,
                ProbeError::Arm {
                    error: ArmError::Lost { .. },
                    ..
                }
            )
        }),
        (ArmFault::ControllerKilled, |e| {
            matches!(
                e,
                ProbeError::Arm {
                    error: ArmError::Stale
                        | ArmError::Stopped {
                            safety: Safety::Fault
                        },
                    ..
                }
            )
        }),
        (ArmFault::OperatorStop, |e| {
            matches!(
                e,
                ProbeError::Arm {
                    error: ArmError::Stopped {
                        safety: Safety::OperatorStop
                    },
                    ..
                }
            )
        }),
        (ArmFault::ProtectiveStop, |e| {
            matches!(
                e,
                ProbeError::Arm {
                    error: ArmError::Stopped {
                        safety: Safety::ProtectiveStop
                    },
                    ..
                }
            )
        }),
        (ArmFault::ForceSpike(40.0), |e| {
            matches!(
                e,
                ProbeError::Limit {
                    error: LimitError::Force { .. },
                    ..
                }
            )
        }),
    ];
    for (fault, is_true) in is_true {
        let mut arm =
            SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 25e-3])).unwrap();
        let at_s = 0.9;
        arm.fail_at(at_s, fault);
        let target = down(&params, [45e-3, 8e-3, 22e-3]);
        let error = touched(
            &mut arm,
            &TouchParams {
                search_speed: 5e-3,
                ..TouchParams::default()
            },
            &target,
        )
        .unwrap_err();
        assert!(
            is_true(&error) && error.to_string().contains("search"),
            "{fault:?}: {error}"
        );
        arm.advance(0.5);
        let stood = arm.at_rest_since() - at_s;
        assert!(stood < 0.2, "{fault:?}: after {stood} s");
        println!(
            "{fault:?}: {error}; at rest after {:.0} ms",
            stood.max(0.0) * 1e3
        );
    }
}

/// During a search the sensor fails in free air, 3 mm above the part at 5 mm/s; during a press the
/// ball is at the part. The true force measures the press.
#[test]
fn a_force_sensor_that_does_not_sense_stops_the_arm_within_100_ms() {
    let plate = Plate::default();
    let frozen = |x, y, z| SensorFault::Frozen(Vector3::new(x, y, z));
    let faults = [
        (frozen(0.0, 0.0, 0.0), "frozen at"),
        (SensorFault::Zero, "frozen at"),
        (SensorFault::Clipped(0.6), "is clipped or dead: along"),
        (SensorFault::Noise(0.0), "frozen at"),
        (frozen(1.0, 1.0, 0.0), "is clipped or dead: along"),
        (frozen(0.0, 1.0, 0.0), "is clipped or dead: along"),
        (frozen(0.0, 1.0, 1.0), "is clipped or dead: along"),
    ];
    // the tip turned about its axis in the flange: no axis of the sensor is one of tip or base
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5);
    for turn in [UnitQuaternion::identity(), turned] {
        for (fault, named) in faults {
            let params = ArmParams {
                pose_ft: ArmParams::default().pose_ft * turn,
                ..ArmParams::default()
            };
            let mut arm =
                SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 20e-3])).unwrap();
            let at_s = 0.9;
            arm.fail_at(at_s, ArmFault::Sensor(fault));
            let slow = TouchParams {
                search_speed: 5e-3,
                ..TouchParams::default()
            };
            let error =
                touched(&mut arm, &slow, &down(&params, [45e-3, 8e-3, 18.5e-3])).unwrap_err();
            arm.advance(0.5);
            let stood_ms = (arm.at_rest_since() - at_s) * 1e3;
            println!(
                "{fault:?}: {error}; at rest after {stood_ms:.0} ms, {:.1} N",
                arm.peak_force()
            );
            assert!(
                matches!(error, ProbeError::Senseless { .. }),
                "{fault:?}: {error}"
            );
            assert!(error.to_string().contains(named), "{fault:?}: {error}");
            assert!(
                stood_ms < 100.0 && arm.peak_force() < 15.0,
                "{fault:?}: {stood_ms} ms"
            );
        }
    }
}

/// From its 500th state on the arm reports a tenfold speed, a joint that turns by itself, or a
/// clock that went back.
#[test]
fn an_arm_that_is_too_fast_or_whose_clock_goes_back_is_stopped() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    type Alter = fn(&mut ArmState, f64);
    let faults: [(Alter, IsTrue); 3] = [
        (
            |state, seconds| state.pose_bt.translation.vector.x += 0.3 * seconds,
            |e| matches!(e, ProbeError::Limit { error: LimitError::Speed { mm_per_s, .. }, .. } if *mm_per_s > 125.0),
        ),
        (
            |state, seconds| state.joints[3] += 3.0 * seconds,
            |e| {
                matches!(
                    e,
                    ProbeError::Limit {
                        error: LimitError::JointSpeed { joint: 4, .. },
                        ..
                    }
                )
            },
        ),
        (
            |state, _| state.stamp_ns -= 70_000_000,
            |e| matches!(e, ProbeError::Arm { error: ArmError::WentBack { back_ms }, .. } if (67.0..69.0).contains(back_ms)),
        ),
    ];
    for (alter, is_true) in faults {
        let arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 25e-3])).unwrap();
        let (mut seen, mut told) = (0u32, 0);
        let alter = |state: &mut ArmState| {
            seen += 1;
            if seen >= 500 {
                told += 1;
                alter(state, f64::from(seen - 500) * 2e-3);
            }
        };
        let mut altered = Altered { arm, alter };
        let target = down(&params, [45e-3, 8e-3, 22e-3]);
        let touch = TouchParams {
            search_speed: 2e-3,
            ..TouchParams::default()
        };
        let error = touched(&mut altered, &touch, &target).unwrap_err();
        assert!(is_true(&error), "{error}");
        let begun = altered.arm.time();
        altered.arm.advance(0.5);
        assert!(altered.arm.at_rest_since() - begun < 0.05, "{error}");
        println!("{error}");
        assert!(told <= 11, "{told} states until it was seen");
    }
}

/// Wants it to end after 300 states.
struct Impatient {
    seen: usize,
}

impl Observer for Impatient {
    fn on_state(&mut self, _: &ArmState) {
        self.seen += 1;
    }

    fn stop_request(&self) -> Option<StopRequest> {
        (self.seen > 300).then_some(StopRequest::Retract)
    }
}

#[test]
fn a_cancelled_touch_stops() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let mut arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 25e-3])).unwrap();
    let mut impatient = Impatient { seen: 0 };
    let mut watched = SupervisedArm::new(&mut arm, limits(), &mut impatient);
    watched.zero().unwrap();
    let error = watched
        .touch(
            &down(&params, [45e-3, 8e-3, 22e-3]),
            &TouchParams::default(),
        )
        .unwrap_err();
    assert!(matches!(error, ProbeError::Cancelled { .. }), "{error}");
    let cancelled = arm.time();
    arm.advance(0.3);
    assert!(arm.at_rest_since() - cancelled < 0.1);
}

/// An arm that never stands still, under any command: it creeps by 20 µm from state to state.
struct Creeping {
    stamp_ns: i64,
}

impl Arm for Creeping {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        self.stamp_ns += 2_000_000;
        let x = -0.4 + 20e-6 * (self.stamp_ns / 2_000_000) as f64 % 0.1;
        // no sensor is without noise
        let noise = if self.stamp_ns % 4_000_000 == 0 {
            0.1
        } else {
            -0.1
        };
        let wrench_b = Wrench {
            force: Vector3::repeat(noise),
            torque: Vector3::zeros(),
        };
        let pose_bt = Isometry3::translation(x, 0.0, 0.1);
        let (joints, safety, raw_wrench_f) = ([0.0; 6], Safety::Normal, Wrench::default());
        Ok(ArmState {
            stamp_ns: self.stamp_ns,
            pose_bt,
            wrench_b,
            raw_wrench_f,
            joints: joints.into(),
            safety,
        })
    }

    fn command(&mut self, _: &Command) -> Result<(), ArmError> {
        Ok(())
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        Ok(())
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        Ok(())
    }

    fn period(&self) -> f64 {
        2e-3
    }
}

/// 10 mm/s is no rest, and it is not waited for without end: three times the 0.2 s that a stop from
/// 0.1 m/s with 0.5 m/s² takes, and two seconds.
#[test]
fn an_arm_that_creeps_is_not_at_rest() {
    let (mut arm, mut onlooker) = (Creeping { stamp_ns: 0 }, Onlooker);
    let error = SupervisedArm::new(&mut arm, limits(), &mut onlooker)
        .zero()
        .unwrap_err();
    assert!(
        matches!(error, ProbeError::TooLong { limit_s, .. } if (limit_s - 2.6).abs() < 1e-9),
        "{error}"
    );
    assert!((arm.stamp_ns as f64 * 1e-9 - 2.6).abs() < 0.01);
}

/// It turns on the spot within its speed, and ends at the target: 0.7 rad at 0.5 rad/s take 1.4 s.
#[test]
fn an_arm_turns_on_the_spot_with_limited_speed() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let start = at(&params, [45e-3, 8e-3, 60e-3]);
    let mut arm = SimArm::new(&plate, params.clone(), &start).unwrap();
    let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.7);
    let to = Isometry3::from_parts(start.translation, turned);
    let mut before = start.rotation;
    let mut arrived = None;
    while arm.time() < 2.0 {
        let state = arm.next_state().unwrap();
        assert_eq!(state.safety, Safety::Normal);
        assert!(state.pose_bt.rotation.angle_to(&before) < 0.5 * 2e-3 * 1.001);
        before = state.pose_bt.rotation;
        if arrived.is_none() && before.angle_to(&turned) < 1e-6 {
            arrived = Some(arm.time());
        }
        arm.command(&Command::Line {
            to,
            speed: 50e-3,
            acceleration: 0.5,
        })
        .unwrap();
    }
    assert!(
        arrived.is_some_and(|time| (time - 1.4).abs() < 0.02),
        "{arrived:?}"
    );
}

/// Pressing slides along with the set force: 5 N within 0.3 N over 40 mm.
#[test]
fn a_slide_keeps_its_force() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    // on the top, beside the slot and short of the step
    let mut arm = SimArm::new(
        &plate,
        params.clone(),
        &at(&params, [10e-3, 5e-3, TOP + 2e-3]),
    )
    .unwrap();
    arm.zero_sensor().unwrap();
    let press = |feed: f64| Command::Press {
        axis: -Vector3::z(),
        force: 5.0,
        feed: Vector3::new(feed, 0.0, 0.0),
        speed: 5e-3,
    };
    let mut forces = Vec::new();
    for tick in 0..5000 {
        let state = arm.next_state().unwrap();
        arm.command(&press(if tick < 1000 { 0.0 } else { 10e-3 }))
            .unwrap();
        if tick > 1100 && arm.ball().x < 50e-3 {
            forces.push(state.wrench_b.force.z);
        }
    }
    assert!(forces.len() > 1900, "{} states", forces.len());
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    // zeroing averages 64 readings: three deviations of their mean
    assert!(
        (mean - 5.0).abs() < 3.0 * params.force_noise / 8.0,
        "{mean}"
    );
    // the sensor's noise of 0.15 N is in it
    let worst = forces
        .windows(50)
        .map(|w| (w.iter().sum::<f64>() / 50.0 - 5.0).abs())
        .fold(0.0, f64::max);
    assert!(worst < 0.3, "{worst}");
}

#[test]
fn a_request_can_only_narrow_the_limits() {
    let limits = limits();
    let less = limits
        .narrowed(&RequestLimits {
            force: Some(5.0),
            speed: Some(0.02),
            ..RequestLimits::default()
        })
        .unwrap();
    assert_eq!(
        (less.force, less.speed, less.search),
        (5.0, 0.02, limits.search)
    );
    let wider = limits
        .narrowed(&RequestLimits {
            speed: Some(0.5),
            ..RequestLimits::default()
        })
        .unwrap_err();
    assert_eq!(
        wider.to_string(),
        "a speed of 500 mm/s is beyond the configured 100 mm/s: a request can only ask for less"
    );
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(
            limits
                .narrowed(&RequestLimits {
                    force: Some(bad),
                    ..RequestLimits::default()
                })
                .is_err(),
            "{bad}"
        );
    }
}

#[test]
fn places_that_cannot_be_are_refused_before_anything_moves() {
    let params = ArmParams::default();
    let limits = limits();
    let near = [0.0, -1.6, 1.6, -1.6, -1.6, 0.0];
    let check = |pose: &Isometry3<f64>, limits: &Limits| {
        limits.check_pose(&params.geometry, &params.pose_ft, pose, &near.into())
    };
    assert!(check(&at(&params, [45e-3, 8e-3, 25e-3]), &limits).is_ok());
    assert!(matches!(
        check(&at(&params, [0.5, 0.0, 0.0]), &limits),
        Err(LimitError::Workspace { .. })
    ));
    assert!(matches!(
        check(&at(&params, [f64::NAN, 0.0, 0.0]), &limits),
        Err(LimitError::Workspace { .. })
    ));
    let wide = Limits {
        lowest: Point3::new(-3.0, -3.0, -3.0),
        highest: Point3::new(3.0, 3.0, 3.0),
        ..limits
    };
    assert!(matches!(
        check(&at(&params, [2.0, 0.0, 0.0]), &wide),
        Err(LimitError::Reach { .. })
    ));
    // right above the shoulder the hand has nowhere to go
    let above = Isometry3::from_parts(
        Vector3::new(0.0, 0.1333, 0.3).into(),
        UnitQuaternion::identity(),
    );
    assert!(matches!(
        check(&above, &wide),
        Err(LimitError::Singular { .. } | LimitError::Reach { .. })
    ));
}

/// One feature of the plate, from a click up to 3 mm off: the result, the touches and the largest
/// force.
fn explored_from(
    kind: FeatureKind,
    near: Point3<f64>,
    seed: u64,
    params: PatternParams,
) -> (Feature, usize, f64) {
    let plate = Plate::default();
    let mut rng = Pcg64::seed_from_u64(seed);
    let arm_params = ArmParams {
        seed,
        ..ArmParams::default()
    };
    let touching = TouchParams {
        stiffness: arm_params.stiffness,
        ..TouchParams::default()
    };
    let (angle, off) = (
        rng.random_range(0.0..std::f64::consts::TAU),
        rng.random_range(0.0..3e-3),
    );
    let flag = near
        + Vector3::new(
            off * f64::cos(angle),
            off * f64::sin(angle),
            rng.random_range(-0.5e-3..0.5e-3),
        );
    let mut arm = SimArm::new(
        &plate,
        arm_params.clone(),
        &at(&arm_params, [near.x, near.y, 30e-3]),
    )
    .unwrap();
    let mut search = Explorer::new(
        Some(kind),
        &flag,
        &Vector3::z_axis(),
        params,
        &plate_scan(1),
    )
    .unwrap();
    let peak = explored(&mut arm, &arm_params, &touching, &mut search);
    let found = search
        .found()
        .unwrap_or_else(|error| panic!("{kind:?} {flag}, seed {seed}: {error}"));
    println!(
        "{kind:?} off {:.1} mm: {} touches, {:.0} s, peak {peak:.1} N, as asked {}, {:.1?} um",
        off * 1e3,
        found.touches,
        arm.time(),
        found.is_as_asked,
        found.uncertainty.map(|u| u * 1e6)
    );
    (found.feature.unwrap(), found.touches, peak)
}

fn value(measured: &Option<MeasuredValue<f64>>) -> f64 {
    measured.as_ref().unwrap().value
}

/// The slot of the plate: from (18 14) to (32 14) mm with a radius of 3 mm, 5 mm deep.
#[test]
fn a_slot_is_found_from_one_click_and_measured() {
    let params = PatternParams {
        budget: 60,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    for seed in 0..4 {
        let (slot, touches, peak) = explored_from(
            FeatureKind::Slot,
            Point3::new(25e-3, 14e-3, TOP),
            seed,
            params,
        );
        let errors = [
            (slot.centre.value - Point3::new(25e-3, 14e-3, TOP)).norm(),
            value(&slot.width) - 6e-3,
            value(&slot.length) - 20e-3,
            value(&slot.depth) - 5e-3,
            slot.direction.unwrap().y,
        ];
        println!(
            "{touches} touches: {:.1?} um",
            errors.map(|error| error * 1e6)
        );
        assert!(
            errors[..4].iter().all(|error| error.abs() < 30e-6),
            "{errors:?}"
        );
        assert!(errors[4].abs() < 2e-3 && peak < 4.5, "{errors:?}, {peak}");
    }
}

/// The boss of the plate: at (47 25) mm, radius 5 mm, 4 mm high.
#[test]
fn a_boss_is_found_from_one_click_and_measured() {
    let params = PatternParams {
        budget: 60,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    for seed in 0..4 {
        let (boss, touches, peak) = explored_from(
            FeatureKind::Boss,
            Point3::new(47e-3, 25e-3, TOP + 4e-3),
            seed,
            params,
        );
        let errors = [
            (boss.centre.value - Point3::new(47e-3, 25e-3, TOP)).norm(),
            value(&boss.diameter) - 10e-3,
            value(&boss.depth) - 4e-3,
        ];
        println!(
            "{touches} touches: {:.1?} um",
            errors.map(|error| error * 1e6)
        );
        assert!(errors.iter().all(|error| error.abs() < 30e-6), "{errors:?}");
        assert!(peak < 4.5, "{peak}");
    }
}

/// The step of the plate: its upper edge runs along y at x = 60 mm, 3 mm above the ground.
#[test]
fn an_edge_is_found_from_one_click_and_measured() {
    let params = PatternParams {
        budget: 60,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    for seed in 0..4 {
        let (edge, touches, peak) = explored_from(
            FeatureKind::Edge,
            Point3::new(60e-3, 25e-3, TOP),
            seed,
            params,
        );
        let centre = edge.centre.value;
        let errors = [centre.x - 60e-3, centre.z - TOP, edge.axis.unwrap().value.x];
        println!(
            "{touches} touches: {:.1?} um",
            errors.map(|error| error * 1e6)
        );
        assert!(
            errors[..2].iter().all(|error| error.abs() < 30e-6) && errors[2].abs() < 3e-3,
            "{errors:?}"
        );
        assert!(peak < 4.5 && (centre.y - 25e-3).abs() < 5e-3, "{peak}");
    }
}

/// The top of the plate beside its slot.
#[test]
fn a_plane_is_measured() {
    let params = PatternParams {
        flag_radius: 5e-3,
        sigma: 10e-6,
        touch_sigma: 5e-6,
        ..PatternParams::default()
    };
    for seed in 0..4 {
        let (plane, touches, _) = explored_from(
            FeatureKind::Plane,
            Point3::new(45e-3, 9e-3, TOP),
            seed,
            params,
        );
        let normal = plane.axis.unwrap().value;
        let errors = [plane.centre.value.z - TOP, normal.x, normal.y];
        println!(
            "{touches} touches: {:.1?} um",
            errors.map(|error| error * 1e6)
        );
        assert!(
            errors[0].abs() < 15e-6 && normal.xy().norm() < 5e-3,
            "{errors:?}"
        );
    }
}

#[test]
fn where_no_edge_is_none_is_found() {
    let (plate, params) = (Plate::default(), ArmParams::default());
    let mut arm = SimArm::new(&plate, params.clone(), &at(&params, [45e-3, 8e-3, 30e-3])).unwrap();
    let flag = Point3::new(45e-3, 9e-3, TOP);
    let mut search = Explorer::new(
        Some(FeatureKind::Edge),
        &flag,
        &Vector3::z_axis(),
        PatternParams {
            touch_sigma: 5e-6,
            ..PatternParams::default()
        },
        &plate_scan(1),
    )
    .unwrap();
    explored(&mut arm, &params, &TouchParams::default(), &mut search);
    assert!(
        matches!(search.found(), Err(ExploreError::NoEdge { .. })),
        "{:?}",
        search.found()
    );
}
