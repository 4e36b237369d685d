//! A stylus on a known surface: the path of the ball, its contacts, its stream.

use super::*;
use touchup::sim::{
    Habit, PathParams, RasterDirection, RasterRegion, SensorParams, Stroke, StylusParams, Touch,
    TrueState, TruthShape, plan_demo, plan_mesh, plan_sides, plan_waterlines, push_ball, raster,
    touch,
};
use touchup::stylus::{Message, StampedPose, StampedWrench};

fn demo_touch(params: &StylusParams, seed: u64) -> Touch {
    let plate = Plate::default();
    touch(
        &plate,
        &plan_demo(&plate, &PathParams::default()).unwrap(),
        params,
        seed,
    )
    .unwrap()
}

fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

fn split(messages: &[Message]) -> (Vec<StampedPose>, Vec<StampedWrench>) {
    let (mut poses, mut wrenches) = (Vec::new(), Vec::new());
    for message in messages {
        match message {
            Message::Pose(pose) => poses.push(*pose),
            Message::Wrench(wrench) => wrenches.push(*wrench),
        }
    }
    (poses, wrenches)
}

#[test]
fn ball_never_enters_the_part_and_force_stays_in_the_friction_cone() {
    let plate = Plate::default();
    let params = StylusParams::default();
    let touched = demo_touch(&params, 3);
    let cone = (params.friction.powi(2) + 1.0).sqrt().recip();
    let mut seen = [0; 4];
    for m in &touched.moments {
        let centre = Point3::from(m.pose_ot.translation.vector);
        let gap = plate.signed_distance(&centre) - params.radius;
        assert!(gap > -1e-9, "{gap} at {}", m.t);
        seen[m.contacts.len().min(3)] += 1;
        assert_eq!(m.contacts.is_empty(), m.force_o.norm() == 0.0);
        for c in &m.contacts {
            assert!(plate.signed_distance(&c.point).abs() < 1e-12);
            let off = (centre - c.point).norm() - params.radius;
            assert!(off.abs() < 1e-9, "{off} {:?}", m.contacts);
        }
        if let [only] = m.contacts[..] {
            assert!(m.force_o.dot(&only.normal) >= m.force_o.norm() * cone - 1e-12);
        }
    }
    // one contact mostly, two in corners and at rims
    println!("contacts at once: {seen:?}");
    assert!(seen[1] > 20_000 && seen[2] > 500, "{seen:?}");
}

#[test]
fn demo_lasts_a_minute_and_looks_like_a_hand() {
    let touched = demo_touch(&StylusParams::default(), 1);
    let n = touched.moments.len() as f64;
    assert!((45.0..90.0).contains(&(n * 1e-3)), "{n} ms");
    let mut forces: Vec<_> = touched
        .moments
        .iter()
        .map(|m| m.force_o.norm())
        .filter(|f| *f > 0.0)
        .collect();
    let share = forces.len() as f64 / n;
    let [p5, p50, p99] = [0.05, 0.5, 0.99].map(|q| quantile(&mut forces, q));
    println!("{n} ms, contact {share:.3}, force {p5:.2} {p50:.2} {p99:.2}");
    assert!((0.6..0.95).contains(&share));
    assert!((2.0..3.0).contains(&p50) && p99 < 4.2);
    let tilt = |m: &TrueState| {
        (m.pose_ot.rotation * Vector3::z())
            .angle(&Vector3::z())
            .to_degrees()
    };
    let mut tilts: Vec<_> = touched.moments.iter().map(tilt).collect();
    assert!((3.0..9.0).contains(&quantile(&mut tilts, 0.5)) && quantile(&mut tilts, 1.0) < 25.0);
    let path: Vec<_> = touched
        .moments
        .iter()
        .map(|m| m.pose_ot.translation.vector)
        .collect();
    let mut speeds: Vec<_> = path
        .windows(2)
        .map(|w| (w[1] - w[0]).norm() * 1e3)
        .collect();
    assert!(
        quantile(&mut speeds, 1.0) < 0.11,
        "{}",
        quantile(&mut speeds, 1.0)
    );
}

