//! Reads MCAP from the front, record by record [MCAP specification, mcap.dev/spec].
//!
//! Framing and checks are done here, not by the `mcap` crate (0.26), which reserves memory for any
//! string length it meets and overflows on an unchecked chunk whose records overrun it. Here each
//! length is first compared with the rest of the file and with a limit of 256 MiB, buffers grow
//! only with bytes that are really there, and a chunk is verified before its first message is
//! returned.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::framing::{
    ByteStream, Fields, HEAD_BYTES, NameBytes, check_crc, check_length, op, split_record,
};
use crate::recording::error::Damage;
use crate::recording::error::RecordingError;
use crate::recording::layout::TopicInfo;
use crate::recording::layout::TopicKind;
use crate::recording::messages::message_type::MessageFormat;
use crate::recording::recording_file::RawMessage;
use crate::recording::recording_file::RecordingFile;
use crate::recording::topics::check_topic;
use crate::recording::{FilePlace, RecordingLayout};

pub(in crate::recording) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Footer record and the magic behind it.
const TAIL_BYTES: usize = HEAD_BYTES + 20 + MAGIC.len();
/// Topic and its format, place of the payload in the records, log time, ns.
type McapMessage = (TopicKind, MessageFormat, Range<usize>, i64);

/// Channel, sequence, log time and publish time in front of a message's payload.
const MESSAGE_HEAD_BYTES: usize = 22;

/// Messages of the topics of a touch of one MCAP file, in the order of the file.
pub(in crate::recording) struct McapReader {
    path: PathBuf,
    layout: RecordingLayout,
    stream: ByteStream,
    described: McapChannels,
    /// Content of the channels in use.
    read: BTreeMap<u16, (TopicKind, MessageFormat)>,
    /// One record as stored in the file.
    packed: Vec<u8>,
    /// Records of the current chunk.
    records: Vec<u8>,
    next: usize,
    /// Offset of the current chunk or record.
    at: u64,
    found: u64,
    promised: Option<u64>,
    truncated: bool,
}

impl McapReader {
    /// Opens a file, or a stream that unpacks one, and finds its topics of a touch.
    ///
    /// With a usable index at the end of the file this takes one seek; without, it reads records
    /// until all topics are described. Damage in that search is returned beside the reader.
    pub fn open(
        path: &Path,
        layout: &RecordingLayout,
        packed: bool,
    ) -> Result<(Self, Option<RecordingError>), RecordingError> {
        let index = if packed {
            None
        } else {
            McapSummary::read(path)
        };
        let mut reader = Self::start(path, layout, packed)?;
        reader.truncated = !packed && index.is_none();
        if let Some(index) = index {
            reader.promised = index.promised(layout);
            if index.described.has(layout) || index.checked {
                reader.knows(index.described);
                return Ok((reader, None));
            }
        }
        let mut scout = Self::start(path, layout, packed)?;
        let damage = scout.describe().err();
        reader.knows(scout.described);
        Ok((reader, damage))
    }

    fn start(path: &Path, layout: &RecordingLayout, packed: bool) -> Result<Self, RecordingError> {
        let io = |source| RecordingError::Io {
            path: path.to_owned(),
            source,
        };
        let stream = ByteStream::open(path, packed).map_err(io)?;
        let mut reader = Self {
            path: path.to_owned(),
            layout: layout.clone(),
            stream,
            described: McapChannels::default(),
            read: BTreeMap::new(),
            packed: Vec::new(),
            records: Vec::new(),
            next: 0,
            at: 0,
            found: 0,
            promised: None,
            truncated: false,
        };
        let loaded = reader.stream.load(MAGIC.len() as u64, &mut reader.packed);
        loaded.map_err(|damage| reader.damaged(damage))?;
        Ok(reader)
    }

    /// Takes over descriptions found elsewhere; a topic of a wrong type is an error of the caller's
    /// topic check.
    fn knows(&mut self, described: McapChannels) {
        let read = described.channels.iter();
        let read = read.filter_map(|(id, info)| {
            Some((*id, check_topic(&self.path, &self.layout, info).ok()??))
        });
        self.read = read.collect();
        self.described = described;
    }

    /// Reads on until all topics are described.
    fn describe(&mut self) -> Result<(), RecordingError> {
        while !self.described.has(&self.layout) && self.advance()?.is_some() {}
        Ok(())
    }

