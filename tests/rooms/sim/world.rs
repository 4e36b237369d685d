//! Named worlds: their draws, the told values, and the agreement of the messages with the draws.

use nalgebra::{Isometry3, Matrix3, Point2, UnitQuaternion};

use super::*;
use touchup::sim::{
    Bounds, DrawnWorld, Habit, PathParams, RasterDirection, RasterRegion, ScannerParams,
    SensorParams, SimWorld, Stroke, StylusParams, TipBending, ToldOff, Touch, TrueState, plan_mesh,
    raster, scan, touch,
};
use touchup::stylus::{Message, StampedPose, StampedWrench};

/// Rubs a piece of the plate's top for some seconds.
fn rub() -> Vec<Stroke> {
    let region = RasterRegion {
        frame_ov: Isometry3::identity(),
        low: Point2::new(0.030, 0.008),
        high: Point2::new(0.052, 0.042),
        floor: 0.0015,
        clear: 0.02,
    };
    raster(
        &region,
        RasterDirection::AlongX,
        &PathParams {
            pitch: 4e-3,
            ..PathParams::default()
        },
    )
    .unwrap()
}

/// Lines at the depth at which the ball touches.
fn lines_over(low: [f64; 3], high: [f64; 3]) -> Vec<Stroke> {
    let bounds = Bounds {
        min: low.into(),
        max: high.into(),
    };
    let hand = PathParams {
        pitch: 4e-3,
        ..PathParams::default()
    };
    plan_mesh(&Plate::default(), &bounds, &-Vector3::z_axis(), &hand).unwrap()
}

fn rubbed(stylus: &StylusParams) -> Touch {
    touch(&Plate::default(), &rub(), stylus, 5).unwrap()
}

fn split(messages: &[Message]) -> (Vec<StampedPose>, Vec<StampedWrench>) {
    let poses = messages.iter().filter_map(|m| {
        if let Message::Pose(pose) = m {
            Some(*pose)
        } else {
            None
        }
    });
    let wrenches = messages.iter().filter_map(|m| {
        if let Message::Wrench(wrench) = m {
            Some(*wrench)
        } else {
            None
        }
    });
    (poses.collect(), wrenches.collect())
}

fn seconds(stamp_ns: i64) -> f64 {
    (stamp_ns - SensorParams::default().start_ns) as f64 * 1e-9
}

fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<_> = values.into_iter().collect();
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Size of the true force at a time, s: linear between two moments.
fn force_at(moments: &[TrueState], t: f64) -> f64 {
    let at = (t * 1e3).clamp(0.0, (moments.len() - 2) as f64);
    let share = at.fract();
    moments[at as usize].force_o.norm() * (1.0 - share)
        + moments[at as usize + 1].force_o.norm() * share
}

/// Delay of the stamps of the wrenches, s: their forces fit best to the true ones there.
fn delay(moments: &[TrueState], wrenches: &[StampedWrench]) -> f64 {
    let misfit = |delay: f64| {
        rms(wrenches
            .iter()
            .map(|w| w.wrench.force.norm() - force_at(moments, seconds(w.stamp_ns) - delay)))
    };
    let candidates = (-400..=400).map(|i| f64::from(i) * 0.05e-3);
    candidates
        .min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))
        .unwrap()
}

#[test]
fn each_world_draws_within_its_ranges_and_another_truth_for_each_seed() {
    for world in SimWorld::ALL {
        assert_eq!(SimWorld::of_name(world.name()), Some(world));
        let drawn: Vec<_> = (0..40).map(|seed| world.draw(seed).unwrap()).collect();
        for (i, value) in drawn[0].values.iter().enumerate() {
            let of_seeds: Vec<_> = drawn.iter().map(|drawn| drawn.values[i]).collect();
            let [low, high] = value.range;
            for drawn in &of_seeds {
                assert!(
                    drawn.name == value.name && (low..=high).contains(&drawn.truth),
                    "{} {drawn:?}",
                    world.name()
                );
            }
            let (least, most) = of_seeds.iter().fold((f64::MAX, f64::MIN), |(a, b), v| {
                (a.min(v.truth), b.max(v.truth))
            });
            assert!(
                most - least > 0.6 * (high - low),
                "{}: {} is {least} to {most}",
                world.name(),
                value.name
            );
        }
        assert_eq!(drawn[3], world.draw(3).unwrap());
    }
    assert_eq!(SimWorld::of_name("judged"), None);
}

