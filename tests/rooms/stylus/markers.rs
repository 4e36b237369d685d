//! The marker filter from outside: closed forms, occlusion, swapped labels, outliers, and springs
//! too stiff for the frames.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;
use touchup::stylus::{
    MarkerBody, MarkerFilter, MarkerFrame, MarkerObservation, MarkerParams, SettingError,
    SpringParams, StampedPose,
};

const MS: i64 = 1_000_000;

/// Six LEDs around the handle of a stylus, 120 to 180 mm above the ball.
fn body() -> MarkerBody {
    let mm = [
        [28, 0, 120],
        [-20, 22, 128],
        [-16, -26, 140],
        [18, 24, 155],
        [-30, 2, 168],
        [6, -22, 180],
    ];
    MarkerBody::new(
        mm.map(|p| Point3::from(p.map(|x| f64::from(x) * 1e-3)))
            .to_vec(),
    )
    .unwrap()
}

/// Mean of its markers.
fn centroid_t() -> Point3<f64> {
    let body = body();
    let sum: Vector3<f64> = body.markers_t().iter().map(|marker| marker.coords).sum();
    Point3::from(sum / body.markers_t().len() as f64)
}

fn pose(t: f64) -> Isometry3<f64> {
    let place = Vector3::new(
        0.1 + 0.02 * (TAU * 0.4 * t).sin(),
        0.02 * (TAU * 0.3 * t).cos(),
        0.3,
    );
    Isometry3::new(
        place,
        Vector3::new(
            0.2 * (TAU * 0.35 * t).sin(),
            0.4,
            0.15 * (TAU * 0.25 * t).cos(),
        ),
    )
}

/// The visible labels at a pose, each marker displaced by `off`.
fn frame(
    stamp_ns: i64,
    pose_ot: &Isometry3<f64>,
    labels: impl IntoIterator<Item = usize>,
    mut off: impl FnMut(usize) -> Vector3<f64>,
) -> MarkerFrame {
    let mut frame = MarkerFrame::new(stamp_ns);
    for i in labels {
        assert!(frame.see(MarkerObservation {
            label: i as u32,
            position: pose_ot * body().markers_t()[i] + off(i)
        }));
    }
    frame
}

fn still(_: usize) -> Vector3<f64> {
    Vector3::zeros()
}

fn filter(params: MarkerParams) -> MarkerFilter {
    MarkerFilter::new(
        body(),
        MarkerParams {
            reorder_ns: 0,
            ..params
        },
    )
    .unwrap()
}

/// Poses for all frames.
fn filtered(
    filter: &mut MarkerFilter,
    frames: impl IntoIterator<Item = MarkerFrame>,
) -> Vec<StampedPose> {
    let mut poses = Vec::new();
    frames
        .into_iter()
        .for_each(|frame| filter.push(&frame, |pose| poses.push(pose)));
    filter.finish(|pose| poses.push(pose));
    poses
}

/// Distance of two poses at the ball, and their relative turn, rad.
fn off(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    (
        (a.translation.vector - b.translation.vector).norm(),
        a.rotation.angle_to(&b.rotation),
    )
}

