//! Sound recordings with mistakes put in, and the cause that the finding names.

use crate::common::{grid, within};
use crate::full::either;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::diagnose::{InputCause, InputFinding, InputMonitor, InputMonitorParams};
use touchup::mesh::FaceTree;
use touchup::sim::{
    Habit, INPUT_MISTAKES, InputMistake, PathParams, Plate, ScannerParams, SensorParams,
    StylusParams, ToldRecording, plan_demo, plan_sides, scan, touch,
};
use touchup::stylus::{
    CompensatorParams, ContactEstimator, ContactEstimatorParams, Message, Placement, StampedPose,
    StampedWrench, SyncParams, Synchroniser, TipParams, TipShape, Wrench,
};

/// Another stylus, sensor and scan for each seed.
fn simulated(seed: u64) -> ToldRecording {
    let radius = [1.5e-3, 0.8e-3, 3e-3, 2e-3][seed as usize % 4];
    let stiffness = [20e3, 200e3, 10e3, 50e3, 15e3][seed as usize % 5];
    let times = [1.0, 0.3, 1.5][seed as usize % 3];
    let friction = [0.15, 0.05, 0.3, 0.2][seed as usize % 4];
    let plate = Plate::default();
    let usual = SensorParams::default();
    let sensor = SensorParams {
        pose_noise: usual.pose_noise * times,
        force_noise: usual.force_noise * times,
        ..usual
    };
    let stylus = StylusParams {
        radius,
        stiffness,
        friction,
        sensor,
        ..StylusParams::default()
    };
    let path = plan_demo(
        &plate,
        &PathParams {
            radius,
            ..PathParams::default()
        },
    )
    .unwrap();
    let messages = touch(&plate, &path, &stylus, seed).unwrap().messages;
    let usual = ScannerParams::default();
    let scan = scan(
        &plate,
        &ScannerParams {
            noise: usual.noise * times,
            seed,
            ..usual
        },
    )
    .unwrap();
    ToldRecording {
        scan,
        messages,
        tip: TipParams {
            radius,
            stiffness: Some(stiffness),
        },
    }
}

fn findings(input: &ToldRecording) -> Vec<InputFinding> {
    let sync = SyncParams::default();
    let contact = ContactEstimatorParams::new(input.tip);
    let mut monitor = InputMonitor::new(InputMonitorParams {
        compensator: CompensatorParams::default(),
        tip: input.tip,
        stiffness_share: 0.02,
        place_sigma: 2e-6,
        shape: TipShape::Ball,
        scan_noise: 0.0,
        placement: Placement::default(),
        gate: contact.gate,
        sync,
    })
    .unwrap();
    let (mut sync, mut contacts) = (
        Synchroniser::new(sync).unwrap(),
        ContactEstimator::new(contact).unwrap(),
    );
    let mut take = |sync: &mut Synchroniser, monitor: &mut InputMonitor| {
        while let Some(sample) = sync.next_sample() {
            monitor.sample(&sample);
            if let Ok(contact) = contacts.observe(&sample) {
                monitor.contact(contact);
            }
        }
    };
    for message in &input.messages {
        monitor.message(message);
        sync.push(*message);
        take(&mut sync, &mut monitor);
    }
    sync.finish();
    take(&mut sync, &mut monitor);
    monitor.findings(&input.scan, &FaceTree::new(&input.scan))
}

/// Mistakes other than the first and sure finding, and their total.
fn missed(seed: u64) -> (Vec<&'static str>, usize) {
    let sound = simulated(seed);
    assert_eq!(findings(&sound), [], "seed {seed}");
    let is_named = |mistake: &&InputMistake| {
        let found = findings(&mistake.made_of(&sound));
        found
            .first()
            .is_some_and(|first| first.cause == mistake.cause && first.is_sure)
    };
    let missed = INPUT_MISTAKES.iter().filter(|mistake| !is_named(mistake));
    (
        missed.map(|mistake| mistake.name).collect(),
        INPUT_MISTAKES.len(),
    )
}

#[test]
fn sound_input_raises_no_alarm_and_each_mistake_is_named() {
    for seed in 3..=either(3, 4) {
        assert_eq!(missed(seed).0, [""; 0], "seed {seed}");
    }
}