#[test]
fn no_world_draws_a_number_of_the_judged_cases() {
    let judged = [
        ("scan_edge", 2.4e-3),
        ("scan_noise", 0.6e-3),
        ("scan_bias", 0.3e-3),
        ("pose_noise", 0.05e-3),
        ("force_noise", 0.05),
        ("wrench_clock", 1.8e-3),
        ("friction", 0.15),
        ("stiffness", 20e3),
        ("tip_radius", 1.5e-3),
    ];
    for world in SimWorld::ALL {
        let values = world.draw(1).unwrap().values;
        for (name, number) in judged {
            let [low, high] = values
                .iter()
                .find(|value| value.name == name)
                .unwrap()
                .range;
            assert!(
                !(low..=high).contains(&number),
                "{} may draw {name} {number}",
                world.name()
            );
        }
    }
}

#[test]
fn what_is_told_errs_by_the_stated_deviations() {
    // root mean square of n draws over its deviation: 1 ± 3 / √(2 n)
    let holds = |name: &str, found: f64, std: f64, n: f64| {
        let share = found / std;
        assert!(
            (share - 1.0).abs() < 3.0 / (2.0 * n).sqrt(),
            "{name}: {share:.3} of the stated deviation"
        );
    };
    for world in SimWorld::ALL {
        let drawn: Vec<_> = (1..=200).map(|seed| world.draw(seed).unwrap()).collect();
        let stds = world.calibration_stds();
        let of = |f: &dyn Fn(&DrawnWorld) -> f64| rms(drawn.iter().map(f));
        let axes = |f: &dyn Fn(&DrawnWorld) -> Vector3<f64>| {
            rms(drawn.iter().flat_map(|d| f(d).data.0[0]))
        };
        holds(
            "radius",
            of(&|d| d.told.radius - d.stylus.radius),
            stds.radius,
            200.0,
        );
        holds(
            "stiffness",
            of(&|d| d.told.stiffness / d.stylus.stiffness - 1.0),
            stds.stiffness,
            200.0,
        );
        holds(
            "clock",
            of(&|d| d.told.wrench_clock - d.stylus.sensor.wrench_clock),
            stds.clock,
            200.0,
        );
        holds(
            "tip",
            axes(&|d| d.told.tip_offset - d.stylus.sensor.tip_offset),
            stds.tip_offset,
            600.0,
        );
        holds(
            "tare",
            axes(&|d| d.told.tare - d.stylus.sensor.tare),
            stds.tare,
            600.0,
        );
        // the told pose of the scan relative to the true one: shift and turn in the axes of the
        // scan
        let off = |d: &DrawnWorld| d.stylus.sensor.scan_to_space.inverse() * d.told.scan_to_space;
        holds(
            "shift",
            axes(&|d| off(d).translation.vector),
            stds.shift,
            600.0,
        );
        holds(
            "turn",
            axes(&|d| off(d).rotation.scaled_axis()),
            stds.turn,
            600.0,
        );
    }
}

#[test]
fn told_off_makes_the_errors_larger_and_leaves_the_truth() {
    let (usual, tripled) = (
        SimWorld::Ur.draw(7).unwrap(),
        SimWorld::Ur
            .draw_told_off(
                7,
                &ToldOff {
                    radius: 3.0,
                    ..ToldOff::all(1.0)
                },
            )
            .unwrap(),
    );
    assert_eq!(
        (usual.stylus, usual.scanner),
        (tripled.stylus, tripled.scanner)
    );
    let error = |drawn: &DrawnWorld| drawn.told.radius - drawn.stylus.radius;
    assert!((error(&tripled) / error(&usual) - 3.0).abs() < 1e-9);
    assert_eq!(usual.told.tare, tripled.told.tare);
    let exact = SimWorld::Ur.draw_told_off(7, &ToldOff::all(0.0)).unwrap();
    assert_eq!(
        (exact.told.radius, exact.told.tare),
        (usual.stylus.radius, usual.stylus.sensor.tare)
    );
    assert!(
        SimWorld::Ur
            .draw_told_off(7, &ToldOff::all(f64::NAN))
            .is_err()
    );
    assert!(SimWorld::Ur.draw_told_off(7, &ToldOff::all(-1.0)).is_err());
}