#[test]
fn the_demo_touches_every_feature_and_leaves_the_far_end() {
    let plate = Plate::default();
    let touched = demo_touch(&StylusParams::default(), 1);
    let contacts = |test: &dyn Fn(&Point3<f64>) -> bool| {
        touched
            .moments
            .iter()
            .flat_map(|m| &m.contacts)
            .filter(|c| test(&c.point))
            .count()
    };
    for f in plate.features() {
        let radius = match f.shape {
            TruthShape::Hole { diameter, .. } | TruthShape::Boss { diameter, .. } => diameter / 2.0,
            TruthShape::Slot { length, .. } => length / 2.0,
            TruthShape::Step { .. } => continue,
        };
        let inside = |p: &Point3<f64>| {
            (p - f.centre).xy().norm() < radius + 1e-6 && (p.z - f.centre.z).abs() > 1e-3
        };
        println!("{}: {} contacts inside", f.name, contacts(&inside));
        assert!(contacts(&inside) > 500, "{}", f.name);
    }
    assert!(
        contacts(&|p| p.x > 0.0605 && (p.z - 9e-3).abs() < 1e-6) > 500,
        "the step's tread"
    );
    assert_eq!(contacts(&|p| p.x > 0.07), 0, "the far end stays untouched");
}

#[test]
fn stream_has_the_stated_rates_noise_and_faults() {
    let params = StylusParams::default();
    let touched = demo_touch(&params, 5);
    let (mut poses, mut wrenches) = split(&touched.messages);
    let seconds = touched.moments.len() as f64 * 1e-3;
    let swapped = wrenches
        .windows(2)
        .filter(|w| w[1].stamp_ns < w[0].stamp_ns)
        .count() as f64
        / wrenches.len() as f64;
    // an exponential delay of 0.4 ms overtakes the next of 1 ms later in e^(−2.5)/2 = 4 % of cases,
    // late ones on top
    assert!((0.03..0.06).contains(&swapped), "{swapped}");
    poses.sort_by_key(|p| p.stamp_ns);
    wrenches.sort_by_key(|w| w.stamp_ns);
    for (count, rate) in [(poses.len(), 500.0), (wrenches.len(), 1000.0)] {
        let kept = count as f64 / (seconds * rate);
        assert!((0.97..0.998).contains(&kept), "{kept}");
    }
    let gaps: Vec<_> = wrenches
        .windows(2)
        .map(|w| (w[1].stamp_ns - w[0].stamp_ns) as f64 * 1e-9)
        .collect();
    let silent = gaps.iter().filter(|g| **g > 4.5e-3).count();
    assert!((1..20).contains(&silent), "{silent}");
    assert!(gaps.iter().all(|g| *g > 0.0 && *g < 0.2));
    // residuals against the truth at the same tick
    let moment = |stamp: i64, late: f64| {
        let tick = (((stamp - params.sensor.start_ns) as f64 * 1e-9 - late) / 1e-3)
            .round()
            .max(0.0) as usize;
        &touched.moments[tick.min(touched.moments.len() - 1)]
    };
    let shift = |p: &StampedPose| {
        let m = moment(p.stamp_ns, 0.0);
        p.pose_ot.translation.vector - (m.pose_ot.translation.vector - m.force_o / params.stiffness)
    };
    let rms = (poses.iter().map(|p| shift(p).norm_squared()).sum::<f64>()
        / (3.0 * poses.len() as f64))
        .sqrt();
    assert!((rms / 0.05e-3 - 1.0).abs() < 0.03, "{rms}");
    let turn = |p: &StampedPose| {
        p.pose_ot
            .rotation
            .angle_to(&moment(p.stamp_ns, 0.0).pose_ot.rotation)
    };
    let turned =
        (poses.iter().map(|p| turn(p).powi(2)).sum::<f64>() / (3.0 * poses.len() as f64)).sqrt();
    assert!((turned.to_degrees() / 0.1 - 1.0).abs() < 0.03, "{turned}");
    let excess = |w: &StampedWrench| {
        let m = moment(w.stamp_ns, params.sensor.wrench_clock);
        w.wrench.force - m.pose_ot.rotation.inverse() * m.force_o
    };
    let forces: Vec<_> = wrenches.iter().map(excess).collect();
    // between successive residuals the slow bias cancels: √2 times the noise remains
    let n = 3.0 * (forces.len() - 1) as f64;
    let noise = (forces
        .windows(2)
        .map(|f| (f[1] - f[0]).norm_squared())
        .sum::<f64>()
        / (2.0 * n))
        .sqrt();
    assert!((noise / 0.05 - 1.0).abs() < 0.05, "{noise}");
    let bias = (forces.iter().map(|f| f.norm_squared()).sum::<f64>() / n - noise * noise).sqrt();
    assert!((0.02..0.09).contains(&bias), "{bias}");
}