fn gauss(rng: &mut Pcg64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

/// Every choice of three to six markers gives the pose of the frame.
#[test]
fn the_first_pose_is_exact_for_every_set_of_markers() {
    let mut rng = Pcg64::seed_from_u64(1);
    for set in (0_u32..64).filter(|set| set.count_ones() >= 3) {
        let turn = UnitQuaternion::from_scaled_axis(gauss(&mut rng) * 2.0);
        let truth = Isometry3::from_parts((gauss(&mut rng) * 0.3).into(), turn);
        let labels = (0..6).filter(|i| set & (1 << i) != 0);
        let mut filter = filter(MarkerParams::default());
        let poses = filtered(&mut filter, [frame(0, &truth, labels, still)]);
        assert_eq!(poses.len(), 1, "{set:b}");
        let (place, angle) = off(&poses[0].pose_ot, &truth);
        assert!(
            place < 1e-12 && angle < 1e-7,
            "{set:b}: {place} m, {angle} rad"
        );
    }
}

/// A body in free flight needs no pull: once the filter knows its motion it is exact, and there is
/// a pose every 1 ms.
#[test]
fn a_steady_motion_is_followed_without_lag() {
    let truth = |t: f64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, -0.3, 0.8) * t);
        let centroid = Vector3::new(0.05, 0.03, -0.04) * t;
        Isometry3::from_parts((centroid - turn * centroid_t().coords).into(), turn)
    };
    let frames = (0..400).map(|i| frame(i * 7 * MS, &truth(i as f64 * 7e-3), 0..6, still));
    let poses = filtered(&mut filter(MarkerParams::default()), frames);
    assert_eq!(poses.len(), 399 * 7 + 1);
    for pair in poses.windows(2) {
        assert_eq!(pair[1].stamp_ns - pair[0].stamp_ns, MS);
    }
    for pose in &poses[2000..] {
        let (place, angle) = off(&pose.pose_ot, &truth(pose.stamp_ns as f64 * 1e-9));
        // between two frames 3.5 mrad apart the ball goes straight, not along its arc: (7e-3)²/8 of
        // 150 mm
        assert!(place < 1e-6 && angle < 1e-6, "{place} m, {angle} rad");
    }
}

/// e″ + 2 ω e′ + ω² e = 0 with e(0) = s, e′(0) = −2 ω s: e = s e^(−ωt) (1 − ωt), at frames much
/// closer than 1/ω.
#[test]
fn a_step_is_followed_as_by_a_critically_damped_spring() {
    let step = 2e-3;
    let [from, to] = [0.0, step].map(|x| Isometry3::translation(x, 0.0, 0.0));
    let frames = (0..4000).map(|i| frame(i * MS, if i <= 3000 { &from } else { &to }, 0..6, still));
    let poses = filtered(&mut filter(MarkerParams::default()), frames);
    for pose in &poses[3001..] {
        let turn = TAU * 12.0 * (pose.stamp_ns - 3000 * MS) as f64 * 1e-9;
        let expected = step * (1.0 - (-turn).exp() * (1.0 - turn));
        // the loose mass makes the spring 2 % softer, a frame is 7 % of 1/ω
        assert!(
            (pose.pose_ot.translation.x - expected).abs() < 0.04 * step,
            "{}",
            pose.stamp_ns
        );
    }
}

/// Springs from far too soft to far too stiff, frames at random times with random markers: the
/// noise stays noise.
#[test]
fn no_spring_and_no_set_of_markers_blows_up() {
    for frequency in [0.1, 1.0, 12.0, 200.0, 1e6] {
        for damping in [0.5, 1.0, 10.0] {
            let mut rng = Pcg64::seed_from_u64(7);
            let mut stamp_ns = 0;
            let mut frames = Vec::new();
            for _ in 0..3000 {
                let share: f64 = StandardUniform.sample(&mut rng);
                stamp_ns += (share * 12e6) as i64 + 1;
                let seen: Vec<usize> = (0..6)
                    .filter(|_| StandardUniform.sample(&mut rng))
                    .collect();
                frames.push(frame(stamp_ns, &Isometry3::identity(), seen, |_| {
                    gauss(&mut rng) * 1e-4
                }));
            }
            let spring = SpringParams { frequency, damping };
            let poses = filtered(
                &mut filter(MarkerParams {
                    spring,
                    ..MarkerParams::default()
                }),
                frames,
            );
            assert!(poses.len() > 5000);
            let bound = if frequency <= 12.0 { 4e-3 } else { 20e-3 };
            for pose in poses {
                pose.check().unwrap();
                let centroid = pose.pose_ot * centroid_t() - centroid_t();
                // the stiffest take 0.2 mm of noise within 1 ms for a speed, and fly on with it for
                // up to 30 ms; an unstable one would be metres off, or no number
                assert!(
                    centroid.norm() < bound,
                    "{frequency} Hz, {damping}: {centroid}"
                );
            }
        }
    }
}