#[test]
fn bending_is_the_force_over_the_stiffness_tensor() {
    let axes = UnitQuaternion::from_euler_angles(0.3, -0.7, 1.1);
    let shares = Vector3::new(0.5, 0.8, 1.6);
    let bending = TipBending {
        stiffness: 12e3,
        shares,
        axes,
    };
    let (turn, force) = (
        UnitQuaternion::from_euler_angles(-1.2, 0.4, 0.9),
        Vector3::new(1.0, -2.0, 3.0),
    );
    let principal = (turn * axes).to_rotation_matrix().into_inner();
    let tensor: Matrix3<f64> =
        principal * Matrix3::from_diagonal(&(shares * 12e3)) * principal.transpose();
    assert!((tensor * bending.bend(&turn, &force) - force).norm() < 1e-12);

    // and the recorded pose is that of a stylus that does not bend, from the tracked origin
    let place = Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.4, 1.0, -0.6));
    let offset = Vector3::new(0.01, -0.02, 0.15);
    let sensor = SensorParams {
        scan_to_space: place,
        tip_offset: offset,
        ..SensorParams::ideal()
    };
    let stylus = StylusParams {
        stiffness_shares: shares,
        stiffness_axes: axes,
        sensor,
        ..StylusParams::default()
    };
    let touched = rubbed(&stylus);
    let (poses, _) = split(&touched.messages);
    let mut pressed = 0;
    for pose in poses {
        let moment = &touched.moments[(seconds(pose.stamp_ns) * 1e3).round() as usize];
        let ball = place.inverse() * (pose.pose_ot * Point3::from(offset));
        let frame = (moment.pose_ot.rotation * axes)
            .to_rotation_matrix()
            .into_inner();
        let tensor =
            frame * Matrix3::from_diagonal(&(shares * stylus.stiffness)) * frame.transpose();
        let given_way = moment.pose_ot.translation.vector - ball.coords;
        assert!(
            (tensor * given_way - moment.force_o).norm() < 1e-8,
            "{}",
            moment.t
        );
        pressed += usize::from(moment.force_o.norm() > 1.0);
    }
    assert!(pressed > 500, "{pressed}");
}

#[test]
fn messages_have_the_rates_delay_and_drift_of_the_clocks() {
    for (pose_rate, wrench_rate) in [(30.0, 125.0), (330.0, 2000.0)] {
        let sensor = SensorParams {
            pose_rate,
            wrench_rate,
            wrench_clock: 12e-3,
            ..SensorParams::ideal()
        };
        let touched = rubbed(&StylusParams {
            sensor,
            ..StylusParams::default()
        });
        let (poses, wrenches) = split(&touched.messages);
        let rate =
            |stamps: Vec<f64>| (stamps.len() - 1) as f64 / (stamps[stamps.len() - 1] - stamps[0]);
        let found = rate(poses.iter().map(|p| seconds(p.stamp_ns)).collect());
        assert!(
            (found / pose_rate - 1.0).abs() < 1e-6,
            "{found} poses in a second"
        );
        let found = rate(wrenches.iter().map(|w| seconds(w.stamp_ns)).collect());
        assert!(
            (found / wrench_rate - 1.0).abs() < 1e-6,
            "{found} wrenches in a second"
        );
        let found = delay(&touched.moments, &wrenches);
        assert!((found - 12e-3).abs() <= 0.05e-3, "{found}");
    }
    // a clock that gains 0.1 %: later by a thousandth of the time between the middles of both
    // halves
    let sensor = SensorParams {
        clock_rate: 1e-3,
        wrench_clock: -4e-3,
        ..SensorParams::ideal()
    };
    let touched = rubbed(&StylusParams {
        sensor,
        ..StylusParams::default()
    });
    let (_, wrenches) = split(&touched.messages);
    let quarter = wrenches.len() / 4;
    let (first, last) = (&wrenches[..quarter], &wrenches[3 * quarter..]);
    let between = (first.len() as f64 * 3.0) * 1e-3;
    let gained = delay(&touched.moments, last) - delay(&touched.moments, first);
    assert!(
        (gained - between * 1e-3).abs() < 1e-3,
        "{gained} in {between} s"
    );
}

