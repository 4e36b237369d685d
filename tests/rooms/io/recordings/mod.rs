//! Recordings from outside: real ones, damaged ones, our own.
//!
//! Numbers of real recordings come from the Python package `rosbags` 0.11.9 (AnyReader, `math.fsum`
//! of each field), which shares no code with this crate.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use nalgebra::{Translation3, Vector3};
use proptest::prelude::*;
use touchup::io::recording::{
    BadMessage, FilePlace, RecordingError, RecordingReader, StampSource, Topics, write_recording,
};
use touchup::stylus::{Message, StampedPose, StampedWrench};

mod damage;
mod lengths;
mod made;
mod markers;
mod resumed;

use crate::shared::shared;
use made::{START_NS, db3_of, mcap_bytes, pose, put, read, touch, wrench};

fn probe_topics() -> Topics {
    Topics {
        pose: "/probe/pose".into(),
        wrench: "/probe/wrench".into(),
        markers: None,
    }
}

fn poses_and_wrenches(messages: &[Message]) -> (Vec<StampedPose>, Vec<StampedWrench>) {
    let mut split = (Vec::new(), Vec::new());
    for message in messages {
        match message {
            Message::Pose(pose) => split.0.push(*pose),
            Message::Wrench(wrench) => split.1.push(*wrench),
        }
    }
    split
}

fn read_all(path: &Path, topics: &Topics) -> Vec<Message> {
    RecordingReader::open(path, topics)
        .unwrap()
        .collect::<Result<_, _>>()
        .unwrap()
}

/// 12,000 additions of numbers below 1 kN: 12,000 roundings of a sum below 1e5.
const SUM_TOL: f64 = 12_000.0 * 1e5 * f64::EPSILON;

#[test]
fn kidney_gives_the_samples_that_rosbags_reads() {
    let Some(folder) = shared("force/bags/kidneyZ1_mcap") else {
        return;
    };
    let mut reader = RecordingReader::open(&folder, &probe_topics()).unwrap();
    assert_eq!(reader.message_count(), Some(12_000));
    let messages: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
    assert_eq!(
        (reader.pose_frame(), reader.wrench_frame()),
        (Some("psm_base"), Some("psm_base"))
    );
    assert!(reader.bad_messages().is_empty() && !reader.truncated());

    let (poses, wrenches) = poses_and_wrenches(&messages);
    assert_eq!((poses.len(), wrenches.len()), (6000, 6000));
    let stamps = |stamps: &mut dyn Iterator<Item = i64>| stamps.map(i128::from).sum::<i128>();
    assert_eq!(
        stamps(&mut poses.iter().map(|p| p.stamp_ns)),
        8_862_000_292_086_466_200_000
    );
    assert_eq!(
        stamps(&mut wrenches.iter().map(|w| w.stamp_ns)),
        8_862_000_292_086_466_200_000
    );
    let (first, last) = (poses[0], poses[5999]);
    assert_eq!(first.stamp_ns, 1_477_000_002_840_800_000);
    assert_eq!(
        first.pose_ot.translation.vector,
        Vector3::new(0.011192, -0.009599, -0.1307799)
    );
    assert_eq!(last.stamp_ns, 1_477_000_094_575_900_000);
    assert_eq!(
        last.pose_ot.translation.vector,
        Vector3::new(0.0167898, -0.00031790000000000003, -0.1423268)
    );
    let position: Vector3<f64> = poses.iter().map(|p| p.pose_ot.translation.vector).sum();
    assert!((position - Vector3::new(117.7448295, -48.7414362, -887.5090616)).amax() < SUM_TOL);
    let q = first.pose_ot.rotation;
    // five decimals in the file: its norms are 0.99986 to 1.00013, ours are 1
    let x_y_z_w = [0.0193, 0.63583, -0.76957, 0.05762];
    assert!(
        [q.i, q.j, q.k, q.w]
            .iter()
            .zip(x_y_z_w)
            .all(|(ours, theirs)| (ours - theirs).abs() < 1.5e-4)
    );
    assert_eq!(
        wrenches[0].wrench.force,
        Vector3::new(0.18851, -0.06669, 0.13242)
    );
    assert_eq!(
        wrenches[5999].wrench.force,
        Vector3::new(0.12428, -0.19402, 0.02216)
    );
    let force: Vector3<f64> = wrenches.iter().map(|w| w.wrench.force).sum();
    assert!((force - Vector3::new(760.83443, -335.11331, 916.58731)).amax() < SUM_TOL);
    assert!(wrenches.iter().all(|w| w.wrench.torque == Vector3::zeros()));
}