#[test]
fn ideal_stream_is_the_truth_in_order() {
    let params = StylusParams {
        friction: 0.0,
        sensor: SensorParams::ideal(),
        ..StylusParams::default()
    };
    let touched = demo_touch(&params, 2);
    let (poses, wrenches) = split(&touched.messages);
    assert_eq!(wrenches.len(), touched.moments.len());
    for (i, (w, m)) in wrenches.iter().zip(&touched.moments).enumerate() {
        assert_eq!(w.stamp_ns, params.sensor.start_ns + i as i64 * 1_000_000);
        assert!((m.pose_ot.rotation * w.wrench.force - m.force_o).norm() < 1e-12);
    }
    for (i, p) in poses.iter().enumerate() {
        let m = &touched.moments[2 * i];
        // the bend F/k of the tip displaces the ball's centre
        let centre = p.pose_ot.translation.vector + m.force_o / 20e3;
        assert!((centre - m.pose_ot.translation.vector).norm() < 1e-15);
        assert_eq!(
            p.stamp_ns,
            params.sensor.start_ns + 2 * i as i64 * 1_000_000
        );
    }
}

#[test]
fn same_seed_same_stream() {
    let params = StylusParams::default();
    let (a, b, c) = (
        demo_touch(&params, 7),
        demo_touch(&params, 7),
        demo_touch(&params, 8),
    );
    assert!(a == b && a != c);
}

#[test]
fn ball_comes_to_rest_at_the_geometric_equilibrium() {
    let plate = Plate::default();
    let mm = |x: f64, y: f64, z: f64| Point3::new(x, y, z) * 1e-3;
    let rest = |from, to| push_ball(&plate, &from, &to, 1.5e-3);
    // onto the top
    let (x, c) = rest(mm(5., 5., 13.55), mm(5.02, 5., 13.45));
    assert!(
        (x - mm(5.02, 5., 13.5)).norm() < 1e-12
            && c.len() == 1
            && (c[0].held_back - 0.05e-3).abs() < 1e-12
    );
    // into the inner corner of the step: tread and riser
    let (x, c) = rest(mm(61.52, 20., 10.52), mm(61.45, 20., 10.48));
    assert!((x - mm(61.5, 20., 10.5)).norm() < 1e-12 && c.len() == 2);
    // over the edge of the step: on the circle about the edge, towards the unobstructed place
    let (edge, to) = (mm(60., 20., 12.), mm(60.9, 20., 13.1));
    let (x, c) = rest(mm(61.0, 20., 13.2), to);
    let expected = edge + (to - edge).normalize() * 1.5e-3;
    assert!((x - expected).norm() < 1e-11 && c.len() == 1 && (c[0].point - edge).norm() < 1e-11);
    // against the wall of the through-hole
    let (axis, to) = (mm(16., 36., 6.), mm(18.6, 36.1, 6.));
    let (x, _) = rest(mm(18.4, 36., 6.), to);
    assert!((x - (axis + (to - axis).normalize() * 2.5e-3)).norm() < 1e-11);
    // nothing blocks it
    let (x, c) = rest(mm(5., 5., 20.), mm(5., 5., 19.9));
    assert!(x == mm(5., 5., 19.9) && c.is_empty());
}

