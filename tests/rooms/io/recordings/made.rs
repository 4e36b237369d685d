//! Recordings made by the tests.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rusqlite::{Connection, params};
use touchup::io::recording::{RecordingError, RecordingReader, RecordingWriter, Topics};
use touchup::stylus::{Message, StampedPose, StampedWrench, Wrench};

pub const START_NS: i64 = 1_760_000_000_000_000_000;

pub fn pose(stamp_ns: i64, v: [f64; 3]) -> Message {
    let rotation = UnitQuaternion::from_euler_angles(v[0], v[1], v[2]);
    Message::Pose(StampedPose {
        stamp_ns,
        pose_ot: Isometry3::from_parts(Translation3::from(v), rotation),
    })
}

pub fn wrench(stamp_ns: i64, v: [f64; 3]) -> Message {
    let wrench = Wrench {
        force: Vector3::from(v),
        torque: -0.1 * Vector3::from(v),
    };
    Message::Wrench(StampedWrench { stamp_ns, wrench })
}

/// A pose, then two wrenches, over and over; numbers that do not compress to nothing.
pub fn touch(messages: usize) -> Vec<Message> {
    let values = |i: usize| [0.37, 0.59, 0.83].map(|rate| (rate * i as f64 * i as f64).sin());
    let stamp = |i: usize| START_NS + 500_000 * i as i64;
    (0..messages)
        .map(|i| {
            if i % 3 == 0 {
                pose(stamp(i), values(i))
            } else {
                wrench(stamp(i), values(i))
            }
        })
        .collect()
}

pub fn mcap_bytes(messages: &[Message]) -> Vec<u8> {
    let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), &Topics::default()).unwrap();
    let frame = |message: &Message| {
        if matches!(message, Message::Pose(_)) {
            "O"
        } else {
            "T"
        }
    };
    messages
        .iter()
        .for_each(|message| writer.write(*message, frame(message)).unwrap());
    writer.finish().unwrap().into_inner()
}

pub fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// The payloads of an MCAP, read by the `mcap` crate, as a rosbag2 SQLite file.
pub fn db3_of(path: &Path, mcap: &[u8], payload: impl Fn(&[u8]) -> Vec<u8>) {
    let db = Connection::open(path).unwrap();
    db.execute_batch(
        "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                             serialization_format TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
                               data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);
         INSERT INTO topics VALUES (1, '/stylus/pose', 'geometry_msgs/msg/PoseStamped', 'cdr'),
                                   (2, '/stylus/wrench', 'geometry_msgs/msg/WrenchStamped', 'cdr');
         BEGIN",
    )
    .unwrap();
    for message in ::mcap::MessageStream::new(mcap).unwrap() {
        let message = message.unwrap();
        let topic = if message.channel.topic == "/stylus/pose" {
            1
        } else {
            2
        };
        db.prepare_cached("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)")
            .unwrap()
            .execute(params![
                topic,
                message.log_time as i64,
                payload(&message.data)
            ])
            .unwrap();
    }
    db.execute_batch("COMMIT").unwrap();
}

/// Everything that the reader returned, and the error at its end.
pub struct Outcome {
    pub messages: Vec<Message>,
    pub error: Option<RecordingError>,
    pub truncated: bool,
    pub bad: u64,
}

pub fn read(path: &Path) -> Outcome {
    let mut outcome = Outcome {
        messages: Vec::new(),
        error: None,
        truncated: false,
        bad: 0,
    };
    let mut reader = match RecordingReader::open(path, &Topics::default()) {
        Ok(reader) => reader,
        Err(error) => {
            outcome.error = Some(error);
            return outcome;
        }
    };
    for message in reader.by_ref() {
        assert!(outcome.error.is_none(), "an error is the last item");
        match message {
            Ok(message) => outcome.messages.push(message),
            Err(error) => outcome.error = Some(error),
        }
    }
    outcome.truncated = reader.truncated();
    outcome.bad = reader
        .bad_messages()
        .values()
        .map(|bad| bad.poses + bad.wrenches)
        .sum();
    outcome
}
