//! Reads a file of records, alone or in chunks, from the front: an MCAP file, or a ROS 1 bag.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::framing::{ByteStream, NameBytes, check_length};
use crate::recording::error::{Damage, RecordingError};
use crate::recording::layout::{TopicInfo, TopicKind};
use crate::recording::messages::message_type::MessageFormat;
use crate::recording::recording_file::{RawMessage, RecordingFile};
use crate::recording::topics::check_topic;
use crate::recording::{FilePlace, RecordingLayout};

/// A message of a file.
pub(in crate::recording) struct StoredMessage {
    /// number of its channel or connection
    pub topic: u32,
    /// its place in the records
    pub payload: Range<usize>,
    /// time of reception by the recorder, ns
    pub logged_ns: i64,
}

/// Content and format of a topic in use.
type TopicContent = (TopicKind, MessageFormat);

/// Content of a record.
pub(in crate::recording) enum RecordContent {
    /// a description of the topic with this number
    Topic(u32),
    Message(StoredMessage),
    Other,
}

/// A format of records; it holds the descriptions up to now.
pub(in crate::recording) trait RecordFormat: Default + Send {
    /// Length of the bytes in front of the first record.
    const MAGIC_BYTES: u64;

    fn topics(&self) -> &DescribedTopics;

    /// Loads the next chunk, or the next record outside of chunks, into the empty records; `false`
    /// at the end of the data.
    fn refill(source: &mut RecordSource) -> Result<bool, Damage>;

    /// Reads the record at `next`, and moves `next` behind it.
    fn read_record(&mut self, records: &[u8], next: &mut usize) -> Result<RecordContent, Damage>;
}

/// Topics by the number of their channel or connection.
#[derive(Default)]
pub(in crate::recording) struct DescribedTopics {
    pub infos: BTreeMap<u32, TopicInfo>,
    pub name_bytes: NameBytes,
}

impl DescribedTopics {
    /// Adds a topic, or describes it anew.
    ///
    /// - `entry_bytes`: memory of a topic beside its names.
    pub fn add(&mut self, id: u32, info: TopicInfo, entry_bytes: usize) -> Result<(), Damage> {
        let bytes = |info: &TopicInfo| info.name_bytes() + entry_bytes;
        let replaced = self.infos.get(&id).map_or(0, bytes);
        self.name_bytes.take(bytes(&info), replaced)?;
        self.infos.insert(id, info);
        Ok(())
    }

    pub fn has(&self, layout: &RecordingLayout) -> bool {
        layout.needed().all(|kind| {
            self.infos
                .values()
                .any(|info| layout.is_topic(kind, &info.name))
        })
    }

    /// Number of messages on the topics of a touch.
    ///
    /// - `counts`: messages of each topic.
    pub fn promised(&self, counts: &BTreeMap<u32, u64>, layout: &RecordingLayout) -> u64 {
        let is_used = |info: &TopicInfo| layout.kind_of(&info.name).is_some();
        counts
            .iter()
            .filter(|(id, _)| self.infos.get(id).is_some_and(is_used))
            .fold(0, |sum: u64, (_, count)| sum.saturating_add(*count))
    }
}

/// Descriptions at the end of a file.
pub(in crate::recording) struct FileIndex<F> {
    pub format: F,
    /// number of messages on the topics of a touch
    pub promised: Option<u64>,
    /// no other topics are in the file
    pub is_complete: bool,
}

/// A file, and its current chunk or record.
pub(in crate::recording) struct RecordSource {
    pub stream: ByteStream,
    /// one record as stored in the file
    pub packed: Vec<u8>,
    /// records of the current chunk
    pub records: Vec<u8>,
    /// offset of the current chunk or record
    pub at: u64,
    pub truncated: bool,
}

/// Messages of the topics of a touch of one file, in the order of the file.
pub(in crate::recording) struct ChunkReader<F> {
    path: PathBuf,
    layout: RecordingLayout,
    source: RecordSource,
    described: F,
    /// content of the topics in use
    read: BTreeMap<u32, TopicContent>,
    next: usize,
    found: u64,
    promised: Option<u64>,
}