/// A tip that stands still above the plate.
fn standing(z: f64) -> [Stroke; 1] {
    [Stroke {
        points: vec![Point3::new(0.01, 0.01, z)],
        speed: 0.05,
        press: None,
    }]
}

#[test]
fn senseless_paths_and_tips_are_refused() {
    let with = |radius: f64| StylusParams {
        radius,
        ..StylusParams::default()
    };
    let run = |path: &[Stroke], params: &StylusParams| {
        touch(&Plate::default(), path, params, 0).unwrap_err()
    };
    assert!(matches!(
        run(&standing(0.02), &with(f64::NAN)),
        SimError::BadParameter { .. }
    ));
    assert!(matches!(
        run(&standing(0.02), &with(-1.0)),
        SimError::BadParameter { .. }
    ));
    assert!(matches!(
        run(&standing(0.011), &with(1.5e-3)),
        SimError::StartsInside { .. }
    ));
    assert_eq!(run(&[], &with(1.5e-3)), SimError::EmptyPath);
    assert!(matches!(
        run(&standing(f64::NAN), &with(1.5e-3)),
        SimError::BadParameter { .. }
    ));
}

#[test]
fn senseless_stylus_settings_are_refused() {
    let base = StylusParams::default();
    for params in [
        StylusParams {
            stiffness: 1e-300,
            ..base
        },
        StylusParams {
            stiffness: 3.9,
            ..base
        },
        StylusParams {
            friction: 1e300,
            ..base
        },
        StylusParams {
            force_range: [1.0, 1e4],
            ..base
        },
        StylusParams { stray: 1e9, ..base },
        StylusParams {
            sensor: SensorParams {
                pose_noise: 1e9,
                ..base.sensor
            },
            ..base
        },
        StylusParams {
            sensor: SensorParams {
                lost: 1.1,
                ..base.sensor
            },
            ..base
        },
    ] {
        let error = touch(&Plate::default(), &standing(0.02), &params, 0).unwrap_err();
        let message = error.to_string();
        assert!(message.len() < 120, "{message}");
    }
    // 4 N bend this one by 1 m, a permitted value
    touch(
        &Plate::default(),
        &standing(0.02),
        &StylusParams {
            stiffness: 4.0,
            ..base
        },
        0,
    )
    .unwrap();
}

#[test]
fn senseless_paths_are_refused() {
    let plate = Plate::default();
    let base = PathParams::default();
    let far = |x: f64| RasterRegion {
        frame_ov: nalgebra::Isometry3::identity(),
        low: nalgebra::Point2::origin(),
        high: nalgebra::Point2::new(x, 0.01),
        floor: 0.0,
        clear: 0.02,
    };
    for pitch in [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e-300, 0.9e-7] {
        let params = PathParams { pitch, ..base };
        assert!(
            matches!(
                raster(&far(0.01), RasterDirection::AlongX, &params),
                Err(SimError::BadParameter { .. })
            ),
            "{pitch}"
        );
        assert!(plan_demo(&plate, &params).is_err(), "{pitch}");
    }
    for x in [-0.01, f64::NAN, f64::INFINITY] {
        assert!(
            matches!(
                raster(&far(x), RasterDirection::AlongX, &base),
                Err(SimError::BadParameter { .. })
            ),
            "{x}"
        );
    }
    let view = -Vector3::z_axis();
    for params in [
        PathParams {
            pitch: f64::NAN,
            ..base
        },
        PathParams {
            longest: 0.0,
            ..base
        },
    ] {
        assert!(matches!(
            plan_mesh(&plate, &plate.bounds(), &view, &params),
            Err(SimError::BadParameter { .. })
        ));
    }
    // lines every 2 mm of 10 mm: six, of two ends each
    assert_eq!(
        raster(&far(0.02), RasterDirection::AlongX, &base).unwrap()[1]
            .points
            .len(),
        12
    );
}

