//! Streams that come in order: the samples are those of the reorder window, however the two
//! interleave, and none waits.

use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use touchup::stylus::{
    Message, Sample, StampedPose, StampedWrench, SyncParams, Synchroniser, Wrench,
};

fn pose(stamp_ns: i64) -> Message {
    Message::Pose(StampedPose {
        stamp_ns,
        pose_ot: Isometry3::translation(stamp_ns as f64 * 1e-9, 0.1, 0.2),
    })
}

fn wrench(stamp_ns: i64) -> Message {
    let force = Vector3::new(0.0, 0.0, stamp_ns as f64 * 1e-9);
    Message::Wrench(StampedWrench {
        stamp_ns,
        wrench: Wrench {
            force,
            torque: Vector3::zeros(),
        },
    })
}

/// Stamps with steps of 0 (twice the same) to 60 ms (a gap), now and then 15 s (a leap).
fn stamps() -> impl Strategy<Value = Vec<i64>> {
    let step = prop_oneof![8 => 1i64..4_000_000, 1 => Just(0i64), 1 => 20_000_000i64..60_000_000, 1 => Just(15_000_000_000)];
    proptest::collection::vec(step, 0..120).prop_map(|steps| {
        steps
            .into_iter()
            .scan(1_000_000_000i64, |stamp, step| {
                *stamp += step;
                Some(*stamp)
            })
            .collect()
    })
}

fn drawn(sync: &mut Synchroniser, messages: impl IntoIterator<Item = Message>) -> Vec<Sample> {
    let mut samples = Vec::new();
    for message in messages {
        sync.push(message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    samples
}

proptest! {
    #[test]
    fn whatever_the_interleaving_the_samples_are_those_of_the_window(
        poses in stamps(),
        wrenches in stamps(),
        turns in proptest::collection::vec(any::<bool>(), 0..300),
    ) {
        let mut by_stamp: Vec<Message> = poses.iter().map(|&s| pose(s)).chain(wrenches.iter().map(|&s| wrench(s))).collect();
        by_stamp.sort_by_key(Message::stamp_ns);
        let mut window = Synchroniser::new(SyncParams::default()).unwrap();
        let expected = drawn(&mut window, by_stamp);

        let (mut poses, mut wrenches) = (poses.iter().map(|&s| pose(s)), wrenches.iter().map(|&s| wrench(s)));
        let mut mixed = Vec::new();
        for is_pose in turns {
            mixed.extend(if is_pose { poses.next() } else { wrenches.next() });
        }
        mixed.extend(wrenches);
        mixed.extend(poses);
        let mut at_once = Synchroniser::in_order(SyncParams::default()).unwrap();
        prop_assert_eq!(drawn(&mut at_once, mixed), expected);
        prop_assert_eq!(at_once.counts(), window.counts());
        prop_assert_eq!(at_once.pose_counts(), window.pose_counts());
    }
}

/// The second message of a stream confirms the first; from then on the later of wrench and pose
/// lets the sample out.
#[test]
fn a_sample_goes_out_with_the_later_of_its_wrench_and_the_pose_after_it() {
    let mut sync = Synchroniser::in_order(SyncParams::default()).unwrap();
    for message in [pose(0), pose(5), wrench(0), wrench(1)] {
        assert!(sync.push(message));
    }
    let stamps = |sync: &mut Synchroniser| -> Vec<i64> {
        std::iter::from_fn(|| sync.next_sample())
            .map(|sample| sample.stamp_ns)
            .collect()
    };
    assert_eq!(stamps(&mut sync), [0, 1]);
    sync.push(wrench(3));
    assert_eq!(stamps(&mut sync), [3], "the pose was there");
    sync.push(wrench(7));
    assert!(stamps(&mut sync).is_empty());
    sync.push(pose(10));
    assert_eq!(stamps(&mut sync), [7], "the wrench was there");
    sync.push(wrench(10));
    assert_eq!(
        stamps(&mut sync),
        [10],
        "at the stamp of a pose nothing is waited for"
    );
    assert!(!sync.push(wrench(10)) && !sync.push(wrench(9)) && !sync.push(pose(4)));
    assert_eq!(
        (
            sync.counts().duplicate,
            sync.counts().late,
            sync.pose_counts().late
        ),
        (1, 1, 1)
    );
}
