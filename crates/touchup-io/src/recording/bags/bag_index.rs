//! The headers of the records of a ROS 1 bag, its connections and its index.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::recording::Damage;
use crate::recording::layout::{RecordingLayout, TopicInfo};
use crate::recording::mcap_files::chunked::{DescribedTopics, FileIndex};
use crate::recording::mcap_files::framing::{Fields, check_length};

pub(in crate::recording) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Length in front of a header, and in front of data.
pub(in crate::recording) const LENGTH_BYTES: u64 = 4;
const NS_PER_S: i64 = 1_000_000_000;

/// Kinds of records.
pub(in crate::recording) mod op {
    pub const MESSAGE: u8 = 0x02;
    pub const CHUNK: u8 = 0x05;
    pub const CHUNK_INFO: u8 = 0x06;
    pub const CONNECTION: u8 = 0x07;
}

/// Fields in use of a record's header; 0 and empty if absent.
#[derive(Default)]
pub(in crate::recording) struct RecordHeader<'a> {
    pub op: u8,
    pub connection: u32,
    /// time of reception by the recorder
    pub time_ns: i64,
    pub topic: &'a [u8],
    pub compression: &'a [u8],
    /// of a chunk, unpacked
    pub size: u32,
    /// of the bag: start of the index
    index_at: u64,
    /// entries of a chunk's info
    count: u32,
}

impl<'a> RecordHeader<'a> {
    pub fn of(header: &'a [u8]) -> Result<Self, Damage> {
        let mut head = Self::default();
        for (name, value) in named_fields(header)? {
            let mut value = Fields(value);
            match name {
                b"op" => head.op = value.u8("op")?,
                b"conn" => head.connection = value.u32("conn")?,
                b"time" => {
                    let [sec, nanosec] = [value.u32("time")?, value.u32("time")?];
                    head.time_ns = i64::from(sec) * NS_PER_S + i64::from(nanosec);
                }
                b"topic" => head.topic = value.0,
                b"compression" => head.compression = value.0,
                b"size" => head.size = value.u32("size")?,
                b"index_pos" => head.index_at = value.u64("index_pos")?,
                b"count" => head.count = value.u32("count")?,
                _ => {}
            }
        }
        Ok(head)
    }
}

/// Name and value.
type NamedField<'a> = (&'a [u8], &'a [u8]);

/// `name=value`, each with its length in front.
fn named_fields(bytes: &[u8]) -> Result<Vec<NamedField<'_>>, Damage> {
    let (mut rest, mut fields) = (Fields(bytes), Vec::new());
    while !rest.0.is_empty() {
        let field = rest.sized("field of a header")?;
        let sign = field
            .iter()
            .position(|byte| *byte == b'=')
            .ok_or(Damage::Field("name of a field"))?;
        fields.push((&field[..sign], &field[sign + 1..]));
    }
    Ok(fields)
}

/// Connections up to now: a topic has one for each of its publishers.
#[derive(Default)]
pub(in crate::recording) struct Connections {
    pub topics: DescribedTopics,
}

/// Memory of a connection beside its names.
const CONNECTION_BYTES: usize = 128;

impl Connections {
    pub fn add(&mut self, head: &RecordHeader, data: &[u8]) -> Result<(), Damage> {
        let fields = named_fields(data)?;
        let named = |wanted: &[u8]| {
            fields
                .iter()
                .find(|(name, _)| *name == wanted)
                .map(|(_, value)| *value)
        };
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let type_name = named(b"type").map_or_else(|| "without a type".to_owned(), text);
        let info = TopicInfo {
            name: text(head.topic),
            type_name,
            encoding: "ros1".to_owned(),
        };
        self.topics.add(head.connection, info, CONNECTION_BYTES)
    }
}

/// The index at the end of the bag; `None` without one, as in a bag of a killed recorder: then the
/// reader searches the data.
pub(in crate::recording) fn read_index(
    path: &Path,
    layout: &RecordingLayout,
) -> Option<FileIndex<Connections>> {
    let mut file = File::open(path).ok()?;
    let size = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(MAGIC.len() as u64)).ok()?;
    let mut length = [0; LENGTH_BYTES as usize];
    file.read_exact(&mut length).ok()?;
    let length = u64::from(u32::from_le_bytes(length));
    check_length("header of the bag", length).ok()?;
    let mut header = Vec::new();
    file.by_ref().take(length).read_to_end(&mut header).ok()?;
    let start = RecordHeader::of(&header).ok()?.index_at;
    let length = size.checked_sub(start).filter(|_| start > 0)?;
    check_length("index", length).ok()?;
    file.seek(SeekFrom::Start(start)).ok()?;
    let mut records = Vec::new();
    file.take(length).read_to_end(&mut records).ok()?;
    let mut connections = Connections::default();
    let counts = read_counts(&mut connections, &records).ok()?;
    Some(FileIndex {
        promised: Some(connections.topics.promised(&counts, layout)),
        format: connections,
        is_complete: true,
    })
}

/// Adds the connections of an index; returns the number of messages of each.
fn read_counts(
    connections: &mut Connections,
    records: &[u8],
) -> Result<BTreeMap<u32, u64>, Damage> {
    let (mut rest, mut counts) = (Fields(records), BTreeMap::new());
    while !rest.0.is_empty() {
        let (header, data) = (
            rest.sized("header of a record")?,
            rest.sized("data of a record")?,
        );
        let head = RecordHeader::of(header)?;
        match head.op {
            op::CONNECTION => connections.add(&head, data)?,
            op::CHUNK_INFO => {
                let mut infos = Fields(data);
                for _ in 0..head.count {
                    let (id, count) = (infos.u32("chunk info")?, infos.u32("chunk info")?);
                    if !connections.topics.infos.contains_key(&id) {
                        return Err(Damage::Field("connection of a chunk info"));
                    }
                    *counts.entry(id).or_default() += u64::from(count);
                }
            }
            _ => {}
        }
    }
    Ok(counts)
}
