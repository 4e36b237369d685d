//! Reads ROS 1 bags, version 2.0, from the front, record by record [wiki.ros.org/Bags/Format/2.0].
//!
//! The framing is read here, not by the `rosbag` crate (0.6), which maps the file into memory, so
//! that a concurrent truncation ends the program, and allocates the announced size of a chunk. Here
//! each length is compared with the available bytes and with a limit first.

use std::path::Path;

use super::bag_index::{Connections, LENGTH_BYTES, MAGIC, RecordHeader, op, read_index};
use crate::recording::RecordingLayout;
use crate::recording::error::{Damage, RecordingError};
use crate::recording::mcap_files::chunked::{
    ChunkReader, DescribedTopics, RecordContent, RecordFormat, RecordSource, StoredMessage,
    unpack_chunk,
};
use crate::recording::mcap_files::framing::Fields;

/// Opens a bag and finds its topics: from its index, or, without one, by reading until all topics
/// are described. Damage in that search is returned beside the reader.
pub(in crate::recording) fn open(
    path: &Path,
    layout: &RecordingLayout,
) -> Result<(ChunkReader<Connections>, Option<RecordingError>), RecordingError> {
    ChunkReader::open(path, layout, false, read_index(path, layout))
}

impl RecordFormat for Connections {
    const MAGIC_BYTES: u64 = MAGIC.len() as u64;

    fn topics(&self) -> &DescribedTopics {
        &self.topics
    }

    fn refill(source: &mut RecordSource) -> Result<bool, Damage> {
        let RecordSource {
            stream,
            packed,
            records,
            ..
        } = source;
        let mut header = Vec::new();
        loop {
            source.at = stream.at;
            header.clear();
            if !stream.front(LENGTH_BYTES, &mut header)? {
                return Ok(false);
            }
            let length = Fields(&header).u32("length of a header")?;
            header.clear();
            stream.load(length.into(), &mut header)?;
            packed.clear();
            stream.load(LENGTH_BYTES, packed)?;
            let length = Fields(packed).u32("length of data")?;
            let head = RecordHeader::of(&header)?;
            packed.clear();
            match head.op {
                op::CHUNK => {
                    stream.load(length.into(), packed)?;
                    unpack(&head, packed, records)?;
                    return Ok(true);
                }
                op::CONNECTION | op::MESSAGE => {
                    records.extend((header.len() as u32).to_le_bytes());
                    records.extend(&header);
                    records.extend(length.to_le_bytes());
                    stream.load(length.into(), records)?;
                    return Ok(true);
                }
                _ => stream.skip(length.into(), packed)?,
            }
        }
    }

    fn read_record(&mut self, records: &[u8], next: &mut usize) -> Result<RecordContent, Damage> {
        let mut rest = Fields(&records[*next..]);
        let (header, data) = (
            rest.sized("header of a record")?,
            rest.sized("data of a record")?,
        );
        let head = RecordHeader::of(header)?;
        *next = records.len() - rest.0.len();
        Ok(match head.op {
            op::CONNECTION => {
                self.add(&head, data)?;
                RecordContent::Topic(head.connection)
            }
            op::MESSAGE => RecordContent::Message(StoredMessage {
                topic: head.connection,
                payload: *next - data.len()..*next,
                logged_ns: head.time_ns,
            }),
            _ => RecordContent::Other,
        })
    }
}

fn unpack(head: &RecordHeader, packed: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    let announced = head.size.into();
    match head.compression {
        b"none" => unpack_chunk(packed, announced, records),
        b"bz2" => unpack_chunk(bzip2::read::BzDecoder::new(packed), announced, records),
        b"lz4" => unpack_chunk(lz4::Decoder::new(packed)?, announced, records),
        other => Err(Damage::Compression(other.escape_ascii().to_string())),
    }
}