#[test]
fn ball_slides_over_any_mesh_from_any_side() {
    let mesh = Plate::default().mesh(0.05e-3).unwrap();
    let surface = MeshSurface::new(&mesh).unwrap();
    for view in [-Vector3::z_axis(), Vector3::z_axis(), Vector3::x_axis()] {
        let params = PathParams {
            longest: 8.0,
            ..PathParams::default()
        };
        let path = plan_mesh(&surface, &surface.bounds(), &view, &params).unwrap();
        let touched = touch(&surface, &path, &StylusParams::default(), 4).unwrap();
        // beside the part, beyond its edge, the ball is free
        let bounds = surface.bounds();
        let is_over = |m: &&TrueState| {
            let p = m.pose_ot.translation.vector;
            (0..3).all(|i| view[i] != 0.0 || (bounds.min[i]..=bounds.max[i]).contains(&p[i]))
        };
        let (over, beside): (Vec<_>, Vec<_>) = touched.moments.iter().partition(is_over);
        let contacts = over.iter().filter(|m| !m.contacts.is_empty()).count();
        let share = contacts as f64 / over.len() as f64;
        println!(
            "{} ms over the part, {share:.2} in contact, {} ms beside it",
            over.len(),
            beside.len()
        );
        assert!(share > 0.5 && beside.len() > 1000);
        for m in &touched.moments {
            let centre = Point3::from(m.pose_ot.translation.vector);
            assert!(surface.signed_distance(&centre) > 1.5e-3 - 1e-9);
            assert!(
                m.contacts
                    .iter()
                    .all(|c| surface.signed_distance(&c.point).abs() < 1e-9)
            );
        }
        // the hand comes from the viewpoint, and so does the force
        let towards = touched
            .moments
            .iter()
            .map(|m| m.force_o)
            .sum::<Vector3<f64>>()
            .normalize();
        assert!(towards.dot(&view) < -0.8, "{towards}");
    }
}

// The ball's centre runs a radius less the lean away from the wall: at R − (r − lean) of the axis
// of a hole of radius R.
#[test]
fn waterlines_go_around_every_hole_that_lets_the_ball_in() {
    let plate = Plate::default();
    let hand = PathParams::default();
    let runs = plan_waterlines(&plate, &plate.bounds(), &-Vector3::z_axis(), &hand).unwrap();
    let features = plate.features();
    let holes: Vec<_> = features
        .iter()
        .filter_map(|feature| match feature.shape {
            TruthShape::Hole { diameter, .. } => Some((feature.centre, diameter / 2.0)),
            _ => None,
        })
        .collect();
    assert_eq!(holes.len(), 2);
    for (opening, radius) in holes {
        let (centre, top) = (opening.xy(), opening.z);
        let away = radius - hand.radius + hand.lean;
        let is_in = |p: &Point3<f64>| p.z < top && (p.xy() - centre).norm() < radius;
        let of_hole: Vec<&Stroke> = runs
            .iter()
            .filter(|run| run.points.len() > 9 && run.points.iter().all(is_in))
            .collect();
        assert!(
            of_hole.len() > 1,
            "{} runs at different heights",
            of_hole.len()
        );
        for run in &of_hole {
            let off = run
                .points
                .iter()
                .map(|p| ((p.xy() - centre).norm() - away).abs())
                .fold(0.0, f64::max);
            // the chords of the grid that defines the line
            assert!(off < 0.06e-3, "{off}");
        }
        let turns = of_hole[0]
            .points
            .iter()
            .map(|p| (p.xy() - centre).y.atan2((p.xy() - centre).x).to_degrees() as i32 / 30);
        assert!(
            turns.collect::<std::collections::BTreeSet<_>>().len() >= 11,
            "all around"
        );
    }
    let time: f64 = runs
        .iter()
        .filter(|run| run.points.len() > 9)
        .map(seconds)
        .sum();
    assert!(time <= hand.longest, "{time} s");
}

