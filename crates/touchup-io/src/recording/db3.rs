//! Reads rosbag2's SQLite files (`.db3`): tables `topics` and `messages`.
//!
//! The file is opened read-only and as immutable, so that nothing is created beside it, even for
//! one left in write-ahead mode; then its last part may sit in a `-wal` file that is not read, and
//! the file counts as truncated.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, params};
use tempfile::NamedTempFile;

use super::mcap_files::framing::NameBytes;
use super::messages::wire::MAX_MESSAGE_BYTES;
use super::topics::check_topic;
use super::{FilePlace, RecordingLayout};
use crate::recording::error::Damage;
use crate::recording::error::RecordingError;
use crate::recording::layout::TopicInfo;
use crate::recording::layout::TopicKind;
use crate::recording::messages::message_type::MessageFormat;
use crate::recording::recording_file::RawMessage;
use crate::recording::recording_file::RecordingFile;

pub(super) const MAGIC: [u8; 16] = *b"SQLite format 3\0";
/// Rows fetched at a time.
const BATCH_ROWS: usize = 1024;
/// Largest unpacked size of a `.db3.zstd`, so that a small file cannot fill the disk.
const MAX_UNPACKED_BYTES: u64 = 16 << 30;

/// Longest text or blob of the file, including computed ones: a generated column makes long values
/// from a short file. SQLite itself refuses them, before it takes the memory.
const MAX_VALUE_BYTES: i32 = 1 << 20;
/// Maximum number of rows in the table of topics.
const MAX_TOPICS: usize = 65_536;

/// Longer payloads are not loaded; they come as NULL and count as malformed.
const FETCH: &str = "SELECT id, timestamp, topic_id, CASE WHEN length(data) <= ?1 THEN data END FROM messages \
                     WHERE topic_id IN (?2, ?3, ?4) AND (timestamp, id) > (?5, ?6) ORDER BY timestamp, id LIMIT ?7";

/// Messages of the topics of a touch of one SQLite file, by time of reception, then by row.
pub(super) struct Db3Reader {
    path: PathBuf,
    db: Connection,
    /// Holds the unpacked file while it is read.
    _unpacked: Option<NamedTempFile>,
    topics: Vec<TopicInfo>,
    /// Topics in use: row in the table `topics`, content and format.
    read: Vec<(i64, TopicKind, MessageFormat)>,
    rows: VecDeque<RawMessage<'static>>,
    /// Time and row of the last message fetched.
    last: (i64, i64),
    /// Error that ended the fetching, or a cut last page; comes after the rows before it.
    failed: Option<Damage>,
    done: bool,
    truncated: bool,
}

impl Db3Reader {
    /// Opens a file (`packed`: compressed as a whole by zstd) and reads its table of topics.
    pub fn open(
        path: &Path,
        layout: &RecordingLayout,
        packed: bool,
    ) -> Result<Self, RecordingError> {
        let unpacked = if packed { Some(unpack(path)?) } else { None };
        let db_path = unpacked.as_ref().map_or(path, |file| file.path());
        let damaged = |damage| RecordingError::Damaged {
            path: path.to_owned(),
            place: FilePlace::Row(0),
            damage,
        };
        let db = connect(db_path).map_err(|error| damaged(error.into()))?;
        if !has_tables(&db).map_err(|error| damaged(error.into()))? {
            let reason =
                "a SQLite file without rosbag2's tables `topics` and `messages`".to_owned();
            return Err(RecordingError::NotARecording {
                path: path.to_owned(),
                reason,
            });
        }
        let rows = read_topics(&db).map_err(damaged)?;
        let failed = find_cut(&db, db_path).err();
        // a topic of a wrong type is an error of the caller's topic check
        let reads = |(id, info): &(i64, TopicInfo)| {
            check_topic(path, layout, info)
                .ok()
                .flatten()
                .map(|(kind, format)| (*id, kind, format))
        };
        let mut read: Vec<_> = rows.iter().filter_map(reads).collect();
        // the first row of each topic in the layout
        read.sort_by_key(|(id, kind, _)| (*kind, *id));
        read.dedup_by_key(|(_, kind, _)| *kind);
        Ok(Self {
            path: path.to_owned(),
            truncated: failed.is_some() || has_unmerged_part(path),
            read,
            db,
            _unpacked: unpacked,
            topics: rows.into_iter().map(|(_, info)| info).collect(),
            rows: VecDeque::new(),
            last: (i64::MIN, i64::MIN),
            failed,
            done: false,
        })
    }

    fn damaged(&self, damage: Damage) -> RecordingError {
        let row = if self.last.1 == i64::MIN {
            0
        } else {
            self.last.1
        };
        RecordingError::Damaged {
            path: self.path.clone(),
            place: FilePlace::Row(row),
            damage,
        }
    }