#[test]
fn kidney_is_the_same_in_both_containers() {
    let (Some(mcap), Some(db3)) = (
        shared("force/bags/kidneyZ1_mcap"),
        shared("force/bags/kidneyZ1_db3"),
    ) else {
        return;
    };
    let from_mcap = read_all(&mcap, &probe_topics());
    assert_eq!(from_mcap, read_all(&db3, &probe_topics()));
    assert_eq!(
        from_mcap,
        read_all(&db3.join("kidneyZ1_db3.db3"), &probe_topics()),
        "the file without its folder"
    );
}

#[test]
fn judge_cases_have_the_messages_their_metadata_state() {
    let Some(cases) = shared("cases") else { return };
    let mut folders: Vec<_> = fs::read_dir(cases)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    folders.sort();
    assert_eq!(folders.len(), 7);
    for folder in folders {
        let meta: serde_json::Value =
            serde_json::from_slice(&fs::read(folder.join("meta.json")).unwrap()).unwrap();
        let mut reader =
            RecordingReader::open(&folder.join("touch.mcap"), &Topics::default()).unwrap();
        let messages: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
        let (poses, wrenches) = poses_and_wrenches(&messages);
        assert_eq!(
            Some(poses.len() as u64),
            meta["poses"].as_u64(),
            "{folder:?}"
        );
        assert_eq!(
            Some(wrenches.len() as u64),
            meta["wrenches"].as_u64(),
            "{folder:?}"
        );
        assert_eq!(
            (reader.pose_frame(), reader.wrench_frame()),
            (Some("object"), Some("stylus"))
        );
    }
}

#[test]
fn plate_gives_the_sums_that_rosbags_reads() {
    let Some(path) = shared("cases/plate/touch.mcap") else {
        return;
    };
    let (poses, wrenches) = poses_and_wrenches(&read_all(&path, &Topics::default()));
    assert_eq!((poses.len(), wrenches.len()), (37_802, 75_590));
    assert_eq!(
        wrenches
            .iter()
            .map(|w| i128::from(w.stamp_ns))
            .sum::<i128>(),
        133_038_402_874_237_911_713_631
    );
    // the file holds multiples of 2^-22 m and 2^-12 N or coarser, so these sums are exact in any
    // order
    let position: Vector3<f64> = poses.iter().map(|p| p.pose_ot.translation.vector).sum();
    assert_eq!(
        position,
        Vector3::new(988.9942569732666, 1809.0157299041748, 481.8626708984375)
    );
    let force: Vector3<f64> = wrenches.iter().map(|w| w.wrench.force).sum();
    assert_eq!(
        force,
        Vector3::new(1050.29833984375, -4037.46337890625, 119716.17724609375)
    );
}

#[test]
fn genuine_recordings_without_the_topics_list_what_they_have() {
    let Some(bags) = shared("force/bags") else {
        return;
    };
    for (file, has) in [
        ("ros2_rosbag2/talker.mcap", "/topic (std_msgs/msg/String)"),
        ("ros2_rosbag2/talker.db3", "/topic (std_msgs/msg/String)"),
        (
            "ros2_rosbag2/cdr_test_0.mcap",
            "/array_topic (test_msgs/msg/Arrays)",
        ),
        (
            "ros2_rosbag2/topics_and_services.mcap",
            "/rosout (rcl_interfaces/msg/Log)",
        ),
        ("plotjuggler_rosbag2_test", "/imu (sensor_msgs/msg/Imu)"),
    ] {
        let error = RecordingReader::open(&bags.join(file), &Topics::default())
            .err()
            .unwrap();
        assert!(
            matches!(error, RecordingError::MissingTopic { .. }),
            "{error}"
        );
        let text = error.to_string();
        assert!(
            text.contains(has) && text.contains("--pose-topic") && text.contains(file),
            "{text}"
        );
    }
    let other = |pose: &str, wrench: &str| {
        let topics = Topics {
            pose: pose.into(),
            wrench: wrench.into(),
            markers: None,
        };
        RecordingReader::open(&bags.join("plotjuggler_rosbag2_test"), &topics)
            .err()
            .unwrap()
            .to_string()
    };
    let text = other("/pose", "/imu");
    assert!(
        text.contains("sensor_msgs/msg/Imu") && text.contains("geometry_msgs/msg/WrenchStamped"),
        "{text}"
    );
    assert!(text.contains("--wrench-topic"), "{text}");
    assert!(other("/pose", "/nothing").contains("--wrench-topic"));
}