/// A ball as wide as the holes of the plate (seeds 2, 6, 10, …) rests on their rims: there neither
/// its free motion nor its stop is clear.
// The plate's scan is open below, and a hand that reaches it from its sides touches mostly beyond
// the scan: there a signed distance says nothing.
#[test]
fn a_part_touched_on_all_sides_of_an_open_scan_raises_no_alarm() {
    let plate = Plate::default();
    let hand = PathParams {
        radius: 3e-3,
        longest: 20.0,
        ..PathParams::default()
    };
    let sides = [
        Vector3::x_axis(),
        -Vector3::x_axis(),
        Vector3::y_axis(),
        -Vector3::y_axis(),
    ];
    let path = plan_sides(&plate, &sides, Habit::Slide, &hand).unwrap();
    let stylus = StylusParams {
        radius: hand.radius,
        ..StylusParams::default()
    };
    let messages = touch(&plate, &path, &stylus, 4).unwrap().messages;
    let scan = scan(
        &plate,
        &ScannerParams {
            seed: 4,
            ..ScannerParams::default()
        },
    )
    .unwrap();
    let tip = TipParams {
        radius: hand.radius,
        stiffness: Some(stylus.stiffness),
    };
    let found = findings(&ToldRecording {
        scan,
        messages,
        tip,
    });
    assert!(found.iter().all(|finding| !finding.is_sure), "{found:?}");
}

#[test]
#[ignore = "a slow proof"]
fn over_twenty_seeds_nine_of_ten_mistakes_are_named() {
    let (mut all, mut lost) = (0, 0);
    for seed in 1..=20 {
        let (missed, count) = missed(seed);
        println!(
            "| {seed} | {} of {count} | {} |",
            count - missed.len(),
            missed.join(", ")
        );
        (all, lost) = (all + count, lost + missed.len());
    }
    assert!(10 * lost <= all, "{lost} of {all}");
}

/// Poses and wrenches of one clock, 1 ms apart.
///
/// - `at`: of a time, s: the recorded pose, and the force on the stylus in its own axes, N.
fn recorded(seconds: f64, at: impl Fn(f64) -> (Isometry3<f64>, Vector3<f64>)) -> Vec<Message> {
    let of = |ms: i64| {
        let stamp_ns = ms * 1_000_000;
        let (pose_ot, force) = at(ms as f64 * 1e-3);
        // pseudo-random noise with a period longer than any recording
        let noise =
            Vector3::new(0.9, 1.7, 2.3).map(|turn| 0.01 * (turn * (ms * ms % 9973) as f64).sin());
        let wrench = Wrench {
            force: force + noise,
            torque: Vector3::zeros(),
        };
        [
            Message::Pose(StampedPose { stamp_ns, pose_ot }),
            Message::Wrench(StampedWrench { stamp_ns, wrench }),
        ]
    };
    (0..(seconds * 1e3) as i64).flat_map(of).collect()
}

fn on_flat_scan(messages: Vec<Message>) -> Vec<InputFinding> {
    let tip = TipParams {
        radius: 1.5e-3,
        stiffness: None,
    };
    findings(&ToldRecording {
        scan: grid(60, 1e-3, |_, _| 0.0),
        messages,
        tip,
    })
}

/// A hole of Ø 12 mm that the scan has closed, touched along its wall alone, and a third of it.
#[test]
fn a_hole_that_the_scan_has_closed_is_no_other_place_of_the_part() {
    for share in [1.0, 0.35] {
        let wall = recorded(20.0, |t| {
            let angle = share * std::f64::consts::TAU * (0.5 * t).sin().abs();
            let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
            let middle = Vector3::new(2e-3, -3e-3, -3e-3 - 2e-3 * (0.7 * t).sin());
            let is_lifted = t % 4.0 < 0.5;
            let off = if is_lifted { 1.5e-3 } else { 0.0 };
            let pose = Isometry3::from_parts(
                (middle + outward * (4.5e-3 - off)).into(),
                Default::default(),
            );
            (
                pose,
                if is_lifted {
                    Vector3::zeros()
                } else {
                    -outward * 2.0
                },
            )
        });
        assert_eq!(on_flat_scan(wall), [], "{share} of the hole");
    }
}