impl<F: RecordFormat> ChunkReader<F> {
    /// Opens a file, or a stream that unpacks one, and finds its topics of a touch: from a complete
    /// index, or by reading until all topics are described. Damage in that search is returned
    /// beside the reader.
    pub fn open(
        path: &Path,
        layout: &RecordingLayout,
        packed: bool,
        index: Option<FileIndex<F>>,
    ) -> Result<(Self, Option<RecordingError>), RecordingError> {
        let mut reader = Self::start(path, layout, packed)?;
        reader.source.truncated = !packed && index.is_none();
        if let Some(index) = index {
            reader.promised = index.promised;
            if index.is_complete {
                reader.knows(index.format);
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
        let mut reader = Self {
            path: path.to_owned(),
            layout: layout.clone(),
            source: RecordSource {
                stream: ByteStream::open(path, packed).map_err(io)?,
                packed: Vec::new(),
                records: Vec::new(),
                at: 0,
                truncated: false,
            },
            described: F::default(),
            read: BTreeMap::new(),
            next: 0,
            found: 0,
            promised: None,
        };
        let RecordSource { stream, packed, .. } = &mut reader.source;
        let loaded = stream.load(F::MAGIC_BYTES, packed);
        loaded.map_err(|damage| reader.damaged(damage))?;
        Ok(reader)
    }

    /// Takes over descriptions found elsewhere; a topic of a wrong type is an error of the caller's
    /// topic check.
    fn knows(&mut self, described: F) {
        let read = described.topics().infos.iter();
        let read = read.filter_map(|(id, info)| {
            Some((*id, check_topic(&self.path, &self.layout, info).ok()??))
        });
        self.read = read.collect();
        self.described = described;
    }

    /// Reads on until all topics are described.
    fn describe(&mut self) -> Result<(), RecordingError> {
        while !self.described.topics().has(&self.layout) && self.advance()?.is_some() {}
        Ok(())
    }

    fn damaged(&self, damage: Damage) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.clone(),
            place: FilePlace::Byte(self.source.at),
            damage,
        }
    }

    /// The next message of the topics of a touch, and the content of its topic.
    fn advance(&mut self) -> Result<Option<(StoredMessage, TopicContent)>, RecordingError> {
        loop {
            while self.next < self.source.records.len() {
                let records = &self.source.records;
                let record = self.described.read_record(records, &mut self.next);
                match record.map_err(|damage| self.damaged(damage))? {
                    RecordContent::Topic(id) => {
                        let info = &self.described.topics().infos[&id];
                        match check_topic(&self.path, &self.layout, info)? {
                            Some(read) => self.read.insert(id, read),
                            None => self.read.remove(&id),
                        };
                    }
                    RecordContent::Message(message) => {
                        if let Some(read) = self.read.get(&message.topic) {
                            return Ok(Some((message, *read)));
                        }
                    }
                    RecordContent::Other => {}
                }
            }
            self.next = 0;
            self.source.records.clear();
            if !F::refill(&mut self.source).map_err(|damage| self.damaged(damage))? {
                return Ok(None);
            }
        }
    }
}

impl<F: RecordFormat> RecordingFile for ChunkReader<F> {
    fn topics(&self) -> Vec<TopicInfo> {
        self.described.topics().infos.values().cloned().collect()
    }

    fn promised(&self) -> Option<u64> {
        self.promised
    }

    fn truncated(&self) -> bool {
        self.source.truncated
    }

    fn next_message(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError> {
        let Some((message, (kind, format))) = self.advance()? else {
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
        Ok(Some(RawMessage {
            kind,
            format,
            payload: Cow::Borrowed(&self.source.records[message.payload]),
            logged_ns: message.logged_ns,
            place: FilePlace::Byte(self.source.at),
        }))
    }
}

/// Unpacks the records of a chunk, for which `records` is empty.
///
/// - `announced`: their length.
pub(in crate::recording) fn unpack_chunk(
    unpacked: impl Read,
    announced: u64,
    records: &mut Vec<u8>,
) -> Result<(), Damage> {
    check_length("unpacked chunk", announced)?;
    // one byte beyond the announced size reveals an excess
    unpacked.take(announced + 1).read_to_end(records)?;
    let found = records.len() as u64;
    if found == announced {
        Ok(())
    } else {
        Err(Damage::ChunkSize { announced, found })
    }
}