proptest! {
    #[test]
    fn what_is_written_is_read(values in prop::collection::vec((any::<bool>(), any::<[f64; 3]>()), 0..200)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("touch.mcap");
        let stamp = |i: usize| START_NS + 1_234_567 * i as i64;
        // the rotation must be one; the rest may be anything, NaN and infinity too
        let angles = |v: [f64; 3]| v.map(|x| if x.is_finite() { x % 3.0 } else { 0.0 });
        let make = |(i, (is_pose, v)): (usize, &(bool, [f64; 3]))| match (is_pose, pose(stamp(i), angles(*v))) {
            (true, Message::Pose(mut pose)) => {
                pose.pose_ot.translation = Translation3::from(*v);
                Message::Pose(pose)
            }
            _ => wrench(stamp(i), *v),
        };
        let messages: Vec<_> = values.iter().enumerate().map(make).collect();
        write_recording(&path, &Topics::default(), "O", "T", messages.iter().copied()).unwrap();
        let back = read_all(&path, &Topics::default());
        prop_assert_eq!(back.len(), messages.len());
        for (ours, theirs) in back.iter().zip(&messages) {
            prop_assert_eq!(bits(ours), bits(theirs));
        }
    }
}

/// All numbers of a message, bit by bit, so that NaN compares too.
fn bits(message: &Message) -> (i64, Vec<u64>) {
    let numbers: Vec<f64> = match message {
        Message::Pose(p) => p
            .pose_ot
            .translation
            .vector
            .iter()
            .chain(p.pose_ot.rotation.coords.iter())
            .copied()
            .collect(),
        Message::Wrench(w) => w
            .wrench
            .force
            .iter()
            .chain(w.wrench.torque.iter())
            .copied()
            .collect(),
    };
    (
        message.stamp_ns(),
        numbers.into_iter().map(f64::to_bits).collect(),
    )
}

#[test]
fn the_same_messages_give_the_same_bytes() {
    let messages = touch(20_000);
    assert_eq!(mcap_bytes(&messages), mcap_bytes(&messages));
}

#[test]
fn a_failed_recording_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = put(folder.path(), "touch.mcap", b"old");
    let messages = [touch(4), vec![wrench(-1, [0.0; 3])]].concat();
    let error = write_recording(&path, &Topics::default(), "O", "T", messages).unwrap_err();
    assert!(
        matches!(error, RecordingError::Stamp { stamp_ns: -1 }),
        "{error}"
    );
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names_in(folder.path()), ["touch.mcap"]);
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn compressed_files_and_messages_read_as_plain_ones() {
    let folder = tempfile::tempdir().unwrap();
    let messages = touch(3000);
    let mcap = mcap_bytes(&messages);
    let zstd = |bytes: &[u8]| zstd::encode_all(bytes, 3).unwrap();
    let packed_mcap = put(folder.path(), "touch.mcap.zstd", &zstd(&mcap));
    db3_of(&folder.path().join("each.db3"), &mcap, zstd);
    db3_of(&folder.path().join("plain.db3"), &mcap, <[u8]>::to_vec);
    let packed_db3 = put(
        folder.path(),
        "touch.db3.zstd",
        &zstd(&fs::read(folder.path().join("plain.db3")).unwrap()),
    );
    for path in [
        packed_mcap,
        packed_db3,
        folder.path().join("each.db3"),
        folder.path().join("plain.db3"),
    ] {
        let outcome = read(&path);
        assert!(outcome.error.is_none(), "{:?}", outcome.error);
        assert!(!outcome.truncated && outcome.bad == 0);
        assert!(outcome.messages == messages, "{path:?}");
    }
}