    /// Fetches the next rows; those before an error stay.
    fn fetch(&mut self) -> Result<(), Damage> {
        let mut statement = self.db.prepare_cached(FETCH)?;
        let ([first, second, third], (time, id)) = (ids(&self.read), self.last);
        let longest = MAX_MESSAGE_BYTES as i64;
        let mut rows = statement.query(params![
            longest,
            first,
            second,
            third,
            time,
            id,
            BATCH_ROWS as i64
        ])?;
        while let Some(row) = rows.next()? {
            let topic: i64 = row.get(2)?;
            let Some(&(_, kind, format)) = self.read.iter().find(|(id, ..)| *id == topic) else {
                continue;
            };
            // text, a number or NULL in place of the blob: an empty payload, which counts as
            // malformed
            let payload = row.get_ref(3)?.as_blob().unwrap_or_default().to_vec();
            let (id, time) = (row.get(0)?, row.get(1)?);
            if (time, id) <= self.last {
                return Err(Damage::RowOrder);
            }
            self.last = (time, id);
            self.rows.push_back(RawMessage {
                kind,
                format,
                payload: payload.into(),
                logged_ns: time,
                place: FilePlace::Row(id),
            });
        }
        self.done = self.rows.len() < BATCH_ROWS;
        Ok(())
    }
}

impl RecordingFile for Db3Reader {
    fn topics(&self) -> Vec<TopicInfo> {
        self.topics.clone()
    }

    /// Reads through the table once.
    fn promised(&self) -> Option<u64> {
        let count = "SELECT count(*) FROM messages WHERE topic_id IN (?1, ?2, ?3)";
        let found = self
            .db
            .query_row(count, ids(&self.read), |row| row.get::<_, i64>(0));
        found.ok().and_then(|n| u64::try_from(n).ok())
    }

    /// A `-wal` or `-journal` file beside it holds unmerged transactions.
    fn truncated(&self) -> bool {
        self.truncated
    }

    fn next_message(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError> {
        if self.rows.is_empty()
            && !self.done
            && let Err(damage) = self.fetch()
        {
            self.failed = Some(damage);
            self.done = true;
        }
        match self.rows.pop_front() {
            None => self
                .failed
                .take()
                .map_or(Ok(None), |damage| Err(self.damaged(damage))),
            message => Ok(message),
        }
    }
}

/// Rows of the topics in use: at most three.
fn ids(read: &[(i64, TopicKind, MessageFormat)]) -> [Option<i64>; 3] {
    [0, 1, 2].map(|at| read.get(at).map(|(id, ..)| *id))
}

fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
        | OpenFlags::SQLITE_OPEN_URI
        | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let db = Connection::open_with_flags(immutable_uri(path), flags)?;
    // the file is untrusted: no functions from its schema, no cells that leave their page, no
    // unbounded value
    db.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES)?;
    db.pragma_update(None, "trusted_schema", false)?;
    db.pragma_update(None, "cell_size_check", true)?;
    Ok(db)
}

/// `file:` URI with every special byte escaped.
fn immutable_uri(path: &Path) -> String {
    let mut uri = String::from("file:");
    for byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => {
                uri.push(char::from(*byte))
            }
            _ => uri.push_str(&format!("%{byte:02X}")),
        }
    }
    uri.push_str("?immutable=1");
    uri
}

fn has_tables(db: &Connection) -> rusqlite::Result<bool> {
    // a virtual table has no root page
    let count = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND rootpage > 0 AND name IN ('topics', 'messages')";
    db.query_row(count, [], |row| row.get::<_, i64>(0))
        .map(|tables| tables == 2)
}

fn read_topics(db: &Connection) -> Result<Vec<(i64, TopicInfo)>, Damage> {
    let mut statement =
        db.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id LIMIT ?1")?;
    let mut rows = statement.query([MAX_TOPICS as i64])?;
    let (mut topics, mut name_bytes) = (Vec::new(), NameBytes::default());
    while let Some(row) = rows.next()? {
        let info = TopicInfo {
            name: row.get(1)?,
            type_name: row.get(2)?,
            encoding: row.get(3)?,
        };
        name_bytes.take(info.name_bytes(), 0)?;
        topics.push((row.get(0)?, info));
    }
    Ok(topics)
}

/// SQLite reads a cut last page as if it ended in zeros (whole missing pages it refuses itself).
fn find_cut(db: &Connection, path: &Path) -> Result<(), Damage> {
    let page_bytes = db.pragma_query_value(None, "page_size", |row| row.get::<_, u32>(0))?;
    match fs::metadata(path)?.len() % u64::from(page_bytes) {
        0 => Ok(()),
        left => Err(Damage::Cut {
            wanted: page_bytes.into(),
            left,
        }),
    }
}

fn has_unmerged_part(path: &Path) -> bool {
    ["-wal", "-journal"].iter().any(|suffix| {
        let mut beside = OsString::from(path);
        beside.push(suffix);
        fs::metadata(beside).is_ok_and(|file| file.len() > 0)
    })
}

/// Unpacks a whole file into the folder for temporary files.
fn unpack(path: &Path) -> Result<NamedTempFile, RecordingError> {
    let unpack = || -> io::Result<(u64, NamedTempFile)> {
        let mut plain = NamedTempFile::new()?;
        let mut packed = zstd::Decoder::new(fs::File::open(path)?)?.take(MAX_UNPACKED_BYTES + 1);
        Ok((io::copy(&mut packed, &mut plain)?, plain))
    };
    let (bytes, plain) = unpack().map_err(|source| RecordingError::Io {
        path: path.to_owned(),
        source,
    })?;
    if bytes > MAX_UNPACKED_BYTES {
        let damage = Damage::TooLong {
            what: "unpacked file",
            bytes,
            limit: MAX_UNPACKED_BYTES,
        };
        return Err(RecordingError::Damaged {
            path: path.to_owned(),
            place: FilePlace::Row(0),
            damage,
        });
    }
    Ok(plain)
}