    fn damaged(&self, damage: Damage) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.clone(),
            place: FilePlace::Byte(self.at),
            damage,
        }
    }

    fn advance(&mut self) -> Result<Option<McapMessage>, RecordingError> {
        loop {
            while self.next < self.records.len() {
                if let Some(message) = self.next_record()? {
                    return Ok(Some(message));
                }
            }
            if !self.refill().map_err(|damage| self.damaged(damage))? {
                return Ok(None);
            }
        }
    }

    /// Takes one record of the current chunk; a message of the topics of a touch gives its
    /// payload's place in `records`.
    fn next_record(&mut self) -> Result<Option<McapMessage>, RecordingError> {
        let (opcode, body) =
            split_record(&self.records[self.next..]).map_err(|damage| self.damaged(damage))?;
        let start = self.next + HEAD_BYTES;
        self.next = start + body.len();
        match opcode {
            op::SCHEMA => self
                .described
                .add_schema(body)
                .map_err(|damage| self.damaged(damage))?,
            op::CHANNEL => {
                let id = self
                    .described
                    .add_channel(body)
                    .map_err(|damage| self.damaged(damage))?;
                let info = &self.described.channels[&id];
                match check_topic(&self.path, &self.layout, info)? {
                    Some(read) => self.read.insert(id, read),
                    None => self.read.remove(&id),
                };
            }
            op::MESSAGE => {
                let mut head = Fields(body);
                let channel = head
                    .u16("channel of a message")
                    .map_err(|damage| self.damaged(damage))?;
                if !self.described.channels.contains_key(&channel) {
                    return Err(self.damaged(Damage::Undescribed {
                        what: "channel",
                        id: channel,
                    }));
                }
                if body.len() < MESSAGE_HEAD_BYTES {
                    return Err(self.damaged(Damage::Field("head of a message")));
                }
                let mut logged = || {
                    head.u32("sequence of a message")
                        .and_then(|_| head.u64("log time of a message"))
                };
                let logged = logged().map_err(|damage| self.damaged(damage))?;
                let logged_ns = i64::try_from(logged).unwrap_or(i64::MAX);
                let payload = start + MESSAGE_HEAD_BYTES..self.next;
                return Ok(self
                    .read
                    .get(&channel)
                    .map(|&(kind, format)| (kind, format, payload, logged_ns)));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Loads the next chunk, or the next record outside of chunks; `false` at the end of the data.
    fn refill(&mut self) -> Result<bool, Damage> {
        self.next = 0;
        self.records.clear();
        loop {
            self.at = self.stream.at;
            let Some((opcode, len)) = self.stream.head()? else {
                self.truncated = true;
                return Ok(false);
            };
            self.packed.clear();
            match opcode {
                op::CHUNK => {
                    self.stream.load(len, &mut self.packed)?;
                    unpack_chunk(&self.packed, &mut self.records)?;
                    return Ok(true);
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    self.records.push(opcode);
                    self.records.extend(len.to_le_bytes());
                    self.stream.load(len, &mut self.records)?;
                    return Ok(true);
                }
                op::DATA_END => {
                    let computed = self.stream.crc.clone().finalize();
                    self.stream.load(len, &mut self.packed)?;
                    check_crc(
                        "the data section",
                        Fields(&self.packed).u32("data end")?,
                        computed,
                    )?;
                    return Ok(false);
                }
                op::FOOTER => return Ok(false),
                _ => self.stream.skip(len, &mut self.packed)?,
            }
        }
    }
}

impl RecordingFile for McapReader {
    fn topics(&self) -> Vec<TopicInfo> {
        self.described.channels.values().cloned().collect()
    }

    fn promised(&self) -> Option<u64> {
        self.promised
    }

    fn truncated(&self) -> bool {
        self.truncated
    }

    fn next_message(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError> {
        let Some((kind, format, payload, logged_ns)) = self.advance()? else {
            return match self.promised {
                Some(promised) if promised != self.found => {
                    Err(self.damaged(Damage::MessageCount {
                        promised,
                        found: self.found,
                    }))
                }
                _ => Ok(None),
            };
        };
        self.found += 1;
        let (payload, place) = (
            Cow::Borrowed(&self.records[payload]),
            FilePlace::Byte(self.at),
        );
        Ok(Some(RawMessage {
            kind,
            format,
            payload,
            logged_ns,
            place,
        }))
    }
}

/// Unpacks the records of a chunk, for which `records` is empty, and verifies them.
fn unpack_chunk(chunk: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    let mut fields = Fields(chunk);
    let _start_and_end_time = fields.bytes(16, "times of a chunk")?;
    let announced = fields.u64("size of a chunk")?;
    let crc = fields.u32("checksum of a chunk")?;
    let compression = fields.text("compression of a chunk")?;
    let packed_len = fields.u64("packed size of a chunk")?;
    let packed = fields.bytes(packed_len, "records of a chunk")?;
    check_length("unpacked chunk", announced)?;
    // one byte beyond the announced size reveals an excess
    let limit = announced + 1;
    match compression.as_str() {
        "" => packed.take(limit).read_to_end(records)?,
        "zstd" => zstd::Decoder::with_buffer(packed)?
            .take(limit)
            .read_to_end(records)?,
        "lz4" => lz4::Decoder::new(packed)?
            .take(limit)
            .read_to_end(records)?,
        _ => return Err(Damage::Compression(compression)),
    };
    let found = records.len() as u64;
    if found != announced {
        return Err(Damage::ChunkSize { announced, found });
    }
    check_crc("a chunk", crc, crc32fast::hash(records))
}

/// Schemas and channels up to now; at most 65,536 of each.
#[derive(Default)]
struct McapChannels {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, TopicInfo>,
    name_bytes: NameBytes,
}

impl McapChannels {
    fn add_schema(&mut self, body: &[u8]) -> Result<(), Damage> {
        let mut fields = Fields(body);
        let id = fields.u16("number of a schema")?;
        let name = fields.text("name of a schema")?;
        self.name_bytes
            .take(name.len(), self.schemas.get(&id).map_or(0, String::len))?;
        self.schemas.insert(id, name);
        Ok(())
    }

    fn add_channel(&mut self, body: &[u8]) -> Result<u16, Damage> {
        let mut fields = Fields(body);
        let id = fields.u16("number of a channel")?;
        let schema = fields.u16("schema of a channel")?;
        let (name, encoding) = (
            fields.text("topic of a channel")?,
            fields.text("encoding of a channel")?,
        );
        let type_name = match self.schemas.get(&schema) {
            Some(type_name) => type_name.clone(),
            None if schema == 0 => "without a type".to_owned(),
            None => {
                return Err(Damage::Undescribed {
                    what: "schema",
                    id: schema,
                });
            }
        };
        let info = TopicInfo {
            name,
            type_name,
            encoding,
        };
        self.name_bytes.take(
            info.name_bytes(),
            self.channels.get(&id).map_or(0, TopicInfo::name_bytes),
        )?;
        self.channels.insert(id, info);
        Ok(id)
    }

    fn has(&self, layout: &RecordingLayout) -> bool {
        layout.needed().all(|kind| {
            self.channels
                .values()
                .any(|info| layout.is_topic(kind, &info.name))
        })
    }
}

/// The summary at the end of the file.
struct McapSummary {
    described: McapChannels,
    /// Messages on each channel, if the file has statistics.
    counts: Option<BTreeMap<u16, u64>>,
    /// It has a correct checksum.
    checked: bool,
}

impl McapSummary {
    /// `None` when the file's end is missing or damaged: then the reader searches the data.
    fn read(path: &Path) -> Option<Self> {
        let mut file = File::open(path).ok()?;
        let tail_start = file.metadata().ok()?.len().checked_sub(TAIL_BYTES as u64)?;
        let mut tail = [0; TAIL_BYTES];
        file.seek(SeekFrom::Start(tail_start)).ok()?;
        file.read_exact(&mut tail).ok()?;
        let (footer, magic) = tail.split_at(TAIL_BYTES - MAGIC.len());
        let (opcode, body) = split_record(footer).ok()?;
        if magic != MAGIC || opcode != op::FOOTER {
            return None;
        }
        let start = Fields(body).u64("start of the summary").ok()?;
        let crc = Fields(body.get(16..)?)
            .u32("checksum of the summary")
            .ok()?;
        let mut index = Self {
            described: McapChannels::default(),
            counts: None,
            checked: false,
        };
        if start == 0 {
            return Some(index);
        }
        let len = tail_start.checked_sub(start)?;
        check_length("summary", len).ok()?;
        file.seek(SeekFrom::Start(start)).ok()?;
        let mut summary = Vec::new();
        file.take(len + (HEAD_BYTES + 16) as u64)
            .read_to_end(&mut summary)
            .ok()?;
        check_crc("the summary", crc, crc32fast::hash(&summary)).ok()?;
        index.checked = crc != 0;
        index
            .add_records(summary.get(..usize::try_from(len).ok()?)?)
            .ok()?;
        Some(index)
    }

    fn add_records(&mut self, mut records: &[u8]) -> Result<(), Damage> {
        while !records.is_empty() {
            let (opcode, body) = split_record(records)?;
            records = &records[HEAD_BYTES + body.len()..];
            match opcode {
                op::SCHEMA => self.described.add_schema(body)?,
                op::CHANNEL => drop(self.described.add_channel(body)?),
                op::STATISTICS => self.counts = Some(read_counts(body)?),
                _ => {}
            }
        }
        Ok(())
    }

    /// Messages on the topics of a touch.
    fn promised(&self, layout: &RecordingLayout) -> Option<u64> {
        let counts = self.counts.as_ref()?;
        let wanted = |id: &u16| {
            self.described
                .channels
                .get(id)
                .is_some_and(|c| layout.kind_of(&c.name).is_some())
        };
        Some(
            counts
                .iter()
                .filter(|(id, _)| wanted(id))
                .fold(0, |sum: u64, (_, n)| sum.saturating_add(*n)),
        )
    }
}

fn read_counts(body: &[u8]) -> Result<BTreeMap<u16, u64>, Damage> {
    let mut fields = Fields(body);
    let _totals_and_times = fields.bytes(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8, "statistics")?;
    let len = fields.u32("message counts")?;
    let mut pairs = Fields(fields.bytes(len.into(), "message counts")?);
    let mut counts = BTreeMap::new();
    while !pairs.0.is_empty() {
        counts.insert(pairs.u16("message counts")?, pairs.u64("message counts")?);
    }
    Ok(counts)
}
