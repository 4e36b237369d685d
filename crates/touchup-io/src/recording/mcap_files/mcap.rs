//! Reads MCAP from the front, record by record [MCAP specification, mcap.dev/spec].
//!
//! Framing and checks are done here, not by the `mcap` crate (0.26), which reserves memory for any
//! string length it meets and overflows on an unchecked chunk whose records overrun it. Here each
//! length is first compared with the rest of the file and with a limit of 256 MiB, buffers grow
//! only with bytes that are really there, and a chunk is verified before its first message is
//! returned.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::chunked::{
    ChunkReader, DescribedTopics, FileIndex, RecordContent, RecordFormat, RecordSource,
    StoredMessage, unpack_chunk,
};
use super::framing::{Fields, HEAD_BYTES, check_crc, check_length, op, split_record};
use crate::recording::RecordingLayout;
use crate::recording::error::{Damage, RecordingError};
use crate::recording::layout::TopicInfo;

pub(in crate::recording) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Footer record and the magic behind it.
const TAIL_BYTES: usize = HEAD_BYTES + 20 + MAGIC.len();
/// Channel, sequence, log time and publish time in front of a message's payload.
const MESSAGE_HEAD_BYTES: usize = 22;

/// Opens a file, or a stream that unpacks one, and finds its topics of a touch.
///
/// With a usable index at the end of the file this takes one seek; without, it reads records until
/// all topics are described. Damage in that search is returned beside the reader.
pub(in crate::recording) fn open(
    path: &Path,
    layout: &RecordingLayout,
    packed: bool,
) -> Result<(ChunkReader<McapChannels>, Option<RecordingError>), RecordingError> {
    let summary = (!packed).then(|| McapSummary::read(path)).flatten();
    let index = summary.map(|summary| FileIndex {
        promised: summary
            .counts
            .map(|counts| summary.described.channels.promised(&counts, layout)),
        is_complete: summary.described.channels.has(layout) || summary.checked,
        format: summary.described,
    });
    ChunkReader::open(path, layout, packed, index)
}

impl RecordFormat for McapChannels {
    const MAGIC_BYTES: u64 = MAGIC.len() as u64;

    fn topics(&self) -> &DescribedTopics {
        &self.channels
    }

    fn refill(source: &mut RecordSource) -> Result<bool, Damage> {
        let RecordSource {
            stream,
            packed,
            records,
            ..
        } = source;
        loop {
            source.at = stream.at;
            let Some((opcode, len)) = stream.head()? else {
                source.truncated = true;
                return Ok(false);
            };
            packed.clear();
            match opcode {
                op::CHUNK => {
                    stream.load(len, packed)?;
                    unpack(packed, records)?;
                    return Ok(true);
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    records.push(opcode);
                    records.extend(len.to_le_bytes());
                    stream.load(len, records)?;
                    return Ok(true);
                }
                op::DATA_END => {
                    let computed = stream.crc.clone().finalize();
                    stream.load(len, packed)?;
                    check_crc(
                        "the data section",
                        Fields(packed).u32("data end")?,
                        computed,
                    )?;
                    return Ok(false);
                }
                op::FOOTER => return Ok(false),
                _ => stream.skip(len, packed)?,
            }
        }
    }

    fn read_record(&mut self, records: &[u8], next: &mut usize) -> Result<RecordContent, Damage> {
        let (opcode, body) = split_record(&records[*next..])?;
        let start = *next + HEAD_BYTES;
        *next = start + body.len();
        match opcode {
            op::SCHEMA => self.add_schema(body)?,
            op::CHANNEL => return self.add_channel(body).map(RecordContent::Topic),
            op::MESSAGE => {
                let mut head = Fields(body);
                let channel = head.u16("channel of a message")?;
                if !self.channels.infos.contains_key(&channel.into()) {
                    return Err(Damage::Undescribed {
                        what: "channel",
                        id: channel,
                    });
                }
                if body.len() < MESSAGE_HEAD_BYTES {
                    return Err(Damage::Field("head of a message"));
                }
                let _sequence = head.u32("sequence of a message")?;
                let logged = head.u64("log time of a message")?;
                return Ok(RecordContent::Message(StoredMessage {
                    topic: channel.into(),
                    payload: start + MESSAGE_HEAD_BYTES..*next,
                    logged_ns: i64::try_from(logged).unwrap_or(i64::MAX),
                }));
            }
            _ => {}
        }
        Ok(RecordContent::Other)
    }
}

/// Unpacks the records of a chunk, for which `records` is empty, and verifies them.
fn unpack(chunk: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    let mut fields = Fields(chunk);
    let _start_and_end_time = fields.bytes(16, "times of a chunk")?;
    let announced = fields.u64("size of a chunk")?;
    let crc = fields.u32("checksum of a chunk")?;
    let compression = fields.text("compression of a chunk")?;
    let packed_len = fields.u64("packed size of a chunk")?;
    let packed = fields.bytes(packed_len, "records of a chunk")?;
    match compression.as_str() {
        "" => unpack_chunk(packed, announced, records)?,
        "zstd" => unpack_chunk(zstd::Decoder::with_buffer(packed)?, announced, records)?,
        "lz4" => unpack_chunk(lz4::Decoder::new(packed)?, announced, records)?,
        _ => return Err(Damage::Compression(compression)),
    }
    check_crc("a chunk", crc, crc32fast::hash(records))
}

/// Schemas and channels up to now; at most 65,536 of each.
#[derive(Default)]
pub(in crate::recording) struct McapChannels {
    schemas: BTreeMap<u16, String>,
    channels: DescribedTopics,
}

impl McapChannels {
    fn add_schema(&mut self, body: &[u8]) -> Result<(), Damage> {
        let mut fields = Fields(body);
        let id = fields.u16("number of a schema")?;
        let name = fields.text("name of a schema")?;
        let replaced = self.schemas.get(&id).map_or(0, String::len);
        self.channels.name_bytes.take(name.len(), replaced)?;
        self.schemas.insert(id, name);
        Ok(())
    }

    fn add_channel(&mut self, body: &[u8]) -> Result<u32, Damage> {
        let mut fields = Fields(body);
        let id = fields.u16("number of a channel")?.into();
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
        self.channels.add(id, info, 0)?;
        Ok(id)
    }
}

/// The summary at the end of the file.
struct McapSummary {
    described: McapChannels,
    /// Messages on each channel, if the file has statistics.
    counts: Option<BTreeMap<u32, u64>>,
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
}

fn read_counts(body: &[u8]) -> Result<BTreeMap<u32, u64>, Damage> {
    let mut fields = Fields(body);
    let _totals_and_times = fields.bytes(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8, "statistics")?;
    let len = fields.u32("message counts")?;
    let mut pairs = Fields(fields.bytes(len.into(), "message counts")?);
    let mut counts = BTreeMap::new();
    while !pairs.0.is_empty() {
        counts.insert(
            pairs.u16("message counts")?.into(),
            pairs.u64("message counts")?,
        );
    }
    Ok(counts)
}
