//! Short recordings that claim long contents.

use std::path::Path;

use touchup::io::recording::{RecordingError, RecordingReader, Topics};

use super::made::read;
use crate::shared::shared;

const TOPICS: &str =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
    INSERT INTO topics VALUES (1, '/stylus/pose', 'geometry_msgs/msg/PoseStamped', 'cdr'),
                              (2, '/stylus/wrench', 'geometry_msgs/msg/WrenchStamped', 'cdr');";
const MESSAGES: &str = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);";

fn made(path: &Path, schema: &str) {
    rusqlite::Connection::open(path)
        .unwrap()
        .execute_batch(schema)
        .unwrap();
}

/// A column that computes 400 MB of a row of a few bytes: SQLite refuses it by the limit, before it
/// makes it.
#[test]
fn a_generated_column_is_refused_by_its_length() {
    let folder = tempfile::tempdir().unwrap();
    let topics = folder.path().join("topics.db3");
    made(
        &topics,
        &format!(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, n TEXT, type TEXT, serialization_format TEXT,
                                 name TEXT GENERATED ALWAYS AS (hex(zeroblob(200000000))) VIRTUAL);
             INSERT INTO topics(id, type, serialization_format) VALUES (1, 'a/msg/B', 'cdr'); {MESSAGES}"
        ),
    );
    let data = folder.path().join("data.db3");
    made(
        &data,
        &format!(
            "{TOPICS} CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
                data BLOB GENERATED ALWAYS AS (replace(hex(zeroblob(100000000)), '00', 'abcd')) VIRTUAL);
             INSERT INTO messages(topic_id, timestamp) VALUES (1, 0), (2, 0);"
        ),
    );
    for path in [&topics, &data] {
        let error = read(path).error.expect("it is damaged").to_string();
        assert!(error.contains("too big"), "{error}");
    }
    for name in ["findings/bomb-topics.db3", "findings/bomb-data.db3"] {
        let Some(path) = shared(name) else { return };
        let error = read(&path).error.expect("it is damaged").to_string();
        assert!(error.contains("too big"), "{error}");
    }
}

/// A message of another topic may have any length: the reader skips it.
#[test]
fn a_long_message_of_another_topic_is_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.db3");
    made(
        &path,
        &format!(
            "{TOPICS} {MESSAGES} INSERT INTO topics VALUES (3, '/camera', 'sensor_msgs/msg/Image', 'cdr');
             INSERT INTO messages(topic_id, timestamp, data) VALUES (3, 0, zeroblob(30000000)), (1, 1, x'00010000');"
        ),
    );
    let outcome = read(&path);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.bad, 1, "the short one is there, and malformed");
}

/// Names are short one by one and long together.
#[test]
fn the_names_of_all_topics_together_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("names.db3");
    let many = "WITH RECURSIVE n(i) AS (SELECT 3 UNION ALL SELECT i + 1 FROM n WHERE i < 1000)
                INSERT INTO topics SELECT i, hex(zeroblob(30000)), 'a/msg/B', 'cdr' FROM n;";
    made(&path, &format!("{TOPICS} {MESSAGES} {many}"));
    let error = RecordingReader::open(&path, &Topics::default())
        .err()
        .expect("it is refused");
    assert!(matches!(error, RecordingError::Damaged { .. }), "{error}");
    assert!(
        error.to_string().contains("names of topics and types of"),
        "{error}"
    );
}

/// Virtual tables run code of their own on the file's text.
#[test]
fn a_virtual_table_is_no_table_of_messages() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("virtual.db3");
    made(
        &path,
        &format!("{TOPICS} CREATE VIRTUAL TABLE messages USING fts5(topic_id, timestamp, data);"),
    );
    let error = RecordingReader::open(&path, &Topics::default())
        .err()
        .expect("it is refused");
    assert!(
        matches!(error, RecordingError::NotARecording { .. }),
        "{error}"
    );
}