/// A ball that slides over the flat scan while the stylus turns about it by up to 50°, recorded at
/// `offset_t` (m, in the axes of the stylus) from where it is, and sinking by `compliance`, m/N.
fn slides(offset_t: Vector3<f64>, compliance: f64) -> Vec<(InputCause, bool)> {
    let messages = recorded(40.0, |t| {
        let lift = (6e-3 * (2.0 * t).sin() - 5e-3).max(0.0);
        let force = match lift > 0.0 {
            true => 0.0,
            false => 2.0 + (3.1 * t).sin(),
        };
        let at = Vector3::new(
            24e-3 * (0.9 * t).sin(),
            24e-3 * (0.37 * t).sin(),
            1.5e-3 + lift - compliance * force,
        );
        let lean = Vector3::new((1.3 * t).sin(), (0.8 * t).cos(), 0.0) * 0.6;
        let rotation = UnitQuaternion::from_scaled_axis(lean);
        let pose = Isometry3::from_parts((at - rotation * offset_t).into(), rotation);
        (
            pose,
            rotation.inverse_transform_vector(&(Vector3::z() * force)),
        )
    });
    let found = on_flat_scan(messages);
    found
        .iter()
        .map(|found| (found.cause, found.is_sure))
        .collect()
}

#[test]
fn presses_among_themselves_show_where_the_ball_is_and_how_it_sinks() {
    let none = Vector3::zeros();
    assert_eq!(slides(none, 0.0), []);
    for offset in [Vector3::x() * 0.3e-3, Vector3::z() * -0.3e-3] {
        assert_eq!(slides(offset, 0.0), [(InputCause::TipOffset, true)]);
    }
    // 0.06 mm under the usual 2 N
    assert_eq!(slides(none, 0.06e-3), [(InputCause::Stiffness, true)]);
}

/// Three touches on the flat scan, whose surface lies at `height`, m.
fn three_touches(height: f64) -> Vec<(InputCause, bool)> {
    let three = recorded(9.0, |t| {
        let lift = 4e-3 * (1.0 + 3.0 * (std::f64::consts::TAU * t / 3.0).cos());
        let at = Vector3::new(
            8e-3 * (t / 3.0).floor(),
            0.0,
            height + 1.5e-3 + lift.max(0.0),
        );
        let is_pressed = lift < 0.0;
        let force = Vector3::z() * if is_pressed { 2.0 } else { 0.0 };
        (Isometry3::from_parts(at.into(), Default::default()), force)
    });
    let found = on_flat_scan(three);
    found
        .iter()
        .map(|found| (found.cause, found.is_sure))
        .collect()
}

#[test]
fn three_touches_are_said_to_be_few_and_nothing_is_made_of_them() {
    assert_eq!(three_touches(0.0), [(InputCause::FewContacts, false)]);
    // more than a scan deviates at its touched places
    for height in [-4e-3, 4e-3] {
        assert_eq!(three_touches(height), [(InputCause::Frame, true)]);
    }
}

#[test]
fn forces_that_are_rounded_to_more_than_what_decides_of_contact_are_named() {
    let sound = simulated(3);
    let rounded = |step: f64| {
        let mut input = sound.clone();
        for message in &mut input.messages {
            if let Message::Wrench(StampedWrench { wrench, .. }) = message {
                wrench.force = wrench.force.map(|x| (x / step).round() * step);
            }
        }
        let said = findings(&input);
        said.first().map(|first| (first.cause, first.is_sure))
    };
    for (step, said) in [
        (0.05, None),
        (0.35, Some((InputCause::ForceSteps, false))),
        (0.5, Some((InputCause::ForceSteps, true))),
        (1.0, Some((InputCause::ForceSteps, true))),
    ] {
        assert_eq!(rounded(step), said, "{step} N");
    }
}