#[test]
#[expect(clippy::too_many_lines)]
fn forces_have_the_drawn_tare_noise_steps_and_play() {
    let tare = Vector3::new(0.7, -0.3, 0.2);
    let sensor = SensorParams {
        tare,
        force_noise: 0.08,
        ..SensorParams::ideal()
    };
    let touched = rubbed(&StylusParams {
        sensor,
        ..StylusParams::default()
    });
    let (_, wrenches) = split(&touched.messages);
    let free = |w: &&StampedWrench| force_at(&touched.moments, seconds(w.stamp_ns)) == 0.0;
    let forces: Vec<_> = wrenches
        .iter()
        .filter(free)
        .map(|w| w.wrench.force)
        .collect();
    let n = forces.len() as f64;
    let mean = forces.iter().sum::<Vector3<f64>>() / n;
    assert!(
        n > 100.0 && (mean - tare).norm() < 5.0 * 0.08 * (3.0 / n).sqrt(),
        "{mean} of {n}"
    );
    let noise = rms(forces.iter().flat_map(|f| (f - mean).data.0[0]));
    assert!(
        (noise / 0.08 - 1.0).abs() < 4.0 / (6.0 * n).sqrt(),
        "{noise}"
    );

    let sensor = SensorParams {
        force_step: 0.25,
        ..SensorParams::ideal()
    };
    let (_, wrenches) = split(
        &rubbed(&StylusParams {
            sensor,
            ..StylusParams::default()
        })
        .messages,
    );
    let steps: Vec<_> = wrenches
        .iter()
        .flat_map(|w| (w.wrench.force / 0.25).data.0[0])
        .collect();
    assert!(steps.iter().all(|step| step.fract() == 0.0) && steps.iter().any(|step| *step > 4.0));

    let sensor = SensorParams {
        force_play: 0.3,
        ..SensorParams::ideal()
    };
    let touched = rubbed(&StylusParams {
        sensor,
        ..StylusParams::default()
    });
    let (_, wrenches) = split(&touched.messages);
    let late = wrenches.iter().flat_map(|w| {
        let moment = &touched.moments[(seconds(w.stamp_ns) * 1e3).round() as usize];
        (moment.pose_ot.rotation.inverse() * moment.force_o - w.wrench.force)
            .data
            .0[0]
    });
    let (least, most) = late.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    assert!(
        (least + 0.3).abs() < 1e-9 && (most - 0.3).abs() < 1e-9,
        "{least} to {most}"
    );
}

#[test]
fn poses_have_the_drawn_noise_and_a_slow_wander() {
    let error = |sensor: SensorParams| -> Vec<Vector3<f64>> {
        let exact = rubbed(&StylusParams {
            sensor: SensorParams::ideal(),
            ..StylusParams::default()
        });
        let noisy = rubbed(&StylusParams {
            sensor,
            ..StylusParams::default()
        });
        let of = |touch: &Touch| split(&touch.messages).0;
        let (exact, noisy) = (of(&exact), of(&noisy));
        let pairs = exact.iter().zip(&noisy);
        pairs
            .map(|(a, b)| b.pose_ot.translation.vector - a.pose_ot.translation.vector)
            .collect()
    };
    let white = error(SensorParams {
        pose_noise: 0.1e-3,
        ..SensorParams::ideal()
    });
    let n = 3.0 * white.len() as f64;
    let found = rms(white.iter().flat_map(|e| e.data.0[0]));
    assert!(
        (found / 0.1e-3 - 1.0).abs() < 4.0 / (2.0 * n).sqrt(),
        "{found}"
    );
    // five waves of 8 s within a factor of two: in the 2 ms between two poses no more than √(2/5) ·
    // 5 · 2π/4 s · 2 ms of its size
    let slow = error(SensorParams {
        pose_wander: 0.1e-3,
        ..SensorParams::ideal()
    });
    let steps = slow.windows(2).map(|w| (w[1] - w[0]).amax());
    assert!(steps.fold(0.0, f64::max) < 0.1e-3 * 10f64.sqrt() * PI / 2.0 * 2e-3 * 1.01);
    let spread = rms(slow.iter().flat_map(|e| e.data.0[0]));
    assert!((0.03e-3..0.2e-3).contains(&spread), "{spread}");
}

