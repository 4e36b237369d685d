//! The touch room from outside: samples of the synchroniser, residuals of the compensator, states
//! of the gate.

use nalgebra::{
    Isometry3, Matrix3, Quaternion, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, vector,
};
use proptest::prelude::*;
use touchup::stylus::*;

const MS: i64 = 1_000_000;

fn pose(stamp_ns: i64, x: f64) -> Message {
    Message::Pose(StampedPose {
        stamp_ns,
        pose_ot: Isometry3::translation(x, -x, 0.0),
    })
}

fn turned_pose(stamp_ns: i64, wxyz: [f64; 4]) -> Message {
    let [w, i, j, k] = wxyz;
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    Message::Pose(StampedPose {
        stamp_ns,
        pose_ot: Isometry3::from_parts(Translation3::identity(), rotation),
    })
}

fn wrench(stamp_ns: i64, force: f64) -> Message {
    let wrench = Wrench {
        force: vector![0.0, 0.0, force],
        torque: Vector3::zeros(),
    };
    Message::Wrench(StampedWrench { stamp_ns, wrench })
}

/// All samples of `messages` in order of arrival, and the losses of both streams at the end.
fn synchronised(params: SyncParams, messages: &[Message]) -> (Vec<Sample>, SyncCounts) {
    let mut sync = Synchroniser::new(params).unwrap();
    let mut samples = Vec::new();
    for message in messages {
        sync.push(*message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    assert_eq!(
        samples.len() as u64 + sync.counts().total(),
        count(messages),
        "a wrench is in a sample or counted once"
    );
    (samples, both(sync.counts(), sync.pose_counts()))
}

/// Number of wrenches in `messages`.
fn count(messages: &[Message]) -> u64 {
    messages
        .iter()
        .filter(|message| matches!(message, Message::Wrench(_)))
        .count() as u64
}

/// The losses of both streams together.
fn both(a: &SyncCounts, b: &SyncCounts) -> SyncCounts {
    SyncCounts {
        gap: a.gap + b.gap,
        no_pose_before: a.no_pose_before + b.no_pose_before,
        no_pose_after: a.no_pose_after + b.no_pose_after,
        late: a.late + b.late,
        duplicate: a.duplicate + b.duplicate,
        not_finite: a.not_finite + b.not_finite,
        absurd: a.absurd + b.absurd,
        jump: a.jump + b.jump,
        overflow: a.overflow + b.overflow,
    }
}

fn default_synchronised(messages: &[Message]) -> (Vec<Sample>, SyncCounts) {
    synchronised(SyncParams::default(), messages)
}

// ---- interpolation

#[test]
fn position_between_two_poses_is_the_straight_line() {
    let (samples, counts) = default_synchronised(&[
        pose(0, 1.0),
        pose(4 * MS, 2.0),
        wrench(MS, 0.5),
        wrench(3 * MS, 0.6),
    ]);
    let x: Vec<_> = samples
        .iter()
        .map(|s| (s.stamp_ns, s.pose_ot.translation.x, s.wrench.force.z))
        .collect();
    assert_eq!(x, [(MS, 1.25, 0.5), (3 * MS, 1.75, 0.6)]);
    assert_eq!(counts, SyncCounts::default());
}

/// Angles by hand: a rotation by θ about one axis is (cos θ/2, sin θ/2 · axis); a third of the
/// rotation is θ/3.
#[test]
fn orientation_turns_at_constant_speed_by_the_shorter_rotation() {
    for (theta, sign) in [
        (1.5_f64, 1.0),
        (1.5, -1.0),
        (3.1, -1.0),
        (1e-9, 1.0),
        (0.0, -1.0),
    ] {
        let to = [(theta / 2.0).cos(), (theta / 2.0).sin(), 0.0, 0.0].map(|c| sign * c);
        let messages = [
            turned_pose(0, [1.0, 0.0, 0.0, 0.0]),
            turned_pose(3 * MS, to),
            wrench(MS, 0.0),
        ];
        let (samples, _) = default_synchronised(&messages);
        let rotation = samples[0].pose_ot.rotation;
        let half = if rotation.w < 0.0 {
            -rotation.i
        } else {
            rotation.i
        };
        assert!(
            (half - (theta / 6.0).sin()).abs() <= 4.0 * f64::EPSILON * theta.max(1e-9),
            "{theta}: {rotation:?}"
        );
        assert_eq!((rotation.j, rotation.k), (0.0, 0.0));
    }
}

/// The slerp of the books, by sines on plain arrays: Σ sin((1−t)Ω)/sin Ω · a + sin(tΩ)/sin Ω · b.
fn slerp_by_sines(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    let angle = dot.abs().acos();
    let (wa, wb) = (
        ((1.0 - t) * angle).sin() / angle.sin(),
        dot.signum() * (t * angle).sin() / angle.sin(),
    );
    std::array::from_fn(|i| wa * a[i] + wb * b[i])
}

fn unit_quaternion() -> impl Strategy<Value = [f64; 4]> {
    prop::array::uniform4(-1.0..1.0_f64).prop_filter_map("too short to point anywhere", |q| {
        let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        (norm > 0.1).then(|| q.map(|c| c / norm))
    })
}

proptest! {
    #[test]
    fn orientation_is_the_slerp_of_the_books(a in unit_quaternion(), b in unit_quaternion(), at in 1..8_i64) {
        let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
        // at a small sin Ω the books' form has no digits; if the two rotations are equally long
        // either is right
        prop_assume!(dot.abs() < 0.999 && dot.abs() > 1e-6);
        let (samples, _) = default_synchronised(&[turned_pose(0, a), turned_pose(8 * MS, b), wrench(at * MS, 0.0)]);
        let q = samples[0].pose_ot.rotation;
        let expected = slerp_by_sines(a, b, at as f64 / 8.0);
        let sign = (q.w * expected[0] + q.i * expected[1] + q.j * expected[2] + q.k * expected[3]).signum();
        for (got, want) in [q.w, q.i, q.j, q.k].into_iter().zip(expected) {
            prop_assert!((sign * got - want).abs() < 1e-13, "{got} {want}");
        }
        prop_assert!((q.norm() - 1.0).abs() < 4.0 * f64::EPSILON);
    }
}

// ---- which samples come out

#[test]
fn a_sample_goes_out_once_no_message_in_the_window_can_change_it() {
    let mut sync = Synchroniser::new(SyncParams {
        reorder_ns: 10 * MS,
        ..SyncParams::default()
    })
    .unwrap();
    for message in [
        pose(0, 0.0),
        pose(2 * MS, 1.0),
        wrench(MS, 0.0),
        wrench(11 * MS, 0.0),
        wrench(12 * MS, 0.0),
    ] {
        sync.push(message);
        assert_eq!(sync.next_sample(), None);
    }
    // until the newest pose is beyond 12 ms, one at 1.5 ms may still come
    sync.push(pose(11 * MS, 2.0));
    sync.push(pose(MS + MS / 2, 0.0));
    assert_eq!(sync.next_sample(), None);
    sync.push(pose(11 * MS + MS / 2 + 1, 2.0));
    assert_eq!(
        sync.next_sample()
            .map(|s| (s.stamp_ns, s.pose_ot.translation.x)),
        Some((MS, 0.0))
    );
    assert_eq!(sync.next_sample(), None);
}

#[test]
fn each_loss_is_counted_under_its_reason_and_changes_nothing_else() {
    let good = [
        pose(0, 0.0),
        pose(10 * MS, 1.0),
        pose(20 * MS, 2.0),
        wrench(5 * MS, 1.0),
        wrench(15 * MS, 2.0),
    ];
    let (clean, none) = default_synchronised(&good);
    assert_eq!((clean.len(), none.total()), (2, 0));
    let bad_force = |x| {
        Message::Wrench(StampedWrench {
            stamp_ns: 6 * MS,
            wrench: Wrench {
                force: vector![0.0, x, 0.0],
                torque: Vector3::zeros(),
            },
        })
    };
    type Reason = fn(&SyncCounts) -> u64;
    let cases: [(&str, Message, Reason); 11] = [
        ("before", wrench(-MS, 0.0), |c| c.no_pose_before),
        ("after", wrench(21 * MS, 0.0), |c| c.no_pose_after),
        ("late", wrench(-6 * MS, 0.0), |c| c.late),
        ("repeated pose", pose(10 * MS, 9.0), |c| c.duplicate),
        ("repeated wrench", wrench(5 * MS, 9.0), |c| c.duplicate),
        ("NaN force", bad_force(f64::NAN), |c| c.not_finite),
        ("infinite pose", pose(5 * MS, f64::INFINITY), |c| {
            c.not_finite
        }),
        ("2e5 N", bad_force(-2e5), |c| c.absurd),
        ("2 km away", pose(5 * MS, 2e3), |c| c.absurd),
        ("zero quaternion", turned_pose(5 * MS, [0.0; 4]), |c| {
            c.absurd
        }),
        ("a year ahead", wrench(31_536_000_000 * MS, 0.0), |c| c.jump),
    ];
    for (name, message, counter) in cases {
        let (samples, counts) = default_synchronised(&[&good[..], &[message]].concat());
        assert_eq!(
            (samples, counter(&counts), counts.total()),
            (clean.clone(), 1, 1),
            "{name}"
        );
    }
}

#[test]
fn a_path_is_not_invented_over_a_gap() {
    let messages = [
        pose(0, 0.0),
        pose(30 * MS, 3.0),
        pose(61 * MS, 6.0),
        wrench(29 * MS, 0.0),
        wrench(31 * MS, 0.0),
    ];
    let (samples, counts) = default_synchronised(&messages);
    assert_eq!(samples.len(), 1, "30 ms is bridged, 31 ms is not");
    assert_eq!(
        (samples[0].stamp_ns, counts.gap, counts.total()),
        (29 * MS, 1, 1)
    );
    // a pose at the very stamp needs no bridge
    let (samples, _) = default_synchronised(&[
        pose(0, 0.0),
        pose(500 * MS, 1.0),
        wrench(0, 0.0),
        wrench(500 * MS, 0.0),
    ]);
    assert_eq!(samples.len(), 2);
}

#[test]
fn a_true_pause_loses_nothing_and_a_wild_first_stamp_only_itself() {
    let minute = 60_000 * MS;
    let around = |t: i64| {
        [
            pose(t, 0.0),
            pose(t + 2 * MS, 1.0),
            wrench(t, 0.0),
            wrench(t + MS, 0.0),
        ]
    };
    let (samples, counts) = default_synchronised(&[around(0), around(minute)].concat());
    assert_eq!((samples.len(), counts.total()), (4, 0));
    let wild = [
        &[wrench(i64::MAX, 0.0), pose(i64::MIN, 0.0)][..],
        &around(minute),
    ]
    .concat();
    let (samples, counts) = default_synchronised(&wild);
    assert_eq!((samples.len(), counts.jump, counts.total()), (2, 2, 2));
}

#[test]
fn a_silent_pose_stream_costs_bounded_memory_and_is_counted() {
    let params = SyncParams {
        capacity: 8,
        ..SyncParams::default()
    };
    let mut messages: Vec<_> = (0..20).map(|i| wrench(i * MS, 0.0)).collect();
    messages.extend([pose(0, 0.0), pose(30 * MS, 3.0)]);
    let (samples, counts) = synchronised(params, &messages);
    assert_eq!(
        (samples.len(), counts.overflow, counts.total()),
        (7, 13, 13)
    );
    // poses without wrenches are no loss until a wrench misses them
    let mut messages: Vec<_> = (0..20).map(|i| pose(i * MS, 0.0)).collect();
    assert_eq!(synchronised(params, &messages).1.total(), 0);
    messages.push(wrench(3 * MS, 0.0));
    assert_eq!(synchronised(params, &messages).1.overflow, 1);
}

#[test]
fn the_offset_of_the_wrench_clock_is_taken_off() {
    let params = SyncParams {
        wrench_offset_ns: 2 * MS,
        ..SyncParams::default()
    };
    let (samples, _) = synchronised(
        params,
        &[pose(0, 0.0), pose(4 * MS, 4.0), wrench(3 * MS, 0.0)],
    );
    assert_eq!(
        (samples[0].stamp_ns, samples[0].pose_ot.translation.x),
        (MS, 1.0)
    );
}

#[test]
fn the_drift_of_the_wrench_clock_is_taken_off_from_the_first_wrench_that_the_next_confirms() {
    // 500 ppm: half a millisecond in a second
    let params = SyncParams {
        wrench_drift: 500e-6,
        wrench_offset_ns: MS,
        ..SyncParams::default()
    };
    let after = [
        pose(999 * MS, 0.0),
        pose(1000 * MS, 1.0),
        wrench(1000 * MS + MS + MS / 2, 0.0),
    ];
    let first = [pose(0, 0.0), pose(MS, 1.0), wrench(MS, 0.0)];
    for wild in [
        None,
        Some(wrench(i64::MAX, 0.0)),
        Some(wrench(i64::MIN, 0.0)),
    ] {
        let messages: Vec<_> = wild
            .iter()
            .chain(&first)
            .chain(&[wrench(2 * MS, 0.0)])
            .chain(&after)
            .copied()
            .collect();
        let (samples, _) = synchronised(params, &messages);
        assert_eq!(
            (samples[0].stamp_ns, samples[0].pose_ot.translation.x),
            (0, 0.0)
        );
        let last = samples[samples.len() - 1];
        let by_hand_ns = 1000 * MS + MS / 2 - ((1000 * MS + MS / 2) as f64 * 500e-6) as i64;
        assert!(
            (last.stamp_ns - by_hand_ns).abs() <= 1,
            "{wild:?}: {} ns, not {by_hand_ns}",
            last.stamp_ns
        );
    }
}

#[test]
fn settings_without_meaning_are_refused() {
    let bad = [
        SyncParams {
            reorder_ns: -1,
            ..SyncParams::default()
        },
        SyncParams {
            largest_gap_ns: -1,
            ..SyncParams::default()
        },
        SyncParams {
            largest_jump_ns: i64::MIN,
            ..SyncParams::default()
        },
        SyncParams {
            wrench_drift: f64::NAN,
            ..SyncParams::default()
        },
        SyncParams {
            wrench_drift: 2e-3,
            ..SyncParams::default()
        },
        SyncParams {
            capacity: 1,
            ..SyncParams::default()
        },
        SyncParams {
            capacity: usize::MAX,
            ..SyncParams::default()
        },
    ];
    for params in bad {
        assert!(Synchroniser::new(params).is_err(), "{params:?}");
    }
}

/// Two streams of different rate with stamps that never repeat, and for each message its delay, ms.
fn streams() -> impl Strategy<Value = Vec<(Message, i64)>> {
    let stream = |period: i64, make: fn(i64, f64) -> Message| {
        prop::collection::vec((0..period, 0..20_i64, -1.0..1.0_f64), 1..200).prop_map(
            move |steps| {
                let with_stamp = |(i, (jitter, late, value)): (usize, (i64, i64, f64))| {
                    (
                        make((i as i64 * period + jitter) * 100_000 + i as i64, value),
                        late * MS,
                    )
                };
                steps
                    .into_iter()
                    .enumerate()
                    .map(with_stamp)
                    .collect::<Vec<_>>()
            },
        )
    };
    (stream(20, pose), stream(10, wrench)).prop_map(|(poses, wrenches)| [poses, wrenches].concat())
}

fn stamp_of(message: &Message) -> i64 {
    match message {
        Message::Pose(pose) => pose.stamp_ns,
        Message::Wrench(wrench) => wrench.stamp_ns,
    }
}

/// The pose by a search over all of them: the brute force beside the buffered one.
fn by_search(messages: &[(Message, i64)], largest_gap_ns: i64) -> Vec<(i64, f64)> {
    let mut poses = Vec::new();
    let mut expected = Vec::new();
    for (message, _) in messages {
        if let Message::Pose(pose) = message {
            poses.push((pose.stamp_ns, pose.pose_ot.translation.x));
        }
    }
    for (message, _) in messages {
        let Message::Wrench(wrench) = message else {
            continue;
        };
        let t = wrench.stamp_ns;
        let before = poses.iter().filter(|p| p.0 <= t).max_by_key(|p| p.0);
        let after = poses.iter().filter(|p| p.0 >= t).min_by_key(|p| p.0);
        if let (Some(a), Some(b)) = (before, after)
            && b.0 - a.0 <= largest_gap_ns
        {
            let share = if a.0 == b.0 {
                0.0
            } else {
                (t - a.0) as f64 / (b.0 - a.0) as f64
            };
            expected.push((t, a.1 + share * (b.1 - a.1)));
        }
    }
    expected.sort_by_key(|e| e.0);
    expected
}

proptest! {
    #[test]
    fn the_order_of_arrival_does_not_matter(messages in streams()) {
        let mut in_order = messages.clone();
        in_order.sort_by_key(|(m, _)| stamp_of(m));
        let mut as_arrived = messages.clone();
        as_arrived.sort_by_key(|(m, late)| stamp_of(m) + late);
        let plain = |list: &[(Message, i64)]| list.iter().map(|(m, _)| *m).collect::<Vec<_>>();
        let (expected, counts) = default_synchronised(&plain(&in_order));
        prop_assert_eq!(&default_synchronised(&plain(&as_arrived)), &(expected.clone(), counts));
        // one stream after the other: the buffers hold both
        as_arrived.sort_by_key(|(m, _)| matches!(m, Message::Wrench(_)));
        prop_assert_eq!(&default_synchronised(&plain(&as_arrived)).0, &expected);
        prop_assert_eq!(counts.late + counts.duplicate + counts.overflow, 0);

        let searched = by_search(&messages, SyncParams::default().largest_gap_ns);
        prop_assert_eq!(expected.len(), searched.len());
        for (sample, (stamp_ns, x)) in expected.iter().zip(searched) {
            prop_assert_eq!(sample.stamp_ns, stamp_ns);
            prop_assert!((sample.pose_ot.translation.x - x).abs() < 1e-12);
        }
    }

    #[test]
    fn every_wrench_is_in_a_sample_or_counted(
        stamps in prop::collection::vec((any::<bool>(), any::<i64>(), 0..60_i64, any::<bool>()), 0..300),
    ) {
        let messages: Vec<_> = stamps
            .into_iter()
            .map(|(wild, far, near, is_pose)| {
                let stamp_ns = if wild { far } else { near * MS };
                if is_pose { pose(stamp_ns, 0.0) } else { wrench(stamp_ns, 0.0) }
            })
            .collect();
        let (samples, counts) = default_synchronised(&messages);
        prop_assert!(samples.len() as u64 + counts.total() >= count(&messages));
        prop_assert!(samples.windows(2).all(|pair| pair[0].stamp_ns < pair[1].stamp_ns));
    }
}

// ---- samples

#[test]
fn a_sample_is_refused_when_not_finite_or_not_in_order() {
    let good = Sample {
        stamp_ns: 5,
        pose_ot: Isometry3::identity(),
        wrench: Wrench::default(),
    };
    assert_eq!(good.check(), Ok(()));
    let mut bad = good;
    bad.wrench.torque.y = f64::NEG_INFINITY;
    assert_eq!(
        bad.check(),
        Err(SampleError::NotFinite {
            what: "torque",
            stamp_ns: 5
        })
    );
    let mut far = good;
    far.pose_ot.translation.x = -1e4;
    let SampleError::Absurd {
        what, magnitude, ..
    } = far.check().unwrap_err()
    else {
        panic!()
    };
    assert_eq!((what, magnitude), ("position", 1e4));

    assert_eq!(good.seconds_since(None), Ok(0.0));
    assert_eq!(good.seconds_since(Some(5 - 2 * MS)), Ok(0.002));
    assert_eq!(
        good.seconds_since(Some(5)),
        Err(SampleError::NotAfter {
            stamp_ns: 5,
            last_ns: 5
        })
    );
    assert_eq!(
        good.seconds_since(Some(6)),
        Err(SampleError::NotAfter {
            stamp_ns: 5,
            last_ns: 6
        })
    );
    let end = Sample {
        stamp_ns: i64::MAX,
        ..good
    };
    assert!(
        (end.seconds_since(Some(i64::MIN)).unwrap() - 2f64.powi(64) * 1e-9).abs() < 1.0,
        "no overflow"
    );
}

// ---- compensation

/// Rotation matrix about `axis` by `angle`, written out by hand (Rodrigues).
fn rodrigues(axis: Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let a = axis.normalize();
    let cross = Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0);
    Matrix3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

fn turn(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle)
}

fn axis_angle() -> impl Strategy<Value = (Vector3<f64>, f64)> {
    (prop::array::uniform3(-1.0..1.0_f64), -3.0..3.0_f64)
        .prop_filter("an axis needs a length", |(a, _)| {
            Vector3::from(*a).norm() > 0.1
        })
        .prop_map(|(axis, angle)| (axis.into(), angle))
}

proptest! {
    /// Hand-written matrices give the reading: f_S = R_OSᵀ(F + m g) + b, τ_S about So.
    #[test]
    fn compensation_gives_back_the_contact_force(
        (ot, ts) in (axis_angle(), axis_angle()),
        vectors in prop::array::uniform5(prop::array::uniform3(-5.0..5.0_f64)),
        mass in 0.0..3.0_f64,
        object_axes in any::<bool>(),
    ) {
        let [force_o, p_ts, p_sc, bias_force, bias_torque] = vectors.map(Vector3::from);
        let gravity_o = vector![0.0, 0.0, -9.81];
        let (r_ot, r_ts) = (rodrigues(ot.0, ot.1), rodrigues(ts.0, ts.1));
        let r_os = r_ot * r_ts;
        // the contact acts at To, which is −R_OT p_TS away from So
        let torque_o = (-(r_ot * p_ts)).cross(&force_o) + (r_os * p_sc).cross(&(gravity_o * mass));
        let force_s = r_os.transpose() * (force_o + gravity_o * mass) + bias_force;
        let torque_s = r_os.transpose() * torque_o + bias_torque;
        let to_axes = if object_axes { r_os } else { Matrix3::identity() };

        let compensator = Compensator::new(CompensatorParams {
            wrench_frame: if object_axes { WrenchFrame::Object } else { WrenchFrame::Sensor },
            pose_ts: Isometry3::from_parts(p_ts.into(), turn(ts.0, ts.1)),
            payload: Some(Payload { mass, p_sc, gravity_o }),
            bias_s: Some(Wrench { force: bias_force, torque: bias_torque }),
        })
        .unwrap();
        let pose_ot = Isometry3::from_parts(Translation3::new(0.1, 0.2, 0.3), turn(ot.0, ot.1));
        let wrench = Wrench { force: to_axes * force_s, torque: to_axes * torque_s };
        let tip = compensator.compensate(&Sample { stamp_ns: 7, pose_ot, wrench });
        prop_assert_eq!((tip.stamp_ns, tip.pose_ot), (7, pose_ot));
        prop_assert!((tip.force_o - force_o).norm() < 1e-12, "{}", tip.force_o);
        prop_assert!(tip.torque_o.norm() < 1e-11, "a force through the ball centre turns nothing: {}", tip.torque_o);
    }
}

#[test]
fn tilted_payload_weighs_nothing_after_compensation() {
    // lying on its side: gravity along −y of S, centre of mass 50 mm up the shaft, 0.2 kg
    let payload = Payload {
        mass: 0.2,
        p_sc: vector![0.0, 0.0, 0.05],
        gravity_o: vector![0.0, 0.0, -10.0],
    };
    let compensator = Compensator::new(CompensatorParams {
        payload: Some(payload),
        ..CompensatorParams::default()
    })
    .unwrap();
    let pose_ot = Isometry3::from_parts(
        Translation3::identity(),
        UnitQuaternion::new_unchecked(Quaternion::new(0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0, 0.0)),
    );
    let wrench = Wrench {
        force: vector![0.0, -2.0, 0.0],
        torque: vector![0.1, 0.0, 0.0],
    };
    let tip = compensator.compensate(&Sample {
        stamp_ns: 0,
        pose_ot,
        wrench,
    });
    assert!(
        tip.force_o.norm() < 1e-15 && tip.torque_o.norm() < 1e-16,
        "{tip:?}"
    );
}

#[test]
fn without_parts_only_the_rotation_is_left() {
    let pose_ot = Isometry3::from_parts(
        Translation3::identity(),
        turn(Vector3::z(), std::f64::consts::FRAC_PI_2),
    );
    let wrench = Wrench {
        force: vector![1.0, 0.0, 3.0],
        torque: vector![0.0, 2.0, 0.0],
    };
    let sample = Sample {
        stamp_ns: 0,
        pose_ot,
        wrench,
    };
    let tip = Compensator::new(CompensatorParams::default())
        .unwrap()
        .compensate(&sample);
    assert!((tip.force_o - vector![0.0, 1.0, 3.0]).norm() < 1e-15);
    assert!((tip.torque_o - vector![-2.0, 0.0, 0.0]).norm() < 1e-15);
    let object = CompensatorParams {
        wrench_frame: WrenchFrame::Object,
        ..CompensatorParams::default()
    };
    assert_eq!(
        Compensator::new(object)
            .unwrap()
            .compensate(&sample)
            .force_o,
        wrench.force
    );
}

#[test]
fn compensation_settings_without_meaning_are_refused() {
    let payload = Payload {
        mass: -1.0,
        p_sc: Vector3::zeros(),
        gravity_o: Vector3::zeros(),
    };
    let nan = Wrench {
        force: vector![0.0, f64::NAN, 0.0],
        torque: Vector3::zeros(),
    };
    let params = CompensatorParams::default();
    assert_eq!(
        Compensator::new(CompensatorParams {
            payload: Some(payload),
            ..params
        })
        .unwrap_err()
        .value,
        -1.0
    );
    assert!(
        Compensator::new(CompensatorParams {
            bias_s: Some(nan),
            ..params
        })
        .is_err()
    );
}

/// One row: sensor orientation in the base, and the force in the axes of the sensor, N.
fn gravity_rows(text: &str) -> Vec<(UnitQuaternion<f64>, Vector3<f64>)> {
    let row = |line: &str| {
        let v: Vec<f64> = line.split(',').map(|x| x.trim().parse().unwrap()).collect();
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(v[10], v[7], v[8], v[9]));
        (rotation, vector![v[1], v[2], v[3]])
    };
    text.lines()
        .filter(|line| !line.trim().is_empty())
        .map(row)
        .collect()
}