#[test]
fn a_db3_in_write_ahead_mode_is_read_without_a_trace() {
    let folder = tempfile::tempdir().unwrap();
    let messages = touch(30);
    let path = folder.path().join("a b#c?d%41.db3");
    db3_of(&path, &mcap_bytes(&messages), <[u8]>::to_vec);
    let db = rusqlite::Connection::open(&path).unwrap();
    db.pragma_update(None, "journal_mode", "WAL").unwrap();
    db.close().unwrap();
    assert!(read(&path).messages == messages);
    assert_eq!(names_in(folder.path()), ["a b#c?d%41.db3"]);
    let wal = put(folder.path(), "a b#c?d%41.db3-wal", b"the rest");
    assert!(read(&path).truncated);
    assert_eq!(fs::read(wal).unwrap(), b"the rest");
}

#[test]
fn what_lies_beside_the_files_of_a_recording_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = mcap_bytes(&touch(600));
    put(folder.path(), "a.mcap", &bytes);
    let metadata = b"rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths: [a.mcap]\n";
    put(folder.path(), "metadata.yaml", metadata);
    let opened = || RecordingReader::open(folder.path(), &Topics::default());
    for name in ["c.mcap", "c.db3", "c.db3.zstd"] {
        // nothing is in it
        let beside = put(folder.path(), name, b"");
        assert!(opened().is_ok(), "{name}");
        put(folder.path(), name, &bytes);
        let text = opened().err().unwrap().to_string();
        let wanted = format!("{name:?} lies beside the files that it names");
        assert!(text.contains(&wanted), "{text}");
        fs::remove_file(beside).unwrap();
    }
}

#[test]
fn a_folder_is_read_in_the_order_of_its_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let messages = touch(600);
    put(folder.path(), "b.mcap", &mcap_bytes(&messages[..300]));
    // a later part need not have both topics
    let poses: Vec<_> = messages[300..]
        .iter()
        .filter(|m| matches!(m, Message::Pose(_)))
        .copied()
        .collect();
    put(folder.path(), "a.mcap", &mcap_bytes(&poses));
    let metadata = |second: &str| {
        let text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths: [x/b.mcap, {second}]\n"
        );
        put(folder.path(), "metadata.yaml", text.as_bytes());
        RecordingReader::open(folder.path(), &Topics::default())
    };
    let reader = metadata("a.mcap").unwrap();
    assert_eq!(reader.message_count(), Some(400));
    let back: Vec<_> = reader.map(Result::unwrap).collect();
    assert!(back == [&messages[..300], &poses].concat());
    let text = metadata("gone.mcap").err().unwrap().to_string();
    assert!(
        text.contains("gone.mcap") && text.contains("metadata.yaml"),
        "{text}"
    );
    fs::write(
        folder.path().join("metadata.yaml"),
        "rosbag2_bagfile_information: [",
    )
    .unwrap();
    assert!(matches!(
        RecordingReader::open(folder.path(), &Topics::default()),
        Err(RecordingError::Metadata { .. })
    ));
    // a killed recorder leaves none: then the names give the order
    fs::remove_file(folder.path().join("metadata.yaml")).unwrap();
    fs::rename(folder.path().join("a.mcap"), folder.path().join("c.mcap")).unwrap();
    let reader = RecordingReader::open(folder.path(), &Topics::default()).unwrap();
    assert!(
        reader
            .map(Result::unwrap)
            .eq([&messages[..300], &poses].concat())
    );
    for name in ["b.mcap", "c.mcap"] {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    // a session that ends before the first message leaves nothing, or a file without a start
    for begun in [None, Some("0.mcap")] {
        begun.map(|name| put(folder.path(), name, b"\x89MCAP0\r\n"));
        let empty = RecordingReader::open(folder.path(), &Topics::default())
            .err()
            .unwrap();
        assert!(
            matches!(empty, RecordingError::NotARecording { .. }),
            "{empty}"
        );
        assert!(
            empty.to_string().contains("nothing was recorded"),
            "{empty}"
        );
    }
}