fn seconds(run: &Stroke) -> f64 {
    run.points
        .windows(2)
        .map(|ends| (ends[1] - ends[0]).norm())
        .sum::<f64>()
        / run.speed
}

#[test]
fn from_several_sides_the_ball_never_goes_through_the_part() {
    let plate = Plate::default();
    let hand = PathParams {
        longest: 15.0,
        ..PathParams::default()
    };
    let sides = [Vector3::z_axis(), -Vector3::z_axis(), Vector3::y_axis()];
    let path = plan_sides(&plate, &sides, Habit::Slide, &hand).unwrap();
    let free = path
        .iter()
        .filter(|stroke| stroke.press.is_none() && stroke.points.len() == 3);
    let farthest = |stroke: &Stroke| {
        stroke
            .points
            .iter()
            .map(|p| plate.signed_distance(p))
            .fold(f64::MAX, f64::min)
    };
    assert_eq!(free.clone().count(), 2, "between the sides");
    assert!(
        free.map(farthest).all(|gap| gap > hand.radius),
        "and around the part"
    );
    // the path presses each side from its own direction
    for side in sides {
        assert!(path.iter().any(|stroke| {
            stroke
                .press
                .is_some_and(|press| (*press + *side).norm() < 1e-9)
        }));
    }
}

/// In a slot that has a floor the hand wants to go on through its wall, then to a place below the
/// plate.
#[test]
fn a_ball_that_is_caught_is_taken_out_and_around_the_part() {
    let plate = Plate::default();
    let features = plate.features();
    let slot = features
        .iter()
        .find(|feature| matches!(feature.shape, TruthShape::Slot { .. }))
        .unwrap()
        .centre;
    let still = |points: Vec<Point3<f64>>| Stroke {
        points,
        speed: 0.04,
        press: None,
    };
    let at = |x: f64, y: f64, z: f64| slot + Vector3::new(x, y, z) * 1e-3;
    let through_the_wall = (0..200)
        .map(|i| at(0.0, 0.1 * f64::from(i), -1.0))
        .collect();
    let below = [
        Point3::new(slot.x, slot.y, -9e-3),
        Point3::new(slot.x, slot.y, -6e-3),
    ];
    let path = [
        still(vec![at(0.0, 0.0, 15.0), at(0.0, 0.0, -1.0)]),
        still(through_the_wall),
        // not from its place in the wall
        still(vec![at(0.0, 0.0, -1.0), at(0.0, 0.0, 15.0)]),
        still(below.to_vec()),
    ];
    let params = StylusParams {
        stray: 0.0,
        ..StylusParams::default()
    };
    let touched = touch(&plate, &path, &params, 1).unwrap();
    let centre = |m: &TrueState| Point3::from(m.pose_ot.translation.vector);
    let deepest = touched
        .moments
        .iter()
        .map(|m| plate.signed_distance(&centre(m)))
        .fold(f64::MAX, f64::min);
    assert!(deepest > params.radius - 1e-9, "{deepest}");
    let off = (centre(touched.moments.last().unwrap()) - below[1]).norm();
    assert!(off < 1.5e-3, "{off} m from where it was to go");
    let seconds = touched.moments.len() as f64 * 1e-3;
    assert!(seconds < 20.0, "caught for long: {seconds} s");
}
