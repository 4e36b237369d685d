//! Kind of a recording file, by its first bytes.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::RecordingLayout;
use super::bags::{bag, bag_index};
use super::db3::{self, Db3Reader};
use super::mcap_files::mcap;
use crate::recording::compression::ZSTD_MAGIC;
use crate::recording::error::RecordingError;
use crate::recording::recording_file::RecordingFile;

const ROS1_MAGIC: &[u8] = b"#ROSBAG V";

/// Opens one file of a recording, with any damage met in the search for its topics.
pub(super) fn open_file(
    path: &Path,
    layout: &RecordingLayout,
) -> Result<(Box<dyn RecordingFile>, Option<RecordingError>), RecordingError> {
    let io = |source| RecordingError::Io {
        path: path.to_owned(),
        source,
    };
    let mut front = read_front(File::open(path).map_err(io)?).map_err(io)?;
    let packed = front.starts_with(&ZSTD_MAGIC);
    if packed {
        let unpacked = zstd::Decoder::new(File::open(path).map_err(io)?).and_then(read_front);
        front = unpacked.map_err(io)?;
    }
    if front.starts_with(&mcap::MAGIC) {
        let (reader, damage) = mcap::open(path, layout, packed)?;
        Ok((Box::new(reader), damage))
    } else if front == db3::MAGIC {
        Ok((Box::new(Db3Reader::open(path, layout, packed)?), None))
    } else if front.starts_with(bag_index::MAGIC) && !packed {
        let (reader, damage) = bag::open(path, layout)?;
        Ok((Box::new(reader), damage))
    } else {
        Err(RecordingError::NotARecording {
            path: path.to_owned(),
            reason: describe_front(&front),
        })
    }
}

fn read_front(input: impl Read) -> io::Result<Vec<u8>> {
    let mut front = Vec::new();
    input
        .take(db3::MAGIC.len() as u64)
        .read_to_end(&mut front)?;
    Ok(front)
}

fn describe_front(front: &[u8]) -> String {
    if front.is_empty() {
        "the file is empty".to_owned()
    } else if front.starts_with(ROS1_MAGIC) {
        "it is a ROS 1 bag of another version than 2.0, or packed as a whole; unpack it, or convert it with `rosbags-convert`".to_owned()
    } else {
        format!(
            "it begins with \"{}\", neither MCAP nor rosbag2's SQLite nor a ROS 1 bag; a table must end in .csv, .tsv, .txt or .log",
            front.escape_ascii()
        )
    }
}