/// A tap every 240 ms on a plane that the scan has turned by `turn` about x, rad, with a `noise`, m.
///
/// - `lifted`: between two, m. `late`: of the force, s. `tare`: N.
fn taps(
    noise: f64,
    lifted: f64,
    turn: f64,
    late: f64,
    tare: Vector3<f64>,
) -> Vec<(InputCause, bool)> {
    let (period, free) = (0.24, 0.16);
    let messages = recorded(40.0, |t| {
        let at = Vector3::new(
            48e-3 * (t / 3.7).fract() - 24e-3,
            1.2e-3 * t - 24e-3,
            1.5e-3,
        );
        let turned = std::f64::consts::TAU * (t % period) / free;
        let lift = if t % period < free {
            lifted / 2.0 * (1.0 - turned.cos())
        } else {
            0.0
        };
        let pressed = ((t - late).rem_euclid(period) - free).max(0.0) / (period - free);
        let force = Vector3::z() * 3.0 * (std::f64::consts::PI * pressed).sin();
        let pose = Isometry3::from_parts((at + Vector3::z() * lift).into(), Default::default());
        (pose, force + tare)
    });
    let mut rng = Pcg64::seed_from_u64(8);
    let scan = grid(60, 1e-3, |_, y| {
        y * turn.tan() + within(&mut rng, -1.0, 1.0) * 3f64.sqrt() * noise
    });
    let tip = TipParams {
        radius: 1.5e-3,
        stiffness: None,
    };
    let found = findings(&ToldRecording {
        scan,
        messages,
        tip,
    });
    let said = found.iter().map(|found| (found.cause, found.is_sure));
    said.collect()
}

#[test]
fn taps_on_a_rough_scan_tell_its_turn_their_tare_and_that_they_are_late() {
    let none = Vector3::zeros();
    for noise in [0.3e-3, 0.9e-3] {
        assert_eq!(taps(noise, 2e-3, 0.0, 0.0, none), [], "{noise} m");
    }
    // by 100 or by −140 ms: a ball that is nearer without force is no larger one
    for late in [0.1, 0.14] {
        assert_eq!(
            taps(0.3e-3, 1e-3, 0.0, late, none),
            [(InputCause::Delay, true)]
        );
    }
    // lifted by less than the scan is rough
    for tare in [Vector3::new(0.0, 4.0, 3.0), Vector3::new(-1.2, 0.0, 1.6)] {
        assert_eq!(
            taps(0.9e-3, 2e-3, 0.0, 0.0, tare),
            [(InputCause::Tare, true)]
        );
    }
    // all contacts are as near as the scan may be off; 1.1 and 0.69 mm, root mean square
    for (turn, is_sure) in [(-0.08, true), (0.05, false)] {
        let said = taps(0.4e-3, 2e-3, turn, 0.0, none);
        assert_eq!(said, [(InputCause::Frame, is_sure)], "{turn} rad");
    }
}

/// At rest and turning 39 mm above the scan, with a weight of 2 N that was not tared.
#[test]
fn what_touches_nothing_yet_is_to_be_tared_and_nothing_else() {
    for turns in [0.0, 0.4] {
        let idle = recorded(10.0, |t| {
            let rotation = UnitQuaternion::from_euler_angles(
                turns * (0.9 * t).sin(),
                turns * (0.6 * t).cos(),
                0.3 * turns * t,
            );
            let at = Vector3::new(turns * 0.02 * t.sin(), 0.0, 39e-3);
            let weight = rotation.inverse() * Vector3::new(0.0, 0.0, -2.0);
            (
                Isometry3::from_parts(at.into(), rotation),
                weight + Vector3::new(0.3, 0.0, 0.0),
            )
        });
        let said: Vec<_> = on_flat_scan(idle).iter().map(|found| found.cause).collect();
        assert_eq!(
            said,
            [InputCause::NoContact, InputCause::Tare],
            "turned by {turns}"
        );
    }
}

/// The first quarter, the first half and three quarters of a sound recording.
#[test]
fn a_part_of_a_sound_recording_is_as_sound() {
    for seed in 3..=either(4, 8) {
        let sound = simulated(seed);
        for share in [0.25, 0.5, 0.75] {
            let mut part = sound.clone();
            part.messages
                .truncate((share * sound.messages.len() as f64) as usize);
            assert_eq!(findings(&part), [], "the first {share} of seed {seed}");
        }
    }
}
