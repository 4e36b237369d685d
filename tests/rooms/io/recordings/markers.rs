//! Recordings that hold the markers on the stylus in place of its pose.

use std::path::Path;

use nalgebra::Point3;
use touchup::io::recording::{
    BadMessage, Record, RecordingError, RecordingReader, Topics, write_recording,
};
use touchup::stylus::{MarkerFrame, MarkerObservation, Message};

use crate::io::recordings::made::{START_NS, pose, put, wrench};

fn topics() -> Topics {
    Topics {
        markers: Some("/stylus/markers".into()),
        ..Topics::default()
    }
}

/// Every third frame sees nothing.
fn frame(i: usize) -> MarkerFrame {
    let mut frame = MarkerFrame::new(START_NS + 2_000_000 * i as i64);
    for label in 0..if i.is_multiple_of(3) { 0 } else { 6 } {
        // numbers that 32 bits hold
        let position = Point3::new(f64::from(label) / 8.0, (i % 100) as f64 / 64.0, -1.5);
        assert!(frame.see(MarkerObservation { label, position }));
    }
    frame
}

/// Wrench, pose and markers in turn.
fn records(count: usize) -> Vec<Record> {
    let one = |i: usize| match i % 3 {
        0 => Record::Message(wrench(
            START_NS + i as i64 * 1_000_000,
            [i as f64, 0.0, 1.0],
        )),
        1 => Record::Message(pose(START_NS + i as i64 * 1_000_000, [0.1, 0.2, 0.3])),
        _ => Record::Markers(Box::new(frame(i))),
    };
    (0..count).map(one).collect()
}

fn without_poses(records: &[Record]) -> Vec<Record> {
    records
        .iter()
        .filter(|record| !matches!(record, Record::Message(Message::Pose(_))))
        .cloned()
        .collect()
}

fn written(path: &Path, records: &[Record]) -> Vec<u8> {
    write_recording(path, &topics(), "O", "T", records.iter().cloned()).unwrap();
    std::fs::read(path).unwrap()
}

fn read_all(path: &Path) -> (Vec<Record>, Option<RecordingError>, u64) {
    let mut reader = match RecordingReader::open(path, &topics()) {
        Ok(reader) => reader,
        Err(error) => return (Vec::new(), Some(error), 0),
    };
    let (mut records, mut ended) = (Vec::new(), None);
    while let Some(record) = reader.next_record() {
        assert!(ended.is_none(), "an error is the last item");
        match record {
            Ok(record) => records.push(record),
            Err(error) => ended = Some(error),
        }
    }
    let bad = reader
        .bad_messages()
        .values()
        .map(|bad| bad.poses + bad.wrenches)
        .sum();
    (records, ended, bad)
}

/// The payloads of an MCAP, read by the `mcap` crate, as a rosbag2 SQLite file.
fn db3_of(path: &Path, mcap: &[u8]) {
    let db = rusqlite::Connection::open(path).unwrap();
    db.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
         BEGIN",
    )
    .unwrap();
    for message in ::mcap::MessageStream::new(mcap).unwrap() {
        let message = message.unwrap();
        let type_name = message.channel.schema.as_ref().unwrap().name.clone();
        let topic = i64::from(message.channel.id);
        db.execute(
            "INSERT OR IGNORE INTO topics VALUES (?1, ?2, ?3, 'cdr')",
            rusqlite::params![topic, message.channel.topic, type_name],
        )
        .unwrap();
        db.execute(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)",
            rusqlite::params![topic, message.log_time as i64, &message.data[..]],
        )
        .unwrap();
    }
    db.execute_batch("COMMIT").unwrap();
}