#[test]
fn few_markers_are_coasted_over_and_then_there_is_no_pose() {
    let mut filter = filter(MarkerParams::default());
    let mut counts = Vec::new();
    let mut poses = Vec::new();
    for i in 0..=200 {
        // frames every 5 ms; 500 to 520 ms two markers, 700 to 800 ms one, 900 to 1000 ms none
        let seen = match i * 5 {
            500..520 => 0..2,
            700..800 => 3..4,
            900.. => 0..0,
            _ => 0..6,
        };
        filter.push(
            &frame(i * 5 * MS, &pose(i as f64 * 5e-3), seen, still),
            |pose| poses.push(pose),
        );
        counts.push(*filter.counts());
    }
    // a frame counts when the next one has come
    let state_at = |ms: usize| {
        let [before, now] = [counts[ms / 5], counts[ms / 5 + 1]];
        let held = now.held - before.held;
        match (held, now.coasting - before.coasting, now.lost - before.lost) {
            (1, 0, 0) => "held",
            (0, 1, 0) => "coasting",
            (0, 0, 1) => "lost",
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(
        [480, 500, 515, 520].map(state_at),
        ["held", "coasting", "coasting", "held"]
    );
    // held at 695 ms for the last time, so that it flies on until 725 ms
    assert_eq!(
        [725, 730, 795, 800].map(state_at),
        ["coasting", "lost", "lost", "held"]
    );
    assert_eq!([925, 930].map(state_at), ["coasting", "lost"]);
    let gap: Vec<_> = poses
        .windows(2)
        .filter(|pair| pair[1].stamp_ns - pair[0].stamp_ns > MS)
        .collect();
    assert_eq!(gap.len(), 1);
    assert_eq!(
        (gap[0][0].stamp_ns, gap[0][1].stamp_ns),
        (725 * MS, 800 * MS)
    );
    assert_eq!(poses.last().unwrap().stamp_ns, 925 * MS);
    for pose_now in &poses {
        let t = pose_now.stamp_ns as f64 * 1e-9;
        let (place, _) = off(&pose_now.pose_ot, &pose(t));
        // 0.2 m/s² and 3 rad/s² at 150 mm for 30 ms, and the lag of the spring behind them
        assert!(place < 0.5e-3, "{place} m at {t} s");
    }
    assert_eq!(filter.counts().lost, 14 + 14);
}

#[test]
fn swapped_labels_change_nothing_but_the_count() {
    let swap = |label: u32| match label {
        1 => 4,
        4 => 1,
        other => other,
    };
    let frames = |swaps: bool| {
        (0..100).map(move |i| {
            let seen = frame(i * 5 * MS, &pose(i as f64 * 5e-3), 0..6, still);
            let mut relabelled = MarkerFrame::new(seen.stamp_ns);
            for marker in seen.seen() {
                let label = if swaps {
                    swap(marker.label)
                } else {
                    marker.label
                };
                relabelled.see(MarkerObservation { label, ..*marker });
            }
            relabelled
        })
    };
    let mut swapped = filter(MarkerParams::default());
    let with = filtered(&mut swapped, frames(true));
    let without = filtered(&mut filter(MarkerParams::default()), frames(false));
    assert_eq!(with.len(), without.len());
    for (with, without) in with.iter().zip(&without) {
        let (place, angle) = off(&with.pose_ot, &without.pose_ot);
        assert!(place < 1e-12 && angle < 1e-7);
    }
    assert_eq!(
        (swapped.counts().relabelled, swapped.counts().rejected),
        (200, 0)
    );
}

/// Least squares would move by a sixth of the outlier.
#[test]
fn an_outlier_within_the_gate_counts_little_and_one_beyond_it_nothing() {
    for (distance, largest) in [(3e-3, 0.1e-3), (50e-3, 1e-9)] {
        let truth = pose(0.0);
        let bad = |i: usize| {
            if i == 2 {
                Vector3::new(distance, 0.0, 0.0)
            } else {
                Vector3::zeros()
            }
        };
        let frames = (0..100).map(|i| {
            if i < 20 {
                frame(i * 5 * MS, &truth, 0..6, still)
            } else {
                frame(i * 5 * MS, &truth, 0..6, bad)
            }
        });
        let mut filter = filter(MarkerParams::default());
        let poses = filtered(&mut filter, frames);
        let centroid = |pose: &Isometry3<f64>| pose * centroid_t();
        let last = centroid(&poses.last().unwrap().pose_ot) - centroid(&truth);
        assert!(last.norm() < largest, "{distance} m: {last}");
        assert_eq!(
            filter.counts().rejected,
            if distance > 4e-3 { 80 } else { 0 }
        );
    }
}

/// The pose that a search over all labels would pick: four markers at their places and two
/// reflections.
#[test]
fn a_first_frame_with_reflections_and_a_swap_is_seen_through() {
    let truth = pose(1.0);
    let mut seen = frame(0, &truth, 0..4, still);
    let mut swapped = MarkerFrame::new(0);
    for (at, marker) in seen.seen().iter().enumerate() {
        swapped.see(MarkerObservation {
            label: [0, 1, 2, 5][at],
            ..*marker
        });
    }
    seen = swapped;
    seen.see(MarkerObservation {
        label: 4,
        position: Point3::new(0.3, 0.3, 0.3),
    });
    seen.see(MarkerObservation {
        label: 900,
        position: Point3::new(-0.3, 0.1, 0.2),
    });
    let mut filter = filter(MarkerParams::default());
    let poses = filtered(&mut filter, [seen]);
    let (place, angle) = off(&poses[0].pose_ot, &truth);
    assert!(place < 1e-12 && angle < 1e-7);
    assert_eq!(
        (filter.counts().relabelled, filter.counts().rejected),
        (1, 2)
    );
}

#[test]
fn markers_that_fit_no_pose_give_none() {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut filter = filter(MarkerParams::default());
    let frames: Vec<_> = (0..50)
        .map(|i| frame(i * 5 * MS, &pose(0.0), 0..6, |_| gauss(&mut rng) * 0.05))
        .collect();
    assert_eq!(filtered(&mut filter, frames), []);
    assert_eq!(filter.counts().lost, 50);
}

/// Frames that come in another order, twice, or with a stamp from the future give the same poses.
#[test]
fn the_order_of_arrival_does_not_matter() {
    let frames: Vec<_> = (0..200)
        .map(|i| frame(i * 5 * MS, &pose(i as f64 * 5e-3), 0..6, still))
        .collect();
    let mut shuffled = frames.clone();
    (0..200).step_by(4).for_each(|i| shuffled.swap(i, i + 3));
    shuffled.insert(50, shuffled[48]);
    let mut future = shuffled[99];
    future.stamp_ns = i64::MAX - 1;
    shuffled.insert(100, future);
    let new = || MarkerFilter::new(body(), MarkerParams::default()).unwrap();
    let (mut calm, mut wild) = (new(), new());
    assert_eq!(filtered(&mut wild, shuffled), filtered(&mut calm, frames));
    assert_eq!(
        (wild.frame_counts().duplicate, wild.frame_counts().jump),
        (1, 1)
    );
}

/// After the pose of the first frame, ten milliseconds up to the last nanosecond that there is hold
/// ten multiples of the period.
#[test]
fn at_the_end_of_time_the_poses_end() {
    let frames: Vec<_> = (0..3)
        .map(|i| frame(i64::MAX - (2 - i) * 5 * MS, &pose(0.0), 0..6, still))
        .collect();
    let poses = filtered(&mut filter(MarkerParams::default()), frames);
    assert_eq!((poses.len(), poses[10].stamp_ns), (11, i64::MAX / MS * MS));
}

/// Against the closed-form fit of each frame alone, at the ball, 150 mm off the markers.
#[test]
fn the_noise_at_the_ball_is_less_than_that_of_each_frame() {
    let (mut rng, mut sums, mut count) = (Pcg64::seed_from_u64(5), [0.0; 2], 0.0);
    let mut frames = Vec::new();
    for i in 0..2000 {
        frames.push(frame(i * 5 * MS, &pose(i as f64 * 5e-3), 0..6, |_| {
            gauss(&mut rng) * 0.1e-3
        }));
    }
    let poses = filtered(&mut filter(MarkerParams::default()), frames.clone());
    for (frame, followed) in frames.into_iter().zip(poses.iter().step_by(5)).skip(100) {
        assert_eq!(followed.stamp_ns, frame.stamp_ns);
        let truth = pose(frame.stamp_ns as f64 * 1e-9);
        let alone = filtered(&mut filter(MarkerParams::default()), [frame]);
        sums[0] += off(&alone[0].pose_ot, &truth).0.powi(2);
        sums[1] += off(&followed.pose_ot, &truth).0.powi(2);
        count += 1.0;
    }
    let [alone, followed] = sums.map(|sum: f64| (sum / count).sqrt());
    assert!(
        followed < 0.8 * alone,
        "{followed} m, each frame alone {alone} m"
    );
}

#[test]
fn bodies_without_a_meaning_are_refused() {
    let p = |x: f64, y: f64| Point3::new(x, y, 0.1);
    for bad in [
        vec![],
        vec![p(0.0, 0.0), p(0.03, 0.0)],
        vec![p(0.0, 0.0), p(0.03, 0.0), p(0.06, 0.0), p(0.1, 0.0)],
        vec![p(0.0, 0.0), p(0.03, 0.0), p(0.0, 0.03), p(0.0, 0.0)],
        vec![p(0.0, 0.0), p(f64::NAN, 0.0), p(0.0, 0.03)],
        (0..17)
            .map(|i| p(0.02 * f64::from(i), 0.01 * f64::from(i * i)))
            .collect(),
    ] {
        let refused: Result<_, SettingError> = MarkerBody::new(bad.clone());
        assert!(refused.is_err(), "{bad:?}");
    }
}

#[test]
fn settings_without_a_meaning_are_refused() {
    let good = MarkerParams::default();
    for bad in [
        MarkerParams {
            gate: 30e-3,
            ..good
        },
        MarkerParams {
            gate: f64::NAN,
            ..good
        },
        MarkerParams { noise: 0.0, ..good },
        MarkerParams {
            period_ns: 0,
            ..good
        },
        MarkerParams {
            coast_ns: -1,
            ..good
        },
        MarkerParams {
            reorder_ns: -1,
            ..good
        },
        MarkerParams {
            spring: SpringParams {
                frequency: 9.0,
                damping: 0.4,
            },
            ..good
        },
        MarkerParams {
            spring: SpringParams {
                frequency: 0.0,
                damping: 1.0,
            },
            ..good
        },
        MarkerParams {
            spring: SpringParams {
                frequency: 1e300,
                damping: 1.0,
            },
            ..good
        },
        MarkerParams {
            spring: SpringParams {
                frequency: 9.0,
                damping: f64::INFINITY,
            },
            ..good
        },
    ] {
        assert!(MarkerFilter::new(body(), bad).is_err(), "{bad:?}");
    }
}

#[test]
fn a_frame_takes_no_more_than_it_can_hold_and_no_nonsense() {
    let mut frame = MarkerFrame::new(0);
    let at = |x| MarkerObservation {
        label: 0,
        position: Point3::new(x, 0.0, 0.0),
    };
    assert!(
        ![f64::NAN, f64::INFINITY, 1e4]
            .into_iter()
            .any(|x| frame.see(at(x)))
    );
    assert_eq!((0..20).filter(|_| frame.see(at(0.0))).count(), 16);
    assert_eq!(frame.seen().len(), 16);
}