/// Least squares of f_S = R_OSᵀ w + b for the weight w in O and the bias b in S.
fn weight_and_bias(rows: &[(UnitQuaternion<f64>, Vector3<f64>)]) -> (Vector3<f64>, Vector3<f64>) {
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    let mut right = SVector::<f64, 6>::zeros();
    for (rotation, force) in rows {
        let mut row = SMatrix::<f64, 3, 6>::zeros();
        row.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&rotation.to_rotation_matrix().matrix().transpose());
        row.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        normal += row.transpose() * row;
        right += row.transpose() * force;
    }
    let x = normal.cholesky().unwrap().solve(&right);
    (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into())
}

/// A real sensor held still in many orientations measures nothing once weight and bias are off. The
/// weight of 11.4 N and the rms of 0.17 N per axis are those found by others in the same file.
#[test]
fn a_real_sensor_at_rest_measures_nothing() {
    let Some(path) = crate::shared::shared("force/gravity_ati/GP2025.txt") else {
        return;
    };
    let text = std::fs::read_to_string(&path).unwrap();
    let rows = gravity_rows(&text);
    let (weight, bias) = weight_and_bias(&rows);
    let mass = 1.162;
    let compensator = Compensator::new(CompensatorParams {
        payload: Some(Payload {
            mass,
            p_sc: Vector3::zeros(),
            gravity_o: weight.normalize() * 9.81,
        }),
        bias_s: Some(Wrench {
            force: bias,
            torque: Vector3::zeros(),
        }),
        ..CompensatorParams::default()
    })
    .unwrap();
    let left = |compensator: &Compensator| {
        let squares = rows.iter().map(|(rotation, force)| {
            let pose_ot = Isometry3::from_parts(Translation3::identity(), *rotation);
            let wrench = Wrench {
                force: *force,
                torque: Vector3::zeros(),
            };
            compensator
                .compensate(&Sample {
                    stamp_ns: 0,
                    pose_ot,
                    wrench,
                })
                .force_o
                .norm_squared()
        });
        (squares.sum::<f64>() / (3 * rows.len()) as f64).sqrt()
    };
    let raw = left(&Compensator::new(CompensatorParams::default()).unwrap());
    println!(
        "{} rows: weight {:.2} N, raw {raw:.2} N rms, left {:.3} N rms",
        rows.len(),
        weight.norm(),
        left(&compensator)
    );
    assert_eq!(rows.len(), 1756);
    assert!((weight.norm() - 11.4).abs() < 0.05);
    assert!(left(&compensator) <= 0.2 && raw > 5.0);
}

// ---- contact gate

#[test]
fn the_gate_holds_between_its_thresholds_and_remembers_the_onset() {
    let mut gate = ContactGate::new(ContactGateParams::default()).unwrap();
    let forces = [0.3, 0.4, 0.41, 0.3, 0.22, 0.21, 0.3, 0.5, 0.0];
    let onsets: Vec<_> = forces
        .iter()
        .zip(0..)
        .map(|(f, stamp_ns)| {
            gate.update(stamp_ns, &vector![0.0, -f, 0.0])
                .map(|contact| contact.onset_ns)
        })
        .collect();
    assert_eq!(
        onsets,
        [
            None,
            None,
            Some(2),
            Some(2),
            Some(2),
            None,
            None,
            Some(7),
            None
        ]
    );
    assert_eq!(gate.contacts(), 2);
}

#[test]
fn a_gate_that_cannot_close_is_refused() {
    for (on, off) in [
        (0.2, 0.4),
        (f64::NAN, 0.1),
        (0.4, -0.1),
        (f64::INFINITY, 0.0),
    ] {
        assert!(
            ContactGate::new(ContactGateParams {
                on,
                off,
                ..ContactGateParams::default()
            })
            .is_err(),
            "{on} {off}"
        );
    }
}
