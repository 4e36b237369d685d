//! The headers of the records of a ROS 1 bag, its connections and its index.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::recording::Damage;
use crate::recording::layout::{RecordingLayout, TopicInfo};
use crate::recording::mcap_files::framing::{Fields, NameBytes, check_length};

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
    pub topics: BTreeMap<u32, TopicInfo>,
    name_bytes: NameBytes,
}

/// Memory of a connection beside its names.
const CONNECTION_BYTES: usize = 128;

impl Connections {
    pub fn add(&mut self, head: &RecordHeader, data: &[u8]) -> Result<&TopicInfo, Damage> {
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
        let bytes = |info: &TopicInfo| info.name_bytes() + CONNECTION_BYTES;
        self.name_bytes.take(
            bytes(&info),
            self.topics.get(&head.connection).map_or(0, bytes),
        )?;
        Ok(match self.topics.entry(head.connection) {
            Entry::Vacant(place) => place.insert(info),
            Entry::Occupied(mut known) => {
                known.insert(info);
                known.into_mut()
            }
        })
    }

    pub fn has(&self, layout: &RecordingLayout) -> bool {
        layout.needed().all(|kind| {
            self.topics
                .values()
                .any(|info| layout.is_topic(kind, &info.name))
        })
    }
}

/// The index at the end of the bag.
pub(in crate::recording) struct BagIndex {
    pub connections: Connections,
    /// messages of each connection
    counts: BTreeMap<u32, u64>,
}

impl BagIndex {
    /// `None` without an index, as in a bag of a killed recorder: then the reader searches the
    /// data.
    pub fn read(path: &Path) -> Option<Self> {
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
        let mut index = Self {
            connections: Connections::default(),
            counts: BTreeMap::new(),
        };
        index.add_records(&records).ok()?;
        Some(index)
    }

    fn add_records(&mut self, records: &[u8]) -> Result<(), Damage> {
        let mut rest = Fields(records);
        while !rest.0.is_empty() {
            let (header, data) = (
                rest.sized("header of a record")?,
                rest.sized("data of a record")?,
            );
            let head = RecordHeader::of(header)?;
            match head.op {
                op::CONNECTION => drop(self.connections.add(&head, data)?),
                op::CHUNK_INFO => {
                    let mut counts = Fields(data);
                    for _ in 0..head.count {
                        let (id, count) = (counts.u32("chunk info")?, counts.u32("chunk info")?);
                        if !self.connections.topics.contains_key(&id) {
                            return Err(Damage::Field("connection of a chunk info"));
                        }
                        *self.counts.entry(id).or_default() += u64::from(count);
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Messages on the topics of a touch.
    pub fn promised(&self, layout: &RecordingLayout) -> u64 {
        let topics = &self.connections.topics;
        let wanted = |id: &u32| {
            topics
                .get(id)
                .is_some_and(|info| layout.kind_of(&info.name).is_some())
        };
        self.counts
            .iter()
            .filter(|(id, _)| wanted(id))
            .fold(0, |sum: u64, (_, count)| sum.saturating_add(*count))
    }
}