#[test]
fn friction_varies_over_the_part_and_is_the_same_at_the_same_place() {
    let stylus = StylusParams {
        friction: 0.3,
        friction_variation: 0.25,
        friction_length: 3e-3,
        ..StylusParams::default()
    };
    let touched = rubbed(&stylus);
    let seen: Vec<(Point3<f64>, f64)> = touched
        .moments
        .windows(2)
        .filter_map(|w| {
            let [contact] = w[1].contacts[..] else {
                return None;
            };
            let moved = (w[1].pose_ot.translation.vector - w[0].pose_ot.translation.vector) * 1e3;
            let along = moved - contact.normal * moved.dot(&contact.normal);
            let normal = w[1].force_o.dot(&contact.normal);
            let across = (w[1].force_o - contact.normal * normal).norm();
            // far above the speed of undecided friction, 1 mm/s: (v + 1 mm/s) / v removes that
            (along.norm() > 20e-3).then(|| {
                (
                    contact.point,
                    across / normal * (along.norm() + 1e-3) / along.norm(),
                )
            })
        })
        .collect();
    let mean = seen.iter().map(|s| s.1).sum::<f64>() / seen.len() as f64;
    let variation = rms(seen.iter().map(|s| s.1 / mean - 1.0));
    println!(
        "{} places, friction {mean:.3}, varies by {variation:.3}",
        seen.len()
    );
    assert!(seen.len() > 1000 && (mean - 0.3).abs() < 0.05 && (0.15..0.35).contains(&variation));
    // over 0.1 mm it changes by no more than a tenth of its mean
    let near = seen
        .windows(2)
        .filter(|w| (w[0].0 - w[1].0).norm() < 0.1e-3);
    assert!(near.map(|w| (w[0].1 - w[1].1).abs()).fold(0.0, f64::max) < 0.03);
}

#[test]
fn scan_has_the_drawn_scale_and_missing_places() {
    let plate = Plate::default();
    let usual = ScannerParams {
        noise: 0.0,
        bias: 0.0,
        rigid_shift: 0.0,
        rigid_turn: 0.0,
        ..ScannerParams::default()
    };
    let size = |mesh: &TriMesh| {
        let xs: Vec<f64> = triangles(mesh).iter().flatten().map(|p| p.x).collect();
        xs.iter().copied().fold(f64::MIN, f64::max) - xs.iter().copied().fold(f64::MAX, f64::min)
    };
    let exact = scan(&plate, &usual).unwrap();
    let large = scan(
        &plate,
        &ScannerParams {
            scale_error: 8e-3,
            ..usual
        },
    )
    .unwrap();
    assert!((size(&large) / size(&exact) - 1.008).abs() < 1e-9);
    let holed = scan(
        &plate,
        &ScannerParams {
            missing: 6,
            missing_radius: 5e-3,
            ..usual
        },
    )
    .unwrap();
    let gone = exact.face_count() - holed.face_count();
    let area = |mesh: &TriMesh| {
        mesh.faces()
            .map(|(face, _)| mesh.double_area_normal(face).norm() / 2.0)
            .sum::<f64>()
    };
    let lost = area(&exact) - area(&holed);
    // no more than six discs with a row of triangles around each, no less than a sixth of one
    let disc = |r: f64| PI * r * r;
    println!("{gone} faces, {:.0} mm²", lost * 1e6);
    assert!(lost < 6.0 * disc(5e-3 + 3.0 * usual.edge) && lost > disc(5e-3) / 6.0);
}

#[test]
fn a_hand_that_taps_touches_often_and_one_that_scrubs_goes_back() {
    let lines = lines_over([0.030, 0.010, 0.0], [0.045, 0.030, 0.012]);
    let touched = |habit: Habit| {
        let touch = touch(
            &Plate::default(),
            &habit.led(lines.clone()),
            &StylusParams::default(),
            5,
        )
        .unwrap();
        let pressed: Vec<bool> = touch
            .moments
            .iter()
            .map(|moment| !moment.contacts.is_empty())
            .collect();
        let contacts = pressed.windows(2).filter(|w| w[0] != w[1] && w[1]).count();
        (contacts, pressed.iter().filter(|p| **p).count())
    };
    let [(slides, slid), (scrubs, scrubbed), (taps, _)] =
        [Habit::Slide, Habit::Scrub, Habit::Tap].map(touched);
    println!(
        "contacts: {slides} sliding ({slid} ms), {scrubs} scrubbing ({scrubbed} ms), {taps} tapping"
    );
    assert!(
        taps > 40 && taps > 3 * slides,
        "{taps} taps, {slides} contacts sliding"
    );
    // forth by 10 mm, back by 6: four times the length
    assert!(scrubbed > 2 * slid, "{scrubbed} ms against {slid}");
}

#[test]
fn a_world_gives_the_same_messages_for_the_same_seed() {
    let plate = Plate::default();
    let messages = |seed: u64| {
        let drawn = SimWorld::OpticalTracker.draw(seed).unwrap();
        drawn
            .touch(&plate, &drawn.strokes(&plate, 5.0).unwrap())
            .unwrap()
            .messages
    };
    let first = messages(2);
    assert!(first == messages(2) && first != messages(3) && first.len() > 500);
}