#[test]
fn markers_are_read_in_place_of_poses_from_both_containers() {
    let folder = tempfile::tempdir().unwrap();
    // wrenches, poses and markers each by their stamps, as a recorder puts them down
    let mut records = records(3000);
    records.sort_by_key(Record::stamp_ns);
    let mcap = folder.path().join("touch.mcap");
    let bytes = written(&mcap, &records);
    let db3 = folder.path().join("touch.db3");
    db3_of(&db3, &bytes);
    for path in [&mcap, &db3] {
        let (back, error, bad) = read_all(path);
        assert!(error.is_none() && bad == 0, "{error:?}");
        assert!(back == without_poses(&records), "{path:?}");
        let mut reader = RecordingReader::open(path, &topics()).unwrap();
        assert_eq!(reader.message_count(), Some(2000));
        assert_eq!(
            reader
                .by_ref()
                .filter(|message| matches!(message, Ok(Message::Wrench(_))))
                .count(),
            1000
        );
        assert_eq!(
            (reader.pose_frame(), reader.wrench_frame()),
            (Some("O"), Some("T"))
        );
        // and the poses are still there on request
        let poses = RecordingReader::open(path, &Topics::default()).unwrap();
        assert_eq!(
            poses
                .filter(|message| matches!(message, Ok(Message::Pose(_))))
                .count(),
            1000
        );
    }
}

#[test]
fn a_recording_without_the_markers_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("touch.mcap");
    write_recording(&path, &Topics::default(), "O", "T", records(30)).unwrap();
    let text = RecordingReader::open(&path, &topics())
        .err()
        .unwrap()
        .to_string();
    assert!(
        text.contains("/stylus/markers") && text.contains("--markers-topic"),
        "{text}"
    );
    let wrong = Topics {
        markers: Some("/stylus/pose".into()),
        ..Topics::default()
    };
    let text = RecordingReader::open(&path, &wrong)
        .err()
        .unwrap()
        .to_string();
    assert!(
        text.contains("sensor_msgs/msg/PointCloud2") && text.contains("--markers-topic"),
        "{text}"
    );
}

#[test]
#[ignore = "a slow proof"]
fn cut_and_flipped_recordings_of_markers_lose_no_more_than_what_is_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let records = records(6000);
    let bytes = written(&folder.path().join("whole.mcap"), &records);
    let whole = without_poses(&records);
    for len in (0..bytes.len()).step_by(bytes.len() / 100) {
        let (back, error, _) = read_all(&put(folder.path(), "cut.mcap", &bytes[..len]));
        assert!(back == whole[..back.len()], "cut to {len} bytes");
        assert!(
            error.is_some() || back.len() == whole.len(),
            "cut to {len} bytes"
        );
    }
    let db3 = folder.path().join("whole.db3");
    db3_of(&db3, &bytes);
    let plain = std::fs::read(&db3).unwrap();
    for at in (100..plain.len()).step_by(plain.len() / 200) {
        let mut bytes = plain.clone();
        bytes[at] ^= 1 << (at % 8);
        let (back, ..) = read_all(&put(folder.path(), "flipped.db3", &bytes));
        assert!(back.len() <= whole.len(), "byte {at}");
    }
}

#[test]
fn clouds_that_cannot_be_used_are_counted_and_reading_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("touch.db3");
    let records = records(30);
    db3_of(&path, &written(&folder.path().join("touch.mcap"), &records));
    let db = rusqlite::Connection::open(&path).unwrap();
    let clouds = "topic_id = (SELECT id FROM topics WHERE name = '/stylus/markers')";
    // width: behind 4 bytes of encapsulation, 8 of stamp, 4 + 4 of the frame's name, 4 of height
    let wide = "CAST(substr(data, 1, 24) || x'ffffffff' || substr(data, 29) AS BLOB)";
    let changed = db
        .execute(
            &format!("UPDATE messages SET data = {wide} WHERE {clouds}"),
            [],
        )
        .unwrap();
    db.close().unwrap();
    let mut reader = RecordingReader::open(&path, &topics()).unwrap();
    let mut wrenches = 0;
    while let Some(record) = reader.next_record() {
        assert!(matches!(record, Ok(Record::Message(Message::Wrench(_)))));
        wrenches += 1;
    }
    assert_eq!((changed, wrenches), (10, 10));
    assert_eq!(reader.bad_messages()[&BadMessage::Cloud].poses, 10);
}