#[test]
fn messages_that_cannot_be_used_are_counted_and_reading_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("touch.db3");
    let messages = touch(9); // poses at rows 1, 4, 7
    db3_of(&path, &mcap_bytes(&messages), <[u8]>::to_vec);
    let db = rusqlite::Connection::open(&path).unwrap();
    // payload: 4 encapsulation, 8 stamp, 4 length, "O\0" and 2 bytes of padding, 24 position, 32
    // quaternion
    let zeros = "substr(data, 1, 44) || zeroblob(32)";
    db.execute(
        &format!("UPDATE messages SET data = CAST({zeros} AS BLOB) WHERE id = 4"),
        [],
    )
    .unwrap();
    db.execute("UPDATE messages SET data = x'0001' WHERE id IN (2, 3)", [])
        .unwrap();
    let other_frame = "substr(data, 1, 16) || x'51' || substr(data, 18)";
    db.execute(
        &format!("UPDATE messages SET data = CAST({other_frame} AS BLOB) WHERE id = 7"),
        [],
    )
    .unwrap();
    db.execute(
        "UPDATE messages SET data = zeroblob(100000) WHERE id = 9",
        [],
    )
    .unwrap();
    db.close().unwrap();
    let mut reader = RecordingReader::open(&path, &Topics::default()).unwrap();
    let back: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
    assert_eq!(back, [messages[0], messages[4], messages[5], messages[7]]);
    let bad: Vec<_> = reader
        .bad_messages()
        .iter()
        .map(|(why, bad)| (*why, bad.poses + bad.wrenches, bad.place))
        .collect();
    let expected = [
        (BadMessage::Malformed, 3, FilePlace::Row(2)),
        (BadMessage::Quaternion, 1, FilePlace::Row(4)),
        (BadMessage::FrameChanged, 1, FilePlace::Row(7)),
    ];
    assert_eq!(bad, expected);
}

#[test]
fn other_files_are_named_for_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str, bytes: &[u8]| {
        read(&put(folder.path(), name, bytes))
            .error
            .unwrap()
            .to_string()
    };
    assert!(text("empty.mcap", b"").contains("empty.mcap: not a recording: the file is empty"));
    assert!(text("old.bag", b"#ROSBAG V1.2\n").contains("rosbags-convert"));
    assert!(text("mesh.stl", b"solid part\n").contains("solid part"));
    let path = folder.path().join("other.db3");
    rusqlite::Connection::open(&path)
        .unwrap()
        .execute_batch("CREATE TABLE t(x)")
        .unwrap();
    assert!(read(&path).error.unwrap().to_string().contains("topics"));
    assert!(matches!(
        read(&folder.path().join("none.mcap")).error,
        Some(RecordingError::Io { .. })
    ));
}

/// Headers without a stamp: with the log times the messages equal those with stamps.
#[test]
fn by_the_log_messages_without_a_stamp_have_one() {
    let folder = tempfile::tempdir().unwrap();
    let messages = touch(200);
    let mcap = mcap_bytes(&messages);
    let unstamped = |data: &[u8]| {
        let mut data = data.to_vec();
        // behind the four bytes of CDR: s and ns
        data[4..12].fill(0);
        data
    };
    let db3 = folder.path().join("unstamped.db3");
    db3_of(&db3, &mcap, unstamped);
    let mut writer = ::mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    for message in ::mcap::MessageStream::new(&mcap).unwrap() {
        let message = message.unwrap();
        writer
            .write(&::mcap::Message {
                data: unstamped(&message.data).into(),
                ..message
            })
            .unwrap();
    }
    writer.finish().unwrap();
    let rewritten = put(
        folder.path(),
        "unstamped.mcap",
        &writer.into_inner().into_inner(),
    );
    for path in [db3, rewritten] {
        let read = |stamps| -> Vec<Message> {
            let reader = RecordingReader::open(&path, &Topics::default())
                .unwrap()
                .stamped_by(stamps);
            reader.map(Result::unwrap).collect()
        };
        assert!(
            read(StampSource::Header)
                .iter()
                .all(|message| message.stamp_ns() == 0),
            "{}",
            path.display()
        );
        assert_eq!(read(StampSource::Log), messages, "{}", path.display());
    }
}
