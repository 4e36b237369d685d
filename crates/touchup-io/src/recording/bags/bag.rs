//! Reads ROS 1 bags, version 2.0, from the front, record by record [wiki.ros.org/Bags/Format/2.0].
//!
//! The framing is read here, not by the `rosbag` crate (0.6), which maps the file into memory, so
//! that a concurrent truncation ends the program, and allocates the announced size of a chunk. Here
//! each length is compared with the available bytes and with a limit first.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::bag_index::{BagIndex, Connections, LENGTH_BYTES, MAGIC, RecordHeader, op};
use crate::recording::error::Damage;
use crate::recording::error::RecordingError;
use crate::recording::layout::TopicInfo;
use crate::recording::layout::TopicKind;
use crate::recording::mcap_files::framing::{ByteStream, Fields, check_length};
use crate::recording::messages::message_type::MessageFormat;
use crate::recording::recording_file::RawMessage;
use crate::recording::recording_file::RecordingFile;
use crate::recording::topics::check_topic;
use crate::recording::{FilePlace, RecordingLayout};

/// Topic and its format, place of the payload in the records, log time, ns.
type BagMessage = (TopicKind, MessageFormat, Range<usize>, i64);

/// Messages of the topics of a touch of one bag, in the order of the file.
pub(in crate::recording) struct BagReader {
    path: PathBuf,
    layout: RecordingLayout,
    stream: ByteStream,
    connections: Connections,
    /// Content of the connections in use.
    read: BTreeMap<u32, (TopicKind, MessageFormat)>,
    header: Vec<u8>,
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

impl BagReader {
    /// Opens a bag and finds its topics: from its index, or, without one, by reading until all
    /// topics are described. Damage in that search is returned beside the reader.
    pub fn open(
        path: &Path,
        layout: &RecordingLayout,
    ) -> Result<(Self, Option<RecordingError>), RecordingError> {
        let mut reader = Self::start(path, layout)?;
        let index = BagIndex::read(path);
        reader.truncated = index.is_none();
        if let Some(index) = index {
            reader.promised = Some(index.promised(layout));
            reader.knows(index.connections);
            return Ok((reader, None));
        }
        let mut scout = Self::start(path, layout)?;
        let damage = scout.describe().err();
        reader.knows(scout.connections);
        Ok((reader, damage))
    }

    fn start(path: &Path, layout: &RecordingLayout) -> Result<Self, RecordingError> {
        let io = |source| RecordingError::Io {
            path: path.to_owned(),
            source,
        };
        let mut reader = Self {
            path: path.to_owned(),
            layout: layout.clone(),
            stream: ByteStream::open(path, false).map_err(io)?,
            connections: Connections::default(),
            read: BTreeMap::new(),
            header: Vec::new(),
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
    fn knows(&mut self, connections: Connections) {
        let read = connections.topics.iter();
        let read = read.filter_map(|(id, info)| {
            Some((*id, check_topic(&self.path, &self.layout, info).ok()??))
        });
        self.read = read.collect();
        self.connections = connections;
    }

    fn describe(&mut self) -> Result<(), RecordingError> {
        while !self.connections.has(&self.layout) && self.advance()?.is_some() {}
        Ok(())
    }

    fn damaged(&self, damage: Damage) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.clone(),
            place: FilePlace::Byte(self.at),
            damage,
        }
    }

    fn advance(&mut self) -> Result<Option<BagMessage>, RecordingError> {
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
    fn next_record(&mut self) -> Result<Option<BagMessage>, RecordingError> {
        let damaged = |damage| RecordingError::Damaged {
            path: self.path.clone(),
            place: FilePlace::Byte(self.at),
            damage,
        };
        let mut rest = Fields(&self.records[self.next..]);
        let mut split = || {
            Ok::<_, Damage>((
                rest.sized("header of a record")?,
                rest.sized("data of a record")?,
            ))
        };
        let (header, data) = split().map_err(damaged)?;
        let head = RecordHeader::of(header).map_err(damaged)?;
        self.next = self.records.len() - rest.0.len();
        match head.op {
            op::CONNECTION => {
                let info = self.connections.add(&head, data).map_err(damaged)?;
                match check_topic(&self.path, &self.layout, info)? {
                    Some(read) => self.read.insert(head.connection, read),
                    None => self.read.remove(&head.connection),
                };
                Ok(None)
            }
            op::MESSAGE => {
                let payload = self.next - data.len()..self.next;
                let read = self.read.get(&head.connection);
                Ok(read.map(|&(kind, format)| (kind, format, payload, head.time_ns)))
            }
            _ => Ok(None),
        }
    }

    /// Loads the next chunk, or the next record outside of chunks; `false` at the end of the file.
    fn refill(&mut self) -> Result<bool, Damage> {
        self.next = 0;
        self.records.clear();
        loop {
            self.at = self.stream.at;
            self.header.clear();
            if !self.stream.front(LENGTH_BYTES, &mut self.header)? {
                return Ok(false);
            }
            let length = Fields(&self.header).u32("length of a header")?;
            self.header.clear();
            self.stream.load(length.into(), &mut self.header)?;
            self.packed.clear();
            self.stream.load(LENGTH_BYTES, &mut self.packed)?;
            let length = Fields(&self.packed).u32("length of data")?;
            let head = RecordHeader::of(&self.header)?;
            self.packed.clear();
            match head.op {
                op::CHUNK => {
                    self.stream.load(length.into(), &mut self.packed)?;
                    unpack_chunk(&head, &self.packed, &mut self.records)?;
                    return Ok(true);
                }
                op::CONNECTION | op::MESSAGE => {
                    self.records
                        .extend((self.header.len() as u32).to_le_bytes());
                    self.records.extend(&self.header);
                    self.records.extend(length.to_le_bytes());
                    self.stream.load(length.into(), &mut self.records)?;
                    return Ok(true);
                }
                _ => self.stream.skip(length.into(), &mut self.packed)?,
            }
        }
    }
}

impl RecordingFile for BagReader {
    fn topics(&self) -> Vec<TopicInfo> {
        self.connections.topics.values().cloned().collect()
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

/// Unpacks the records of a chunk, for which `records` is empty.
fn unpack_chunk(head: &RecordHeader, packed: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    let announced = u64::from(head.size);
    check_length("unpacked chunk", announced)?;
    // one byte beyond the announced size reveals an excess
    let limit = announced + 1;
    match head.compression {
        b"none" => packed.take(limit).read_to_end(records)?,
        b"bz2" => bzip2::read::BzDecoder::new(packed)
            .take(limit)
            .read_to_end(records)?,
        b"lz4" => lz4::Decoder::new(packed)?
            .take(limit)
            .read_to_end(records)?,
        other => return Err(Damage::Compression(other.escape_ascii().to_string())),
    };
    let found = records.len() as u64;
    if found == announced {
        Ok(())
    } else {
        Err(Damage::ChunkSize { announced, found })
    }
}
